"""Triangle meshes, against VTK's FlyingEdges3D and scikit-image's marching cubes."""

import time

import numpy as np
from suite import peers, polygons
from suite.clock import spread, take_turns
from suite.goal import at_most, none_of
from suite.tables import markdown_table, with_spread

import isospline

TITLE = "Meshes"
ABOUT = """`surface.to_mesh()` with all cores, against VTK's FlyingEdges3D with as many threads and gradients as
normals, and `skimage.measure.marching_cubes` (Lewiner), which has one thread. The time of isospline includes a new
`Isosurface`, exact normals, the merging of vertices and the map to world space, but not the coefficients. *Distance* is
the largest distance to the exact surface (`closest_points`), in voxels, of the vertices and the middles of 20,000
faces; for the other two it includes that their model is trilinear and not the spline. *Not manifold* counts edges with
other than two faces, except on the border of the volume. The last two lines of a volume are about its
middle, 64^3 voxels at most: the mesh, and the mesh within a tolerance of a tenth of a voxel, with the distance measured
in both directions."""
SETTINGS = ("repetitions",)
GOALS = [
    ("vertices of a mesh off the exact surface", "at most 1e-09 voxel"),
    ("edges of a mesh that are not manifold", "0"),
]
SAMPLED_FACES = 20_000
TOLERANCE = 0.1  # voxels
MIDDLE = 64  # voxels along each axis


def measure(settings):
    peers.require_vtk()
    isospline.set_thread_count(0)
    polygons.use_threads(isospline.thread_count())
    for subject in settings.subjects():
        yield {"subject": subject.name, "threads": isospline.thread_count()} | compare(subject, settings)


def compare(subject, settings):
    volume = isospline.Volume(subject.data)  # in index space, like the others
    surface = isospline.Isosurface(volume, subject.level)
    edges = polygons.flying_edges(polygons.image_data(subject), subject.level, normals=True)

    def extract():
        edges.Modified()
        edges.Update()

    ways = {"isospline": lambda: surface.with_level(subject.level).to_mesh(), "flying edges": extract}
    if (marching_cubes := scikit_image()) is not None:
        data = np.ascontiguousarray(subject.data, dtype=np.float32)
        ways["scikit-image"] = lambda: marching_cubes(data, subject.level)
    seconds, results = take_turns(ways, settings.repetitions)
    found = {"isospline": (results["isospline"].vertices, results["isospline"].faces)}
    found["flying edges"] = polygons.triangles_of(edges.GetOutput())
    if "scikit-image" in results:
        vertices, faces, *_ = results["scikit-image"]
        found["scikit-image"] = (vertices[:, ::-1].astype(float), faces)
    return {
        "seconds": {name: spread(np.array(times)) for name, times in seconds.items()},
        "triangles": {name: len(faces) for name, (_, faces) in found.items()},
        "distance": {name: distance_of(surface, *mesh) for name, mesh in found.items()},
        "not_manifold": {name: not_manifold(volume, *mesh) for name, mesh in found.items()},
        "middle": simplification(subject),
    }


def simplification(subject):
    """The mesh of the middle of a volume, and the mesh of few triangles within the tolerance."""
    middle = tuple(slice(max(0, (n - MIDDLE) // 2), (n + MIDDLE) // 2) for n in subject.data.shape)
    surface = isospline.Isosurface(isospline.Volume(subject.data[middle]), subject.level)
    start = time.perf_counter()
    mesh = surface.to_mesh()
    done = time.perf_counter()
    simplified, distance = surface.to_mesh(TOLERANCE, return_distance=True)
    return {
        "triangles": len(mesh.faces),
        "seconds": done - start,
        "simplified_triangles": len(simplified.faces),
        "simplified_seconds": time.perf_counter() - done,
        "distance": distance,
    }


def scikit_image():
    try:
        from skimage.measure import marching_cubes
    except ImportError:
        return None
    return marching_cubes


def distance_of(surface, vertices, faces):
    """The largest distance from the surface of some vertices and of the middles of some faces."""
    some = faces[np.random.default_rng(1).permutation(len(faces))[:SAMPLED_FACES]]
    corners = vertices[some]
    return {
        name: float(surface.closest_points(points, tolerance=1e-6)["distances"].max())
        for name, points in (("vertices", corners[:, 0]), ("faces", corners.mean(axis=1)))
    }


def not_manifold(volume, vertices, faces):
    """Edges with other than two faces. At the border of the volume, and of its samples, one is enough."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64), axis=1)
    keys, counts = np.unique(edges[:, 0] << 32 | edges[:, 1], return_counts=True)
    wrong = keys[counts != 2]
    ends = vertices[np.stack([wrong >> 32, wrong & 0xFFFFFFFF], axis=1)]
    shape = np.array(volume.shape[::-1])
    at_border = (ends <= 1e-6) | (ends >= shape - 1 - 1e-6)
    return int((~at_border.all(axis=1).any(axis=1)).sum())


def goals(results):
    off = {result["subject"]: result["distance"]["isospline"]["vertices"] for result in results}
    wrong = {result["subject"]: result["not_manifold"]["isospline"] for result in results}
    edges = sum(3 * result["triangles"]["isospline"] // 2 for result in results)
    return [at_most(GOALS[0][0], 1e-9, off, "voxel"), none_of(GOALS[1][0], wrong, edges)]


def table(results):
    header = ("volume", "by", "ms", "triangles", "vertices off", "faces off", "not manifold")
    rows = []
    for result in results:
        for name, seconds in result["seconds"].items():
            distance = result["distance"][name]
            rows.append(
                (
                    result["subject"],
                    name,
                    with_spread(seconds, 1e3),
                    result["triangles"][name],
                    distance["vertices"],
                    distance["faces"],
                    result["not_manifold"][name],
                )
            )
        middle = result["middle"]
        rows.append(
            (result["subject"], "isospline, the middle", middle["seconds"] * 1e3, middle["triangles"], None, None, None)
        )
        rows.append(
            (
                result["subject"],
                f"isospline, the middle, tolerance {TOLERANCE}",
                middle["simplified_seconds"] * 1e3,
                middle["simplified_triangles"],
                None,
                middle["distance"],
                None,
            )
        )
    return markdown_table(header, rows)
