"""Growth: the cost of a ray when the same object is sampled more and more finely."""

from suite import native, peers, subjects
from suite.clock import spread
from suite.goal import at_most
from suite.tables import markdown_table, with_spread
from suite.views import whole_camera

import isospline

TITLE = "Growth"
ABOUT = """The same primary rays of the whole view at the heart of `isospline.volumes`, sampled on finer and finer
grids, from C++ on one thread and with a settled index: the object stays the same, and its cells become smaller and more
numerous. Earlier results were measured from Python. They included the call, 15 to 20 ns a ray at all sizes, and so
showed less growth."""
SETTINGS = ("size", "growth_sizes", "repetitions")
GOALS = [("growth of the cost of a packet's ray, smallest to largest volume, C++", "at most 2 times")]

#: Names in bench/cpp, and their descriptions.
WAYS = {
    "packets/spline_whole": "packets",
    "single_rays/spline_whole": "single rays",
    "packets/triangles_whole": "packets, Embree's triangles",
    "hopping/spline_whole": "voxel hopping, bracket + Brent (the paper)",
}


def measure(settings):
    peers.require_vtk()
    for size in settings.growth_sizes:
        (subject,) = subjects.procedural(("heart",), (size,))
        volume = isospline.Volume(subject.data, **subject.grid)
        cells = isospline.Isosurface(volume, subject.level).shell.count
        found = native.measure(subject, settings, WAYS, whole_camera(volume.bounds, settings.size))
        count = int(found["packets/spline_whole"]["rays"])
        yield {
            "subject": subject.name,
            "size": size,
            "rays": count,
            "cells": cells,
            "hit": found["packets/spline_whole"]["hit"],
            "ns": {name: spread([1e9 * time / count for time in found[name]["seconds"]]) for name in WAYS},
        }


def growth(results, name):
    ordered = sorted(results, key=lambda result: result["size"])
    return ordered[-1]["ns"][name]["median"] / ordered[0]["ns"][name]["median"]


def goals(results):
    sizes = sorted(result["size"] for result in results)
    others = ", ".join(f"{WAYS[name]} {growth(results, name):.3g}" for name in list(WAYS)[2:])
    span = f"{sizes[0]}^3 to {sizes[-1]}^3; {others} times"
    return [at_most(GOALS[0][0], 2, {span: growth(results, "packets/spline_whole")}, "times")]


def table(results):
    rows = [
        (
            f"{result['size']}^3",
            result["cells"],
            f"{result['hit']:.1%}",
            *(with_spread(result["ns"][name]) for name in WAYS),
        )
        for result in results
    ]
    rows.append(("growth", "-", "-", *(growth(results, name) for name in WAYS)))
    return markdown_table(("grid", "cells", "hit", *(f"{what}, ns a ray" for what in WAYS.values())), rows)
