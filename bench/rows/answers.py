"""Answers about a surface as a whole: meshes within a tolerance, areas and volumes, beside VTK and scikit-image."""

import time
from pathlib import Path

import numpy as np
from suite import peers, polygons, subjects
from suite.goal import at_most
from suite.tables import markdown_table

import isospline

from .mesh import scikit_image
from .prefilter import memory_of_process

TITLE = "Answers"
ABOUT = """Seconds of the processor, on all cores, and the memory that a call needs at most, without that of the volume.
Each is asked once. A mesh within a voxel is `to_mesh(tolerance)`; beside it are VTK's flying edges with a quadric
decimation to the same number of triangles, whose distance from the surface nobody states. Areas and volumes are those
of the spline, with an error that is stated; those of the others are of their triangles (`vtkMassProperties`,
`skimage.measure.mesh_surface_area`). Ten levels are volume and area of each. *Off* is the difference from the closed
form, for a ball."""
SETTINGS = ("procedural_size",)
GOALS = [
    ("area of a ball off its closed form, of what is stated as its error", "at most 1 times"),
    ("distance of a mesh from the surface, of its tolerance", "at most 1 times"),
]
BALL_RADIUS = 0.35  # of the size of its volume
LEVELS = 10


def measure(settings):
    peers.require_vtk()
    isospline.set_thread_count(0)
    polygons.use_threads(isospline.thread_count())
    yield answers(ball(settings.procedural_size), radius=BALL_RADIUS * settings.procedural_size)
    for subject in settings.subjects():
        yield answers(subject)


def ball(size):
    """The distance from a sphere, inside positive, in voxels."""
    axis = np.arange(size) - 0.5 * (size - 1)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    data = BALL_RADIUS * size - np.sqrt(x * x + y * y + z * z)
    return subjects.Subject(f"ball {size}", data.astype(np.float32), {}, 0.0)


def answers(subject, radius=None):
    volume = isospline.Volume(subject.data)  # in index space, like the others
    surface = isospline.Isosurface(volume, subject.level)
    found = {}

    def ask(question, by, call):
        result, cost = cost_of(call)
        found.setdefault(question, {})[by] = cost
        return result

    ask("mesh", "isospline", surface.to_mesh)
    mesh, distance = ask("mesh within a voxel", "isospline", lambda: surface.to_mesh(1.0, return_distance=True))
    found["mesh within a voxel"]["isospline"] |= {"triangles": len(mesh.faces), "distance": distance}
    area = ask("area", "isospline", surface.area)
    enclosed = ask("volume", "isospline", surface.enclosed_volume)
    levels = subject.level + 0.02 * float(np.ptp(subject.data)) * (np.arange(LEVELS) - LEVELS // 2) / LEVELS
    ask("ten levels", "isospline", lambda: isospline.measure(volume, levels))

    image = polygons.image_data(subject)
    triangles = ask("mesh", "VTK", lambda: triangles_of(image, subject.level))
    share = len(mesh.faces) / max(triangles.GetNumberOfPolys(), 1)
    ask("mesh within a voxel", "VTK", lambda: decimated(triangles_of(image, subject.level), share))
    of_vtk = ask("area", "VTK", lambda: properties_of(triangles_of(image, subject.level)))
    found["volume"]["VTK"] = dict(found["area"]["VTK"])
    ask("ten levels", "VTK", lambda: [properties_of(triangles_of(image, level)) for level in levels])
    if (marching_cubes := scikit_image()) is not None:
        ask("area", "scikit-image", lambda: area_by_scikit_image(marching_cubes, subject))
    if radius is not None:
        truth = {"area": 4 * np.pi * radius**2, "volume": 4 / 3 * np.pi * radius**3}
        for question, ours, theirs in (
            ("area", area, of_vtk.GetSurfaceArea()),
            ("volume", enclosed, of_vtk.GetVolume()),
        ):
            found[question]["isospline"]["off"] = abs(ours.value / truth[question] - 1)
            found[question]["isospline"]["stated"] = ours.error / truth[question]
            found[question]["VTK"]["off"] = abs(theirs / truth[question] - 1)
    return {"subject": subject.name, "threads": isospline.thread_count(), "answers": found}


def cost_of(call):
    """The result of a call, its seconds of the processor and the bytes that it needs at most."""
    Path("/proc/self/clear_refs").write_text("5", encoding="utf-8")  # the largest memory so far is the present one
    before = memory_of_process("VmRSS")
    start = time.process_time()
    result = call()
    seconds = time.process_time() - start
    return result, {"seconds": seconds, "bytes": max(memory_of_process("VmHWM") - before, 0)}


def triangles_of(image, level):
    edges = polygons.flying_edges(image, level)
    edges.Update()
    return edges.GetOutput()


def decimated(triangles, share):
    from vtkmodules.vtkFiltersCore import vtkQuadricDecimation

    decimation = vtkQuadricDecimation()
    decimation.SetInputData(triangles)
    decimation.SetTargetReduction(max(1 - share, 0))
    decimation.Update()
    return decimation.GetOutput()


def properties_of(triangles):
    from vtkmodules.vtkFiltersCore import vtkMassProperties

    properties = vtkMassProperties()
    properties.SetInputData(triangles)
    properties.Update()
    return properties


def area_by_scikit_image(marching_cubes, subject):
    from skimage.measure import mesh_surface_area

    vertices, faces, *_ = marching_cubes(np.ascontiguousarray(subject.data, dtype=np.float32), subject.level)
    return mesh_surface_area(vertices, faces)


def goals(results):
    off, beyond = {}, {}
    for result in results:
        ours = {question: by["isospline"] for question, by in result["answers"].items()}
        if "off" in ours["area"]:
            off[result["subject"]] = ours["area"]["off"] / ours["area"]["stated"]
        beyond[result["subject"]] = ours["mesh within a voxel"]["distance"]
    return [at_most(GOALS[0][0], 1, off, "times"), at_most(GOALS[1][0], 1, beyond, "times")]


def table(results):
    header = ("volume", "answer", "by", "CPU s", "MB", "triangles", "distance, voxels", "off", "stated")
    rows = []
    for result in results:
        for question, by in result["answers"].items():
            for name, cost in by.items():
                more = [cost.get(key) for key in ("triangles", "distance", "off", "stated")]
                rows.append((result["subject"], question, name, cost["seconds"], cost["bytes"] / 1e6, *more))
    return markdown_table(header, rows)
