"""Scenes that many threads share and change, and the right answers to queries in each of their states."""

import hashlib
import itertools
import threading

import numpy as np

import isospline

SIZE = 28
#: Where the mesh is, or None if it is hidden.
PLACES = (None, (0.0, 0.0, 0.0), (5.0, -3.0, 2.0))
MESH = isospline.Mesh([(4, 4, 4), (24, 5, 6), (6, 23, 8), (9, 9, 25)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
#: It is never changed, and the others lie in its box: rays start at the box of a scene, so the last bits of hits depend
#: on it.
FRAME = isospline.Mesh(
    [(-9, -9, -9), (-8, -9, -9), (-9, -8, -9), (39, 39, 39), (38, 39, 39), (39, 38, 39)], [(0, 1, 2), (3, 4, 5)]
)
CAMERA = isospline.PerspectiveCamera((60, -40, 45), (13.5, 13.5, 13.5))
RAYS = CAMERA.rays((40, 30)).reshape(-1, 6)
POINTS = np.random.default_rng(0).uniform(-2, SIZE + 1, (60, 3))


def samples(seed, size=SIZE):
    """A ball with noise, in a border of zeros."""
    z, y, x = np.mgrid[:size, :size, :size] - (size - 1) / 2
    noise = np.random.default_rng(seed).normal(size=(size,) * 3)
    ball = (100 - 6 * SIZE / size * np.sqrt(x**2 + y**2 + z**2) + 8 * (SIZE / size) ** 2 * noise).astype(np.float32)
    inner = np.zeros_like(ball)
    inner[2:-2, 2:-2, 2:-2] = np.maximum(ball, 0)[2:-2, 2:-2, 2:-2]
    return inner


def digest(*arrays):
    """The hash of the bits of arrays."""
    found = hashlib.sha256()
    for array in arrays:
        array = np.ascontiguousarray(array)
        found.update(f"{array.dtype}{array.shape}".encode())
        found.update(array.tobytes())
    return found.hexdigest()


def digest_of_hits(hits):
    """The hash of all but the ids of objects, which change when an object is added again."""
    return digest(*(hits[key] for key in sorted(hits.keys()) if key != "geometry_ids"))


def picture(scene, **options):
    """The hash of a small picture."""
    return digest(isospline.render(scene, CAMERA, size=(20, 16), **options).color)


def digest_of_mesh(mesh):
    """The hash of vertices and faces."""
    return digest(mesh.vertices, mesh.faces)


def digest_of_measurement(measurement):
    """The hash of a value and its error."""
    return digest(np.array([measurement.value, measurement.error]))


#: What is asked of a `Built`, each in one call, which sees one state.
QUERIES = {
    "cast_rays": lambda built: digest_of_hits(built.scene.cast_rays(RAYS)),
    "coherent cast_rays": lambda built: digest_of_hits(built.scene.cast_rays(RAYS, coherent=True)),
    "test_occlusions": lambda built: digest(built.scene.test_occlusions(RAYS)),
    "count_intersections": lambda built: digest(built.scene.count_intersections(RAYS)),
    "list_intersections": lambda built: digest_of_hits(built.scene.list_intersections(RAYS)),
    "closest_points": lambda built: digest(built.scene.closest_points(POINTS)["distances"]),
    "picture": lambda built: picture(built.scene, light=isospline.Phong(shadows=True)),
    "ambient occlusion": lambda built: picture(built.scene, light=isospline.AmbientOcclusion(4)),
    "path tracing": lambda built: picture(built.scene, light=isospline.PathTracer(), samples=2),
    "contains": lambda built: digest(built.surface.contains(POINTS)),
    "signed_distance": lambda built: digest(built.surface.signed_distance(POINTS)),
    "sample_points": lambda built: digest(built.surface.sample_points(50).points),
    "enclosed_volume": lambda built: digest_of_measurement(built.surface.enclosed_volume(order=2)),
    "components": lambda built: digest(built.surface.components().inside_counts),
    "to_mesh": lambda built: digest_of_mesh(built.surface.to_mesh()),
}


class Built:
    """A surface and a mesh in a scene."""

    def __init__(self, surface):
        self.surface = surface
        self.scene = isospline.Scene([surface, FRAME])
        self._mesh = self.scene.add(MESH, visible=False, casts_shadow=False)

    def set_place(self, place, *, anew=False):
        """Show the mesh at a place, or hide it; `anew` removes it and adds it again. It is hidden in between."""
        if anew:
            self.scene.remove(self._mesh)
            self._mesh = self.scene.add(MESH, visible=False, casts_shadow=False)
        self.scene.set_visibility(self._mesh, visible=False, casts_shadow=False)
        if place is not None:
            transform = np.eye(4)
            transform[:3, 3] = place
            self.scene.set_transform(self._mesh, transform)
            self.scene.set_visibility(self._mesh, visible=True, casts_shadow=True)


class Subject:
    """A scene that threads share, and the answers to all queries in all of its states."""

    def __init__(self, name, make, levels):
        self.name, self.levels, self._make = name, levels, make
        self.changing = threading.Lock()
        self.shared = self.build(levels[0], None)
        self._answers = {
            (query, level, place): ask(self.build(level, place))
            for query, ask in QUERIES.items()
            for level, place in itertools.product(levels, PLACES)
        }

    def build(self, level, place):
        """A scene of its own in a state."""
        built = Built(self._make(level))
        built.set_place(place)
        return built

    def answer(self, query, level, place):
        """The right answer in a state."""
        return self._answers[query, level, place]

    def has_answer(self, query, found):
        """Whether an answer is right in any state."""
        return any(answer == found for (name, _, _), answer in self._answers.items() if name == query)


def subjects(folder):
    """All scenes; a store is written into the folder."""
    found = []
    for degree, options in ((1, {}), (2, {"closed": True}), (3, {"largest": 1})):
        volume = isospline.Volume(samples(degree), degree=degree)
        found.append(
            Subject(
                f"degree {degree}",
                lambda level, volume=volume, options=options: isospline.Isosurface(volume, level, **options),
                (40.0, 52.0, 61.5),
            )
        )
    store = isospline.convert(samples(4, 160), folder / "volume.zarr", chunk=32, spacing=(SIZE / 160,) * 3)
    opened = isospline.open_volume(store, memory_limit="34MB")
    found.append(Subject("store", lambda level: isospline.Isosurface(opened, level), (45.0, 60.0)))
    return found
