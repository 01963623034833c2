"""Memory beside the coefficients: what the API reports, and what the process really holds."""

import ctypes

import numpy as np

import isospline
from suite.goal import at_least, at_most
from suite.tables import markdown_table
from suite.views import whole_camera

from .prefilter import memory_of_process

TITLE = "Memory"
ABOUT = """What a surface and its scene hold beside the coefficients after a picture of the whole view, over the
number of cells of the shell. *Reported* is `scene.memory`. *Held* is what the process's resident memory grows by for
each of several equal surfaces and scenes that are alive together, after the first of them, with the allocator's free
pages given back: scratch memory, and what is made once a volume, do not count. The goal is on what is held, whatever
is reported; that the API reports it is a goal of its own. The shell is made only where it is asked for, and not in
here."""
SETTINGS = ("size",)
GOALS = [("memory held beside the coefficients after a whole picture", "at most 42 bytes a cell"),
         ("memory reported by the API, of what is held", "at least 0.9 times")]  # fmt: skip
ENOUGH = 96 << 20  # bytes to hold, so that pages and arenas of the allocator are lost in it


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
            "subject": subject.name, "cells": cells, "coefficients": volume.memory, "copies": copies,
            "reported": reported, "held": held,
        }  # fmt: skip


def with_picture(volume, level, camera, size):
    """A scene of a new surface, of which a picture has been taken."""
    scene = isospline.Scene([isospline.Isosurface(volume, level)])
    isospline.render(scene, camera, size=size)
    return scene


def resident():
    """Resident bytes of the process, without free pages of the C library's allocator."""
    ctypes.CDLL(None).malloc_trim(0)
    return memory_of_process("VmRSS")


def goals(results):
    """What is held counts as what is reported at least: a process never holds less than it was given."""
    per_cell = {result["subject"]: max(result["held"], result["reported"]) / result["cells"] for result in results}
    share = {result["subject"]: result["reported"] / result["held"] for result in results}
    return [at_most(GOALS[0][0], 42, per_cell, "bytes a cell"), at_least(GOALS[1][0], 0.9, share)]


def table(results):
    rows = [
        (result["subject"], result["cells"], result["coefficients"] / 1e6, result["reported"] / 1e6,
         result["reported"] / result["cells"], result["held"] / result["cells"],
         f"{result['reported'] / result['held']:.0%}")
        for result in results
    ]  # fmt: skip
    header = ("volume", "cells", "coefficients, MB", "reported, MB", "reported a cell", "held a cell", "reported")
    return markdown_table(header, rows)
