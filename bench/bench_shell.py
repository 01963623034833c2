"""Time to build the shell of an isosurface, and to change its level, for each depth of pruning.

    python bench/bench_shell.py [--size 256] [--depths 0 1 2 3 4] [--runs 9] [--json FILE]

A build computes the value bounds of the bricks and the shell; a change of the level re-uses the bounds. Times are
medians. The volumes are procedural, and the CT volumes of the folder ISOSPLINE_VOLUMES where that is set. Before a
time counts, the shell after a change of the level is compared with that of a new surface.
"""

import argparse
import json
import os
import platform
import re
import statistics
import subprocess
import time
from pathlib import Path

import numpy as np

import isospline
from isospline import volumes

CT = {"bonsai.nii.gz": 40, "engine.nii.gz": 80}


def machine():
    """Name of the processor and the number of them."""
    info = Path("/proc/cpuinfo")
    model = re.search(r"model name\s*:\s*(.*)", info.read_text()) if info.exists() else None
    return f"{model.group(1) if model else platform.machine()}, {os.cpu_count()} processors"


def commit():
    folder = Path(__file__).resolve().parent
    result = subprocess.run(
        ["git", "describe", "--always", "--dirty"], cwd=folder, capture_output=True, text=True, check=False
    )
    return result.stdout.strip() or "unknown"


def cases(size):
    """Name, volume and level of each volume."""
    for name in ("gyroid", "blobs", "marschner_lobb"):
        field = getattr(volumes, name)()
        yield f"{name} {size}^3", isospline.Volume(field.samples(size), **field.grid(size)), field.level
    if folder := os.environ.get("ISOSPLINE_VOLUMES"):
        for name, level in CT.items():
            volume = isospline.read_volume(Path(folder) / name).to_volume()
            yield f"{name.split('.')[0]} {'x'.join(map(str, reversed(volume.shape)))}", volume, level


def median_time(function, runs):
    times = []
    for _ in range(runs):
        begin = time.perf_counter()
        function()
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


def measure(name, volume, level, depth, runs):
    surface = isospline.Isosurface(volume, level, prune_depth=depth)
    other = level + 0.01 * (volume.maximum - volume.minimum)
    cells = isospline.Isosurface(volume, other, prune_depth=depth).with_level(level).shell.cells
    assert np.array_equal(cells, surface.shell.cells), "a change of the level gives another shell"

    def change():
        surface.level = level

    return {
        "volume": name,
        "level": level,
        "prune_depth": depth,
        "cells": surface.shell.count,
        "build_seconds": median_time(lambda: isospline.Isosurface(volume, level, prune_depth=depth), runs),
        "level_seconds": median_time(change, runs),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--depths", type=int, nargs="+", default=[0, 1, 2, 3, 4])
    parser.add_argument("--runs", type=int, default=9)
    parser.add_argument("--json", type=Path, help="file to write the figures to")
    arguments = parser.parse_args()

    print(f"{machine()}; commit {commit()}\n")
    print("| volume | level | depth | cells | build, ms | another level, ms |")
    print("|---|---:|---:|---:|---:|---:|")
    rows = []
    for name, volume, level in cases(arguments.size):
        for depth in arguments.depths:
            row = measure(name, volume, level, depth, arguments.runs)
            rows.append(row)
            print(
                f"| {name} | {level:g} | {depth} | {row['cells']} | {1e3 * row['build_seconds']:.1f} "
                f"| {1e3 * row['level_seconds']:.1f} |",
                flush=True,
            )
    if arguments.json:
        report = {"machine": machine(), "commit": commit(), "rows": rows}
        arguments.json.write_text(json.dumps(report, indent=2) + "\n")


if __name__ == "__main__":
    main()
