"""A volume of a billion voxels: a new level and its picture. It runs only when it is named, because it needs 12 GB."""

import numpy as np
from suite.clock import spread, take_turns, timed
from suite.goal import at_most
from suite.levels import shared_ray, two_levels
from suite.subjects import Subject
from suite.tables import markdown_table, with_spread
from suite.views import whole_camera

import isospline

from .prefilter import memory_of_process

TITLE = "1024^3"
ABOUT = """Engine repeated 4 x 4 x 8 times, 1024^3 samples of one byte; the whole view with Phong at 1024 x 1024, from
Python with all cores. Measured are a new level up to the hit of one ray, and its picture. This row runs only when it is
named. *Peak* is the largest memory of the process at any time, including samples, coefficients and two pictures."""
SETTINGS = ("large_size", "size", "repetitions")
GOALS = [("1024^3: a new level and its picture", "at most 1 s")]


def measure(settings):
    isospline.set_thread_count(0)
    for subject in settings.subjects():
        if subject.name == "engine" or settings.volumes == "none":
            yield {"subject": subject.name, "threads": isospline.thread_count()} | compare(
                tiled(subject, settings), settings
            )
            return


def tiled(subject, settings):
    """The subject, repeated along each axis up to this number of samples."""
    side = settings.large_size
    data = np.tile(subject.data, [-(-side // count) for count in subject.data.shape])[:side, :side, :side]
    return Subject(subject.name, np.ascontiguousarray(data), {}, subject.level)


def compare(subject, settings):
    prefilter, volume = timed(lambda: isospline.Volume(subject.data))
    levels = two_levels(subject)
    first, surface = timed(lambda: isospline.Isosurface(volume, subject.level))
    scene = isospline.Scene([surface])
    camera = whole_camera(volume.bounds, settings.size)
    ray = shared_ray(surface, scene, levels, camera)
    stages = {"level": [], "picture": []}

    def to_and_fro():
        for level in levels:
            stages["level"].append(timed(lambda level=level: change(surface, scene, level, ray))[0])
            stages["picture"].append(
                timed(lambda: isospline.render(scene, camera, size=settings.size, light="phong"))[0]
            )

    seconds, _ = take_turns({"both": to_and_fro}, min(3, settings.repetitions))
    return {
        "samples": list(subject.data.shape),
        "prefilter_seconds": prefilter,
        "surface_seconds": first,
        "seconds": {"both": spread(np.array(seconds["both"]) / 2)}
        | {stage: spread(times[len(levels) :]) for stage, times in stages.items()},
        "coefficients": volume.memory,
        "peak": memory_of_process("VmHWM"),
    }


def change(surface, scene, level, ray):
    surface.level = level
    return scene.cast_rays(ray)


def goals(results):
    return [
        at_most(
            GOALS[0][0],
            1,
            {
                f"{result['subject']}, {result['samples'][0]}^3": result["seconds"]["both"]["median"]
                for result in results
            },
            "s",
        )
    ]


def table(results):
    rows = [
        (
            result["subject"],
            result["prefilter_seconds"],
            result["surface_seconds"],
            *(with_spread(result["seconds"][stage]) for stage in ("level", "picture", "both")),
            result["coefficients"] / 1e9,
            result["peak"] / 1e9,
        )
        for result in results
    ]
    header = (
        "volume",
        "prefilter, s",
        "first surface, s",
        "new level, s",
        "picture, s",
        "both, s",
        "coefficients, GB",
        "peak, GB",
    )
    return markdown_table(header, rows)
