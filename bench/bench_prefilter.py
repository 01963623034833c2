"""Samples to coefficients: isospline.Volume against scipy.ndimage.spline_filter, in one run and on the same samples.

    python bench/bench_prefilter.py [--sizes 64 128 256] [--degrees 2 3] [--json FILE]

Times are the best of several runs. The memory is what the process grew by at most while the volume was made, over the
size of the coefficients. The answers are compared, and a difference ends the benchmark.
"""

import argparse
import json
import os
import platform
import re
import time
from pathlib import Path

import numpy as np
import scipy.ndimage

import isospline


def best_time(function, runs):
    times = []
    for _ in range(runs):
        begin = time.perf_counter()
        function()
        times.append(time.perf_counter() - begin)
    return min(times)


def memory_of_process(field):
    """VmRSS (now) or VmHWM (at most, since the last reset), in bytes."""
    return int(re.search(rf"{field}:\s+(\d+) kB", Path("/proc/self/status").read_text()).group(1)) * 1024


def peak_growth(function):
    """Bytes that the process grew by at most during a call."""
    Path("/proc/self/clear_refs").write_text("5")
    before = memory_of_process("VmRSS")
    result = function()
    growth = memory_of_process("VmHWM") - before
    del result
    return growth


def measure(size, dtype, degree, runs):
    rng = np.random.default_rng(size)
    data = (rng.random((size,) * 3, dtype=np.float32) * 255).astype(dtype)

    def ours():
        return isospline.Volume(data, degree=degree)

    def scipys():
        return scipy.ndimage.spline_filter(data, order=degree, output=np.float32, mode="mirror")

    expected = scipys()
    difference = np.abs(ours().coefficients - expected).max() / np.abs(expected).max()
    assert difference <= 1e-5, f"coefficients differ by {difference:.1e} of the largest"
    del expected
    row = {
        "size": size,
        "dtype": dtype,
        "degree": degree,
        "isospline_seconds": best_time(ours, runs),
        "scipy_seconds": best_time(scipys, 2 if size <= 256 else 1),
        "memory_over_coefficients": peak_growth(ours) / (4 * size**3),
    }
    row["ratio"] = row["scipy_seconds"] / row["isospline_seconds"]
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[64, 128, 256])
    parser.add_argument("--dtypes", nargs="+", default=["float32", "uint8"])
    parser.add_argument("--degrees", type=int, nargs="+", default=[2, 3])
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--json", type=Path, help="file to write the figures to")
    arguments = parser.parse_args()

    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} processors")
    print("| size | dtype | degree | scipy, ms | isospline, ms | ratio | Mvoxel/s | memory / coefficients |")
    print("|---|---|---|---|---|---|---|---|")
    rows = []
    for size in arguments.sizes:
        for dtype in arguments.dtypes:
            for degree in arguments.degrees:
                row = measure(size, dtype, degree, arguments.runs)
                rows.append(row)
                print(
                    f"| {size}^3 | {dtype} | {degree} | {1e3 * row['scipy_seconds']:.1f} "
                    f"| {1e3 * row['isospline_seconds']:.1f} | {row['ratio']:.1f} "
                    f"| {size**3 / row['isospline_seconds'] / 1e6:.0f} | {row['memory_over_coefficients']:.2f} |",
                    flush=True,
                )
    if arguments.json:
        arguments.json.write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main()
