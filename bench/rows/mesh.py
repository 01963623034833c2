"""Triangle meshes, against VTK's FlyingEdges3D and scikit-image's marching cubes."""

import time

import numpy as np

import isospline
from suite import peers, polygons
from suite.clock import spread, take_turns
from suite.goal import at_most
from suite.tables import markdown_table, with_spread

TITLE = "Meshes"
ABOUT = """`surface.to_mesh()` with all cores, against VTK's FlyingEdges3D with as many threads and gradients as
normals, and `skimage.measure.marching_cubes` (Lewiner), which has one. The time of isospline includes exact normals,
the merging of vertices and world space; that of a new `Isosurface` is in it, that of the coefficients is not.
*Distance* is the largest from the vertices of 20,000 faces, and from their middles, to the exact surface
(`closest_points`), in voxels; that of the others includes that their model is not the spline but trilinear. *Not
manifold* are edges with other than two faces, the border of the volume left out. With a tolerance of a tenth of a
voxel, *simplified* tells the triangles that are left, in what time, and the distance that is measured, both ways."""
SETTINGS = ("repetitions",)
GOALS = [("time of a mesh, against VTK's FlyingEdges3D", "at most 10 times")]
SAMPLED_FACES = 20_000
TOLERANCE = 0.1  # voxels


def measure(settings):
    peers.require_vtk()
    isospline.set_thread_count(0)
    polygons.use_threads(isospline.thread_count())
    for subject in settings.subjects():
        yield {"subject": subject.name, "threads": isospline.thread_count()} | compare(subject, settings)


def compare(subject, settings):
    volume = isospline.Volume(subject.data)  # in index space, as the others
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
    start = time.perf_counter()
    simplified, distance = surface.to_mesh(TOLERANCE, return_distance=True)
    return {
        "seconds": {name: spread(np.array(times)) for name, times in seconds.items()},
        "triangles": {name: len(faces) for name, (_, faces) in found.items()},
        "distance": {name: distance_of(surface, *mesh) for name, mesh in found.items()},
        "not_manifold": {name: not_manifold(volume, *mesh) for name, mesh in found.items()},
        "simplified": {
            "seconds": time.perf_counter() - start, "triangles": len(simplified.faces), "distance": distance,
        },
    }  # fmt: skip


def scikit_image():
    try:
        from skimage.measure import marching_cubes
    except ImportError:
        return None
    return marching_cubes


def distance_of(surface, vertices, faces):
    """Largest distances of some vertices, and of the middles of some faces, from the surface."""
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


def ratio(result):
    return result["seconds"]["isospline"]["median"] / result["seconds"]["flying edges"]["median"]


def goals(results):
    return [at_most(GOALS[0][0], 10, {result["subject"]: ratio(result) for result in results}, "times")]


def table(results):
    header = ("volume", "by", "ms", "triangles", "vertices off", "faces off", "not manifold")
    rows = []
    for result in results:
        for name, seconds in result["seconds"].items():
            distance = result["distance"][name]
            rows.append((result["subject"], name, with_spread(seconds, 1e3), result["triangles"][name],
                         distance["vertices"], distance["faces"], result["not_manifold"][name]))  # fmt: skip
        simplified = result["simplified"]
        rows.append((result["subject"], f"isospline, tolerance {TOLERANCE}", simplified["seconds"] * 1e3,
                     simplified["triangles"], 0.0, simplified["distance"], 0))  # fmt: skip
    return markdown_table(header, rows)
