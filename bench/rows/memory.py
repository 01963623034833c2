"""Memory beside the coefficients, as the API reports it and as the process grows."""

import isospline
from suite.goal import at_most
from suite.tables import markdown_table

from .prefilter import memory_of_process

TITLE = "Memory"
ABOUT = """`surface.shell.memory + scene.memory` over the number of cells of the shell: what there is beside the
coefficients, BVH included. *Grown* is what the process's resident memory grew by while shell and scene were made,
over the same number."""
GOALS = [("memory beside the coefficients", "at most 120 bytes a cell")]
DEPTHS = (0, 2)


def measure(settings):
    isospline.set_thread_count(0)
    for subject in settings.subjects():
        volume = isospline.Volume(subject.data, **subject.grid)
        for depth in DEPTHS:
            before = memory_of_process("VmRSS")
            surface = isospline.Isosurface(volume, subject.level, prune_depth=depth)
            scene = isospline.Scene([surface])
            bvh = scene.memory
            yield {
                "subject": subject.name, "prune_depth": depth, "cells": surface.shell.count,
                "shell": surface.shell.memory, "bvh": bvh, "coefficients": volume.memory,
                "grown": memory_of_process("VmRSS") - before,
            }  # fmt: skip


def goals(results):
    per_cell = {
        f"{result['subject']}, depth {result['prune_depth']}": (result["shell"] + result["bvh"]) / result["cells"]
        for result in results
    }
    return [at_most(GOALS[0][0], 120, per_cell, "bytes a cell")]


def table(results):
    rows = [
        (result["subject"], result["prune_depth"], result["cells"], result["coefficients"] / 1e6, result["shell"] / 1e6,
         result["bvh"] / 1e6, (result["shell"] + result["bvh"]) / result["cells"], result["grown"] / result["cells"])
        for result in results
    ]  # fmt: skip
    header = ("volume", "depth", "cells", "coefficients, MB", "shell, MB", "BVH, MB", "bytes a cell", "grown a cell")
    return markdown_table(header, rows)
