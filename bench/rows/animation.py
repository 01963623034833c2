"""A new level in every frame."""

import numpy as np
from suite.clock import spread, take_turns
from suite.goal import at_least
from suite.levels import two_levels
from suite.tables import markdown_table, with_spread
from suite.views import whole_camera

import isospline

TITLE = "A new level in every frame"
ABOUT = """Twelve levels within a hundredth of the data's range, none of them used before: `surface.level = ...` and
`isospline.render` of the whole view with Phong at 512 x 512, from Python, with all cores. The rate is twelve frames
over their total time."""
SETTINGS = ("size", "repetitions")
GOALS = [
    ("frames with a new level each, volumes up to 256^3", "at least 20 a second"),
    ("frames with a new level each, larger volumes", "at least 10 a second"),
]
FRAMES = 12
SIZE = 512


def measure(settings):
    isospline.set_thread_count(0)
    size = tuple(min(SIZE, side) for side in settings.size)
    for subject in settings.subjects():
        volume = isospline.Volume(subject.data, **subject.grid)
        surface = isospline.Isosurface(volume, subject.level)
        scene = isospline.Scene([surface])
        camera = whole_camera(scene, size)
        upper, lower = two_levels(subject)
        # Each run begins within a step of its own, so that no level comes back.
        runs = iter(np.linspace(0, 1, 4 * settings.repetitions + 4, endpoint=False))

        def frames(surface=surface, scene=scene, camera=camera, lower=lower, upper=upper, runs=runs):
            offset = next(runs)
            for frame in range(FRAMES):
                surface.level = lower + (upper - lower) * (frame + offset) / FRAMES
                isospline.render(scene, camera, size=size, light=isospline.Phong())

        seconds, _ = take_turns({"frames": frames}, settings.repetitions)
        yield {
            "subject": subject.name,
            "voxels": subject.data.size,
            "pixels": list(size),
            "threads": isospline.thread_count(),
            "frames_per_second": spread([FRAMES / time for time in seconds["frames"]]),
        }


def goals(results):
    def rates(large):
        return {
            result["subject"]: result["frames_per_second"]["median"]
            for result in results
            if (result["voxels"] > 256**3) == large
        }

    return [at_least(GOALS[0][0], 20, rates(False), "a second"), at_least(GOALS[1][0], 10, rates(True), "a second")]


def table(results):
    rows = [
        (
            result["subject"],
            result["voxels"] / 1e6,
            " x ".join(map(str, result["pixels"])),
            with_spread(result["frames_per_second"]),
        )
        for result in results
    ]
    return markdown_table(("volume", "million voxels", "pixels", "frames a second"), rows)
