"""Another level: shell and BVH against the extraction of the mesh by VTK's FlyingEdges3D."""

import numpy as np

import isospline
from suite import peers, polygons, subjects
from suite.clock import take_turns
from suite.goal import at_least
from suite.tables import markdown_table

TITLE = "Change of the level"
ABOUT = """`surface.level = ...` and the scene's BVH, with all cores, against VTK's FlyingEdges3D (no normals, no
scalars) for the same level with as many threads; both go to and fro between two levels. The headline is depth 2 of
pruning. Before a time counts, the shell after a change is compared with that of a new surface."""
GOALS = [("change of the level against VTK's FlyingEdges3D", "at least 1 times")]
DEPTHS = (0, 1, 2, 3, 4)


def measure(settings):
    peers.require_vtk()
    isospline.set_thread_count(0)
    polygons.use_threads(isospline.thread_count())
    procedural = subjects.procedural(("gyroid", "heart"), settings.level_sizes)
    real = settings.subjects() if settings.volumes != "none" else ()
    for chosen in (procedural, real):
        for subject in chosen:
            result = compare(subject, settings.repetitions)
            yield {"subject": subject.name, "threads": isospline.thread_count()} | result


def compare(subject, repetitions):
    volume = isospline.Volume(subject.data, **subject.grid)
    levels = [subject.level + 0.01 * (volume.maximum - volume.minimum), subject.level]
    surfaces = {depth: isospline.Isosurface(volume, subject.level, prune_depth=depth) for depth in DEPTHS}
    scenes = {depth: isospline.Scene([surface]) for depth, surface in surfaces.items()}
    for depth, surface in surfaces.items():
        changed = surface.with_level(levels[0]).with_level(subject.level).shell.cells
        assert np.array_equal(changed, surface.shell.cells), f"a change of the level gives another shell, depth {depth}"

    def to_and_fro(depth):
        for level in levels:
            surfaces[depth].level = level
            scenes[depth].memory  # noqa: B018 - a scene builds itself when asked

    edges = polygons.flying_edges(polygons.image_data(subject), subject.level)

    def extract():
        for level in levels:
            edges.SetValue(0, level)
            edges.Update()

    calls = {f"depth {depth}": lambda d=depth: to_and_fro(d) for depth in DEPTHS} | {"flying edges": extract}
    seconds, _ = take_turns(calls, repetitions)
    return {
        "cells": [surfaces[depth].shell.count for depth in DEPTHS],
        "triangles": edges.GetOutput().GetNumberOfPolys(),
        "seconds": {name: float(np.median(times)) / len(levels) for name, times in seconds.items()},
    }


def goals(results):
    return [at_least(GOALS[0][0], 1, {
        result["subject"]: result["seconds"]["flying edges"] / result["seconds"]["depth 2"] for result in results
    })]  # fmt: skip


def table(results):
    rows = [
        (result["subject"], result["cells"][2], result["triangles"],
         *(1e3 * seconds for seconds in result["seconds"].values()),
         result["seconds"]["flying edges"] / result["seconds"]["depth 2"])
        for result in results
    ]  # fmt: skip
    header = ("volume", "cells", "triangles", *(f"depth {depth}, ms" for depth in DEPTHS), "FlyingEdges3D, ms", "ratio")
    return markdown_table(header, rows)
