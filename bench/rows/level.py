"""Another level, up to its first ray, against the extraction of the mesh by VTK's FlyingEdges3D."""

import numpy as np
from suite import native, peers, polygons, subjects
from suite.clock import spread, take_turns
from suite.goal import at_least
from suite.levels import shared_ray, two_levels
from suite.tables import markdown_table, with_spread
from suite.views import whole_camera

import isospline

TITLE = "Change of the level, to the first ray"
ABOUT = """`surface.level = ...` and the hit of one ray near the middle of the whole view, with all cores. The ray is
part of the time because a scene builds itself when it is first used. VTK's FlyingEdges3D (no normals, no scalars)
extracts the mesh of the same level with as many threads. Both alternate between two levels. The ray's hit after a
change is compared with that of a new surface. *In C++* is the same from C++ (bench/cpp/level.bench.cpp). *Select* is
the time to select the bricks of a level, and *make* the time to make all of them with their blocks, as if rays entered
everywhere; both are on one thread. *Ranges* of bricks are computed once a volume, and are not part of the times
(bench/cpp/brick.bench.cpp)."""
SETTINGS = ("level_sizes", "repetitions")
GOALS = [("change of the level, to the first ray, against VTK's FlyingEdges3D", "at least 5 times")]
WAYS = {"isospline": "isospline", "flying edges": "FlyingEdges3D"}
NATIVE = {
    "level/spline_first_ray": "in C++",
    "bricks/select": "select",
    "bricks/make": "make",
    "bricks/ranges": "ranges",
}


def measure(settings):
    peers.require_vtk()
    isospline.set_thread_count(0)
    polygons.use_threads(isospline.thread_count())
    procedural = subjects.procedural(("gyroid", "heart"), settings.level_sizes)
    real = settings.subjects() if settings.volumes != "none" else ()
    for chosen in (procedural, real):
        for subject in chosen:
            result = compare(subject, settings)
            yield {"subject": subject.name, "threads": isospline.thread_count()} | result


def compare(subject, settings):
    volume = isospline.Volume(subject.data, **subject.grid)
    levels = two_levels(subject)
    surface = isospline.Isosurface(volume, subject.level)
    scene = isospline.Scene([surface])
    ray = shared_ray(surface, scene, levels, whole_camera(scene, settings.size))
    expected = [first_hit(isospline.Scene([isospline.Isosurface(volume, level)]), ray) for level in levels]

    def to_and_fro():
        hits = []
        for level in levels:
            surface.level = level
            hits.append(first_hit(scene, ray))
        assert hits == expected, "a change of the level gives another hit"

    edges = polygons.flying_edges(polygons.image_data(subject), subject.level)

    def extract():
        for level in levels:
            edges.SetValue(0, level)
            edges.Update()

    seconds, _ = take_turns({"isospline": to_and_fro, "flying edges": extract}, settings.repetitions)
    found = native.measure(subject, settings, NATIVE)
    return {
        "cells": surface.shell.count,
        "triangles": edges.GetOutput().GetNumberOfPolys(),
        "seconds": {name: spread(np.array(times) / len(levels)) for name, times in seconds.items()}
        | {name: spread(found[name]["seconds"]) for name in NATIVE},
    }


def first_hit(scene, ray):
    return float(scene.cast_rays(ray)["t_hit"][0])


def ratio(result):
    return result["seconds"]["flying edges"]["median"] / result["seconds"]["isospline"]["median"]


def goals(results):
    return [at_least(GOALS[0][0], 5, {result["subject"]: ratio(result) for result in results})]


def table(results):
    names = WAYS | NATIVE
    rows = [
        (
            result["subject"],
            result["cells"],
            result["triangles"],
            *(with_spread(result["seconds"][name], 1e3) for name in names),
            ratio(result),
        )
        for result in results
    ]
    return markdown_table(("volume", "cells", "triangles", *(f"{what}, ms" for what in names.values()), "ratio"), rows)
