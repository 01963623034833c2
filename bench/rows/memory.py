"""Memory besides the coefficients: as the API reports it, and as the process holds it."""

import ctypes

import numpy as np
from suite.goal import at_least, at_most
from suite.tables import markdown_table
from suite.views import whole_camera

import isospline

from .prefilter import memory_of_process

TITLE = "Memory"
ABOUT = """Bytes of a surface and its scene, without the coefficients, after a picture of the whole view, divided by
the number of cells of the shell. *Reported* is `scene.memory`. *Held* is the growth of the process's resident memory
for each of several equal surfaces and scenes that are alive together, not counting the first, after the allocator has
given back its free pages. Scratch memory and what is computed once a volume therefore do not count. One goal is for the
memory that is held, whatever is reported; another is that the API reports it. The shell is made only on request, and is
not included."""
SETTINGS = ("size",)
GOALS = [
    ("memory held besides the coefficients after a whole picture", "at most 42 bytes a cell"),
    ("memory reported by the API, of what is held", "at least 0.9 times"),
]
ENOUGH = 96 << 20  # bytes to hold, so many that the allocator's pages and arenas do not matter


def measure(settings):
    isospline.set_thread_count(0)
    for subject in settings.subjects():
        volume = isospline.Volume(subject.data, **subject.grid)
        surface = isospline.Isosurface(volume, subject.level)
        cells = surface.shell.count
        del surface
        camera = whole_camera(volume.bounds, settings.size)
        reported = with_picture(volume, subject.level, camera, settings.size).memory
        copies = int(np.clip(ENOUGH / reported, 4, 400))
        alive = [with_picture(volume, subject.level, camera, settings.size)]
        before = resident()
        alive += [with_picture(volume, subject.level, camera, settings.size) for _ in range(copies)]
        held = (resident() - before) / copies
        yield {
            "subject": subject.name,
            "cells": cells,
            "coefficients": volume.memory,
            "copies": copies,
            "reported": reported,
            "held": held,
        }


def with_picture(volume, level, camera, size):
    """A scene of a new surface, of which a picture has been taken."""
    scene = isospline.Scene([isospline.Isosurface(volume, level)])
    isospline.render(scene, camera, size=size, light="phong")
    return scene


def resident():
    """Resident bytes of the process, without free pages of the C library's allocator."""
    ctypes.CDLL(None).malloc_trim(0)
    return memory_of_process("VmRSS")


def goals(results):
    """Memory that is held is at least what is reported: a process never holds less than it was given."""
    per_cell = {result["subject"]: max(result["held"], result["reported"]) / result["cells"] for result in results}
    share = {result["subject"]: result["reported"] / result["held"] for result in results}
    return [at_most(GOALS[0][0], 42, per_cell, "bytes a cell"), at_least(GOALS[1][0], 0.9, share)]


def table(results):
    rows = [
        (
            result["subject"],
            result["cells"],
            result["coefficients"] / 1e6,
            result["reported"] / 1e6,
            result["reported"] / result["cells"],
            result["held"] / result["cells"],
            f"{result['reported'] / result['held']:.0%}",
        )
        for result in results
    ]
    header = ("volume", "cells", "coefficients, MB", "reported, MB", "reported a cell", "held a cell", "reported")
    return markdown_table(header, rows)
