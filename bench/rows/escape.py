"""Escape: every ray from inside a closed surface hits it, from its inner side."""

import numpy as np
from suite import subjects
from suite.goal import none_of
from suite.tables import markdown_table
from suite.views import unit

import isospline

from .agreement import CHUNK, corners

TITLE = "Rays from inside a closed surface"
ABOUT = """Volumes framed with samples below the level, so that the surface is closed. Rays start at random places
inside: a third in random directions, a third aimed at corners of cells of the shell and a third at places on their
edges. *Escaped* rays hit nothing. *Entered* rays have a first crossing that leads into the solid: they left it through
a crack."""
SETTINGS = ("escape_rays",)
GOALS = [("rays that escape a closed surface from inside", "0")]
PATHS = {"packets": True, "single": False}


def measure(settings):
    isospline.set_thread_count(0)
    for subject in (*subjects.procedural(("sphere", "torus"), (64,)), *settings.subjects()):
        subject = subjects.closed(subject)
        surface = isospline.Isosurface(isospline.Volume(subject.data), subject.level)
        yield {"subject": subject.name} | leave(surface, subject, settings.escape_rays, np.random.default_rng(0))


def leave(surface, subject, count, generator):
    scene = isospline.Scene([surface])
    inner = np.flatnonzero(subject.data.ravel() > subject.level)
    found = {path: {"escaped": 0, "entered": 0} for path in PATHS}
    examples = []
    for done in range(0, count, CHUNK):
        origins = places_inside(surface, subject, inner, min(CHUNK, count - done), generator)
        rays = np.concatenate([origins, directions(surface, origins, generator)], axis=1)
        for path, coherent in PATHS.items():
            hits = scene.cast_rays(rays, coherent=coherent)
            escaped = np.isinf(hits["t_hit"])
            outward = (hits["primitive_normals"] * unit(rays[:, 3:])).sum(axis=1)
            entered = ~escaped & (outward < -1e-6)
            found[path]["escaped"] += int(escaped.sum())
            found[path]["entered"] += int(entered.sum())
            wrong = np.flatnonzero(escaped | entered)[: max(0, 5 - len(examples))]
            examples += [{"path": path, "ray": rays[i].tolist()} for i in wrong]
    return {"rays": count, "cells": surface.shell.count, "paths": found, "examples": examples}


def places_inside(surface, subject, inner, count, generator):
    """Random points where the model is above the level, in index space, which is the world here."""
    places = np.empty((0, 3))
    margin = 1e-3 * np.ptp(subject.data).astype(float)
    while len(places) < count:
        chosen = generator.choice(inner, count)
        points = np.stack(np.unravel_index(chosen, subject.data.shape)[::-1], axis=1)
        points = points + generator.uniform(-0.5, 0.5, points.shape)
        places = np.concatenate([places, points[surface.volume.sample(points) > subject.level + margin]])
    return places[:count]


def directions(surface, origins, generator):
    """A third random, a third towards corners, a third towards places on edges."""
    targets = corners(surface, len(origins), generator)
    third = len(origins) // 3
    along = generator.integers(3, size=third)
    targets[np.arange(third), along] += generator.uniform(-0.5, 0.5, third)
    result = targets - origins
    result[2 * third :] = generator.normal(size=(len(origins) - 2 * third, 3))
    return result


def goals(results):
    lost = {
        f"{result['subject']}, {path}": found["escaped"] + found["entered"]
        for result in results
        for path, found in result["paths"].items()
    }
    return [none_of(GOALS[0][0], lost, sum(result["rays"] for result in results) * len(PATHS))]


def table(results):
    rows = [
        (
            result["subject"],
            result["cells"],
            result["rays"],
            *(result["paths"][path][kind] for path in PATHS for kind in ("escaped", "entered")),
        )
        for result in results
    ]
    header = ("volume", "cells", "rays", *(f"{kind}, {path}" for path in PATHS for kind in ("escaped", "entered")))
    return markdown_table(header, rows)
