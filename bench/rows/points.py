"""Nearest points of a surface, against Open3D's RaycastingScene with the mesh of the same level."""

import numpy as np
from suite import peers, polygons
from suite.clock import spread, take_turns
from suite.goal import none_of
from suite.tables import markdown_table, with_spread

import isospline

TITLE = "Nearest points"
ABOUT = """Random points of the surface, uniform by area (`sample_points`), moved along the normal, to either side, by
the given number of voxels. `Isosurface.closest_points` with all cores is compared with Open3D's
`RaycastingScene.compute_closest_points` with as many threads, on the mesh of VTK's FlyingEdges3D of the same level,
which is in its scene before the clock starts. isospline's points are on the spline and come with an error bound, by
which the surface may be nearer; Open3D's are on triangles in float32. *Unproven* points have an error bound above the
tolerance, a millionth of a voxel. *Apart* is the median difference of the two distances, in voxels: the error of the
mesh."""
SETTINGS = ("points", "repetitions")
GOALS = [("nearest points that are not proven to a millionth of a voxel", "0")]
DISTANCES = (0.1, 0.3, 1.0, 3.0)  # voxels
TOLERANCE = 1e-6  # voxels


def measure(settings):
    peers.require_vtk()
    has_open3d = peers.has_open3d()
    isospline.set_thread_count(0)
    for subject in settings.subjects():
        volume = isospline.Volume(subject.data)  # in index space, as Open3D
        surface = isospline.Isosurface(volume, subject.level)
        samples = surface.sample_points(settings.points, seed=1)
        side = np.where(np.arange(settings.points) % 2, 1.0, -1.0)[:, None]
        nearest_of_mesh = open3d_scene(subject) if has_open3d else None
        for distance in DISTANCES:
            points = samples["points"] + distance * side * samples["primitive_normals"]
            yield {"subject": subject.name, "distance": distance, "threads": isospline.thread_count()} | compare(
                surface, nearest_of_mesh, points, settings.repetitions
            )


def compare(surface, nearest_of_mesh, points, repetitions):
    ways = {"isospline": lambda: surface.closest_points(points)}
    if nearest_of_mesh is not None:
        single = points.astype(np.float32)
        ways["Open3D"] = lambda: nearest_of_mesh(single)
    seconds, results = take_turns(ways, repetitions)
    ours = results["isospline"]
    found = {
        "points": len(points),
        "seconds": {name: spread(times) for name, times in seconds.items()},
        "unproven": int((ours.error_bounds > TOLERANCE * (1 + 1e-6)).sum()),
    }
    if nearest_of_mesh is not None:
        theirs = np.linalg.norm(points - results["Open3D"], axis=1)
        found["apart"] = float(np.median(abs(ours.distances - theirs)))
    return found


def open3d_scene(subject):
    """Return a function that maps (N, 3) float32 points to the nearest points of the subject's triangles."""
    import open3d

    edges = polygons.flying_edges(polygons.image_data(subject), subject.level)
    edges.Update()
    vertices, faces = polygons.triangles_of(edges.GetOutput())
    scene = open3d.t.geometry.RaycastingScene(nthreads=isospline.thread_count())
    scene.add_triangles(open3d.core.Tensor(vertices.astype(np.float32)), open3d.core.Tensor(faces.astype(np.uint32)))
    return lambda points: scene.compute_closest_points(open3d.core.Tensor(points))["points"].numpy()


def goals(results):
    unproven = {f"{result['subject']}, {result['distance']:g} voxel": result["unproven"] for result in results}
    return [none_of(GOALS[0][0], unproven, sum(result["points"] for result in results))]


def table(results):
    header = ("volume", "voxels away", "points", "isospline, µs a point", "Open3D, µs a point", "unproven", "apart")
    rows = []
    for result in results:
        scale = 1e6 / result["points"]
        theirs = result["seconds"].get("Open3D")
        rows.append(
            (
                result["subject"],
                result["distance"],
                result["points"],
                with_spread(result["seconds"]["isospline"], scale),
                with_spread(theirs, scale) if theirs else "-",
                result["unproven"],
                result.get("apart", "-"),
            )
        )
    return markdown_table(header, rows)
