"""Growth: the cost of a ray as one and the same object is sampled ever more finely."""

import numpy as np

import isospline
from suite import peers, subjects
from suite.clock import rates, take_turns
from suite.goal import at_most
from suite.tables import markdown_table
from suite.views import in_tiles, whole_camera

from .primary import METHODS, build

TITLE = "Growth"
ABOUT = """The same primary rays at the heart of `isospline.volumes`, sampled on grids of ever more voxels, whole
view: the object stays the same, the cells become smaller and more."""
GOALS = [("growth of the cost of a ray, smallest to largest volume", "at most 2 times")]
COMPARED = ("hop_bracket", "stride_exact", "embree_exact", "packets_exact", "triangle_packets")


def measure(settings):
    peers.require_vtk()
    isospline.set_thread_count(settings.threads)
    for size in settings.growth_sizes:
        (subject,) = subjects.procedural(("heart",), (size,))
        volume = isospline.Volume(subject.data, **subject.grid)
        targets = {name: build(name, subject, volume) for name in COMPARED}
        rays = in_tiles(whole_camera(volume.bounds, settings.size).rays(settings.size))
        calls = {name: lambda t=target: t.cast(rays) for name, target in targets.items()}
        seconds, hits = take_turns(calls, min(3, settings.repetitions))
        yield {
            "subject": subject.name, "size": size, "rays": len(rays),
            "cells": targets["hop_bracket"].tracer.surface.shell.count,
            "hit": float(np.isfinite(hits["packets_exact"]["t_hit"]).mean()),
            "ns": {name: 1e3 / rates(len(rays), times)["median"] for name, times in seconds.items()},
        }  # fmt: skip


def growth(results, name):
    ordered = sorted(results, key=lambda result: result["size"])
    return ordered[-1]["ns"][name] / ordered[0]["ns"][name]


def goals(results):
    sizes = sorted(result["size"] for result in results)
    span = f"{sizes[0]}^3 to {sizes[-1]}^3; hopping {growth(results, 'hop_bracket'):.3g} times"
    return [at_most(GOALS[0][0], 2, {span: growth(results, "packets_exact")}, "times")]


def table(results):
    rows = [
        (f"{result['size']}^3", result["cells"], f"{result['hit']:.1%}", *(result["ns"][name] for name in COMPARED))
        for result in results
    ]
    rows.append(("growth", "-", "-", *(growth(results, name) for name in COMPARED)))
    return markdown_table(("grid", "cells", "hit", *(f"{METHODS[name]}, ns a ray" for name in COMPARED)), rows)
