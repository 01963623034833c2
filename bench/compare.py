"""Compare the ways to trace an isosurface, on the same rays in one run; see bench/README.md.

Prints a table for each volume and view, and writes compare.json and compare.png to the output folder. Ends with status
1 where an exact method disagrees with the float64 oracle or with another exact one.
"""

import argparse
import importlib.util
import itertools
import json
import sys
import time
import warnings
from pathlib import Path

import numpy as np

import isospline
from comparison import judge, machine, report, subjects, views
from comparison.methods import BASELINE, METHODS, build, measure
from comparison.oracle import Oracle

EXACT = [name for name in METHODS if name.endswith("exact")]


def parse(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fields", nargs="*", default=["gyroid", "heart"], metavar="NAME",
                        help="procedural volumes, functions of isospline.volumes (default: gyroid heart)")
    parser.add_argument("--sizes", nargs="*", type=int, default=[64, 128, 256, 512], metavar="N",
                        help="their samples along each axis (default: 64 128 256 512)")
    parser.add_argument("--real", default="", metavar="TEXT",
                        help="only real volumes whose file name holds this; 'none' for none (default: all of them)")
    parser.add_argument("--methods", nargs="+", default=list(METHODS), choices=METHODS, metavar="NAME",
                        help=f"of {', '.join(METHODS)} (default: all)")
    parser.add_argument("--degree", type=int, default=2, choices=(1, 2, 3), help="of the spline (default: 2)")
    parser.add_argument("--size", type=int, nargs=2, default=(512, 512), metavar=("WIDTH", "HEIGHT"),
                        help="of the image whose primary rays are cast (default: 512 512)")
    parser.add_argument("--repetitions", type=int, default=5, help="of which the median counts (default: 5)")
    parser.add_argument("--threads", type=int, default=1, help="0 for all (default: 1)")
    parser.add_argument("--oracle-rays", type=int, default=2000, metavar="N",
                        help="random rays of each view to check against float64 (default: 2000)")
    parser.add_argument("--output", type=Path, default=Path("out"), help="folder of what is written (default: out)")
    parser.add_argument("--quick", action="store_true",
                        help="a run of a minute: sizes 64 and 128, 256 x 256 rays, 500 for the oracle, no real volumes")
    options = parser.parse_args(arguments)
    if options.quick:
        options.sizes, options.size, options.oracle_rays, options.real = [64, 128], (256, 256), 500, "none"
    if "embree_triangles" in options.methods and importlib.util.find_spec("skimage") is None:
        print("embree_triangles is left out: it needs scikit-image")
        options.methods.remove("embree_triangles")
    return options


def isotropic_hop_length(count=200_000):
    """Mean hop over isotropic lines through an empty grid; exactly 2/3 by Cauchy's mean chord 4 V / S of a cube."""
    volume = isospline.Volume(np.zeros((64, 64, 64), np.float32))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that the shell is empty
        hopper = isospline.VoxelHopper(isospline.Isosurface(volume, 1.0))
    hopper.cast_rays(views.isotropic_lines(volume.bounds, count, np.random.default_rng(0)))
    return hopper.statistics["mean_hop_length"]


def compare(subject, options):
    """Results of one subject, one a view."""
    start = time.perf_counter()
    volume = isospline.Volume(subject.data, degree=options.degree, **subject.grid)
    prefilter_seconds = time.perf_counter() - start
    tracers = {name: build(name, subject, volume) for name in options.methods}
    surface = isospline.Isosurface(volume, subject.level)
    scene = isospline.Scene([surface])
    oracle = Oracle(subject.data, subject.level, volume.affine, options.degree)
    generator = np.random.default_rng(0)

    for view, make_rays in (("whole", views.whole_view), ("close", views.close_view)):
        rays = make_rays(scene, tuple(options.size))
        if rays is None:
            continue
        seconds, hits = measure(tracers, rays, options.repetitions)
        voxels_per_t = np.linalg.norm(oracle.to_index(rays)[1], axis=1)
        chosen = generator.choice(len(rays), min(options.oracle_rays, len(rays)), replace=False)
        t_true = oracle.first_crossings(rays[chosen])
        hopping = next((tracers[name].target for name in options.methods if name.startswith("hop")), None)

        result = {
            "subject": subject.name, "view": view, "size": list(subject.data.shape[::-1]), "level": subject.level,
            "degree": options.degree, "cells": surface.shell.count, "rays": len(rays),
            "hit": float(np.isfinite(scene.cast_rays(rays)["t_hit"]).mean()),
            "mean_hop_length": hopping.statistics["mean_hop_length"] if hopping else None,
            "prefilter_seconds": prefilter_seconds, "volume_memory": volume.memory, "methods": {},
        }
        baseline = np.median(seconds[BASELINE]) if BASELINE in seconds else None
        for name, tracer in tracers.items():
            t_hit = hits[name]["t_hit"]
            rates = [len(rays) / 1e6 / elapsed for elapsed in seconds[name]]
            against_exact = None
            if "embree_exact" in hits:
                against_exact = judge.differences(t_hit, hits["embree_exact"]["t_hit"], voxels_per_t)
            result["methods"][name] = {
                "build_seconds": tracer.build_seconds, "memory": tracer.memory, "seconds": seconds[name],
                "mray_per_second": {"median": float(np.median(rates)), "minimum": min(rates), "maximum": max(rates)},
                "ratio": float(baseline / np.median(seconds[name])) if baseline else None,
                "oracle": judge.differences(t_hit[chosen], t_true, voxels_per_t[chosen]) if len(chosen) else None,
                "differ": against_exact and against_exact["lost"] + against_exact["wrong"],
            }
        yield result


def failures(results):
    """Exact methods that lost or invented a crossing, or disagree among themselves."""
    found = []
    for result, name in itertools.product(results, EXACT):
        method = result["methods"].get(name)
        if method and (method["differ"] or (method["oracle"] and method["oracle"]["lost"] + method["oracle"]["wrong"])):
            found.append(f"{result['subject']}, {result['view']} view: {name} is wrong")
    return found


def main(arguments=None):
    options = parse(arguments)
    isospline.set_thread_count(options.threads)
    summary = {"machine": machine.describe(), "options": {key: str(value) if isinstance(value, Path) else value
                                                          for key, value in vars(options).items()}}
    print(f"{summary['machine']['cpu']}, {summary['machine']['threads']} thread(s), {summary['machine']['date']}")
    print(report.legend(summary["options"]))
    summary["isotropic_hop_length"] = isotropic_hop_length()
    print(f"mean hop over isotropic lines: {summary['isotropic_hop_length']:.4f} voxels; exactly 2/3\n")

    results = summary["results"] = []
    real = subjects.real(options.real) if options.real != "none" else ()
    for subject in itertools.chain(subjects.procedural(options.fields, options.sizes), real):
        for result in compare(subject, options):
            results.append(result)
            print(report.table(result) + "\n", flush=True)

    options.output.mkdir(parents=True, exist_ok=True)
    (options.output / "compare.json").write_text(json.dumps(summary, indent=1) + "\n")
    print(options.output / "compare.json")
    if results and importlib.util.find_spec("matplotlib"):
        report.plot(results, options.output / "compare.png")
        print(options.output / "compare.png")
    wrong = failures(results)
    print(*wrong, sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
