"""Memory beside the coefficients: what the API reports, and what the process really holds."""

import ctypes

import numpy as np

import isospline
from suite.goal import at_least, at_most
from suite.tables import markdown_table

from .prefilter import memory_of_process

TITLE = "Memory"
ABOUT = """Shell, BVH and whatever else a surface and its scene hold beside the coefficients, over the number of cells
of the shell. *Reported* is `surface.shell.memory + scene.memory`. *Held* is what the process's resident memory grows
by for each of several equal surfaces and scenes that are alive together, after the first of them, with the
allocator's free pages given back: scratch memory and what is used once do not count. The goal is on what is held,
whatever is reported; that the API reports it is a goal of its own."""
GOALS = [("memory held beside the coefficients", "at most 120 bytes a cell"),
         ("memory reported by the API, of what is held", "at least 0.9 times")]  # fmt: skip
DEPTHS = (0, 2)
ENOUGH = 96 << 20  # bytes to hold, so that pages and arenas of the allocator are lost in it


def measure(settings):
    isospline.set_thread_count(0)
    for subject in settings.subjects():
        volume = isospline.Volume(subject.data, **subject.grid)
        for depth in DEPTHS:
            surface = isospline.Isosurface(volume, subject.level, prune_depth=depth)
            scene = isospline.Scene([surface])
            result = {"cells": surface.shell.count, "shell": surface.shell.memory, "scene": scene.memory}
            copies = int(np.clip(ENOUGH / (result["shell"] + result["scene"]), 4, 400))
            yield {
                "subject": subject.name, "prune_depth": depth, "coefficients": volume.memory, "copies": copies,
                "held": held(volume, subject.level, depth, copies),
            } | result  # fmt: skip


def held(volume, level, depth, copies):
    """Bytes of one surface with its scene: the growth from the first of many to the last."""

    def another():
        scene = isospline.Scene([isospline.Isosurface(volume, level, prune_depth=depth)])
        scene.memory  # noqa: B018 - a scene builds itself when asked
        return scene

    alive = [another()]
    before = resident()
    alive += [another() for _ in range(copies)]
    return (resident() - before) / copies


def resident():
    """Resident bytes of the process, without free pages of the C library's allocator."""
    ctypes.CDLL(None).malloc_trim(0)
    return memory_of_process("VmRSS")


def reported(result):
    return result["shell"] + result["scene"]


def label(result):
    return f"{result['subject']}, depth {result['prune_depth']}"


def goals(results):
    """What is held counts as what is reported at least: a process never holds less than it was given."""
    per_cell = {label(result): max(result["held"], reported(result)) / result["cells"] for result in results}
    share = {label(result): reported(result) / result["held"] for result in results}
    return [at_most(GOALS[0][0], 120, per_cell, "bytes a cell"), at_least(GOALS[1][0], 0.9, share)]


def table(results):
    rows = [
        (result["subject"], result["prune_depth"], result["cells"], result["coefficients"] / 1e6, result["shell"] / 1e6,
         result["scene"] / 1e6, reported(result) / result["cells"], result["held"] / result["cells"],
         f"{reported(result) / result['held']:.0%}")
        for result in results
    ]  # fmt: skip
    header = ("volume", "depth", "cells", "coefficients, MB", "shell, MB", "scene, MB", "reported a cell",
              "held a cell", "reported")  # fmt: skip
    return markdown_table(header, rows)
