"""A new level and its picture, against three methods of VTK, with the stages of isospline."""

import itertools
import os
import statistics

from suite import judge, peers, polygons, vtk_frames
from suite.clock import spread, take_turns, timed
from suite.goal import at_least
from suite.levels import shared_ray, two_levels
from suite.tables import markdown_table, with_spread
from suite.views import whole_camera

import isospline

TITLE = "A new level and its picture"
ABOUT = """From a level to a shaded picture of the whole object, with all cores, alternating between two levels. What
does not depend on the level (coefficients, ranges of bricks, VTK's window, pipeline and texture) exists before the
clock starts. isospline: the level with the hit of one ray, then `render` with Phong. VTK, mesh: FlyingEdges3D with
normals, then an offscreen window, drawn once and read back. VTK, volume: the isosurface mode of
vtkGPUVolumeRayCastMapper, and for comparison vtkFixedPointVolumeRayCastMapper with an opacity that steps at the level,
both with two samples a voxel and one ray a pixel. OpenGL runs in software here (Mesa's llvmpipe). All methods take
turns and are repeated equally often. All pictures must cover about the same part of the image, except those of the
fixed-point mapper: it shows the solid, and so covers more where the volume's border cuts it. Up to commit fde92542cb,
VTK's pipeline was rebuilt and its window drawn twice for each picture."""
SETTINGS = ("size", "repetitions")
GOALS = [
    ("a new level and its picture against VTK's FlyingEdges3D + software rendering", "at least 3 times"),
    ("the same against VTK's volume mapper, isosurface mode", "at least 100 times"),
]


def measure(settings):
    peers.require_vtk_rendering()
    isospline.set_thread_count(0)
    polygons.use_threads(os.cpu_count())
    for subject in settings.subjects():
        prefilter, volume = timed(lambda s=subject: isospline.Volume(s.data, **s.grid))
        surface = isospline.Isosurface(volume, subject.level)
        scene = isospline.Scene([surface])
        camera = whole_camera(scene, settings.size)
        levels = two_levels(subject)
        ray = shared_ray(surface, scene, levels, camera)
        ways = {"isospline": own_frame(surface, scene, camera, settings.size, ray)}
        ways |= {
            f"VTK, {name}": way for name, way in vtk_frames.make(subject, volume.affine, camera, settings.size).items()
        }
        yield {
            "subject": subject.name,
            "pixels": list(settings.size),
            "threads": isospline.thread_count(),
            "prefilter_seconds": prefilter,
            "ways": compare(ways, levels, subject.data, settings.repetitions),
        }


def own_frame(surface, scene, camera, size, ray):
    def change(level):
        surface.level = level
        scene.cast_rays(ray)

    def frame(level):
        seconds, _ = timed(lambda: change(level))
        render, image = timed(lambda: isospline.render(scene, camera, size=size, light=isospline.Phong()))
        return {"level": seconds, "render": render}, image

    return frame


def compare(ways, levels, data, repetitions):
    """For each method: the seconds of a frame, the medians of its stages, and the part of the image that it covers."""
    stages = {name: [] for name in ways}
    next_level = {name: itertools.cycle(levels) for name in ways}

    def frame(name):
        seconds, picture = ways[name](next(next_level[name]))
        stages[name].append(seconds)
        return picture

    seconds, pictures = take_turns({name: lambda n=name: frame(n) for name in ways}, repetitions)
    parts = {name: covered_part(picture) for name, picture in pictures.items()}
    judge.check_covered({name: part for name, part in parts.items() if name != "VTK, fixed point"}, "isospline", data)
    return {
        name: {
            "seconds": spread(seconds[name]),
            "stages": {key: statistics.median(each[key] for each in runs[1:]) for key in runs[0]},
            "covered": parts[name],
        }
        for name, runs in stages.items()
    }


def covered_part(picture):
    if isinstance(picture, isospline.Image):
        return float((picture.color[..., 3] > 0).mean())
    return vtk_frames.covered(picture)


def seconds(result, way):
    return result["ways"][way]["seconds"]["median"]


def ratios(results, way):
    return {result["subject"]: seconds(result, way) / seconds(result, "isospline") for result in results}


def goals(results):
    return [
        at_least(GOALS[0][0], 3, ratios(results, "VTK, mesh")),
        at_least(GOALS[1][0], 100, ratios(results, "VTK, isosurface")),
    ]


def table(results):
    rows = []
    for result in results:
        for name, way in result["ways"].items():
            parts = ", ".join(f"{stage} {1e3 * value:.0f}" for stage, value in way["stages"].items())
            rows.append(
                (
                    result["subject"],
                    name,
                    with_spread(way["seconds"], 1e3),
                    parts,
                    seconds(result, name) / seconds(result, "isospline"),
                )
            )
    return markdown_table(("volume", "way", "ms", "of which, ms", "times as long"), rows)
