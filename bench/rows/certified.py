"""Rays with proven answers, beside the same rays without."""

import numpy as np
from suite.clock import spread, take_turns
from suite.goal import at_most, none_of
from suite.tables import markdown_table, with_spread
from suite.views import CAMERAS, in_tiles

import isospline

TITLE = "Certified rays"
ABOUT = """`cast_rays(certify=True)` beside `cast_rays` of the same rays, with one thread and a settled index: coherent
rays in packets, and the same rays in random order. *Times* is the ratio of their times, the medians of three times as
many runs as stated. *Undecided* rays are those of which nothing is proven, *different* ones those that hit with a proof
and miss without one, or the other way round, or whose `t_hit` is not between the proven bounds. *Width* is the largest
distance between these bounds, in voxels."""
SETTINGS = ("size", "repetitions")
GOALS = [
    ("time of certified rays, against the same rays without", "at most 3 times"),
    ("share of ordinary rays that are undecided", "at most 1e-06 of them"),
    ("certified rays that differ from others", "0"),
]


def measure(settings):
    isospline.set_thread_count(1)
    repetitions = 3 * settings.repetitions  # their ratio counts, which is less precise than the times
    for subject in settings.subjects():
        volume = isospline.Volume(subject.data)  # in index space
        scene = isospline.Scene([isospline.Isosurface(volume, subject.level)])
        scene.settle()
        for view, camera in CAMERAS.items():
            rays = in_tiles(camera(scene, settings.size).rays(settings.size))
            shuffled = np.random.default_rng(0).permutation(rays)
            for order, given in (("coherent", rays), ("shuffled", shuffled)):
                yield {"subject": subject.name, "view": view, "order": order} | compare(
                    scene, given, order == "coherent", repetitions
                )


def compare(scene, rays, coherent, repetitions):
    ways = {
        "plain": lambda: scene.cast_rays(rays, coherent=coherent),
        "certified": lambda: scene.cast_rays(rays, coherent=coherent, certify=True),
    }
    seconds, results = take_turns(ways, repetitions)
    hits = results["certified"]
    proven = hits.statuses == 1
    lower, upper = hits.t_bounds[proven].T
    different = np.isfinite(hits.t_hit) != proven
    different[proven] |= (hits.t_hit[proven] < lower) | (hits.t_hit[proven] > upper)
    different &= hits.statuses != 2
    widths = (upper - lower) * np.linalg.norm(rays[proven, 3:], axis=1)
    return {
        "rays": len(rays),
        "hit": float(proven.mean()),
        "seconds": {name: spread(times) for name, times in seconds.items()},
        "undecided": int((hits.statuses == 2).sum()),
        "different": int(different.sum()),
        "width": float(widths.max(initial=0)),
    }


def times(result):
    return result["seconds"]["certified"]["median"] / result["seconds"]["plain"]["median"]


def goals(results):
    names = ["{subject}, {view}, {order}".format(**result) for result in results]
    count = sum(result["rays"] for result in results)
    share = sum(result["undecided"] for result in results) / count
    different = [result["different"] for result in results]
    return [
        at_most(GOALS[0][0], 3, dict(zip(names, map(times, results))), "times"),
        at_most(GOALS[1][0], 1e-6, {f"{count:,} rays": share}, "of them"),
        none_of(GOALS[2][0], dict(zip(names, different)), count),
    ]


def table(results):
    header = (
        "volume",
        "view",
        "rays",
        "hit",
        "plain, ns a ray",
        "certified",
        "times",
        "undecided",
        "different",
        "width",
    )
    rows = [
        (
            result["subject"],
            result["view"],
            result["order"],
            f"{result['hit']:.0%}",
            *(with_spread(result["seconds"][name], 1e9 / result["rays"]) for name in ("plain", "certified")),
            f"{times(result):.1f}",
            result["undecided"],
            result["different"],
            f"{result['width']:.0e}",
        )
        for result in results
    ]
    return markdown_table(header, rows)
