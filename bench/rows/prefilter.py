"""The prefilter, from samples to coefficients, against SciPy and against the memory bandwidth."""

import re
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from scipy import ndimage
from suite.clock import spread, take_turns
from suite.goal import at_least
from suite.tables import markdown_table, with_spread

import isospline

TITLE = "Prefilter"
ABOUT = """Random samples to float32 coefficients with all cores, against scipy.ndimage.spline_filter with output
float32, which has one thread; the coefficients must agree to 1e-5 of the largest. The bandwidth is that of copying one
float32 array of the volume's size to another with NumPy, a slab a thread, counting reads and writes. *Of bandwidth* is
the time to read the samples once and write the coefficients once at that rate, divided by the time measured. *Memory*
is the largest growth of the process during the call, divided by the size of the coefficients."""
SETTINGS = ("prefilter_sizes", "repetitions")
GOALS = [("prefilter of 512^3 uint8 against scipy.ndimage.spline_filter", "at least 10 times")]


def measure(settings):
    isospline.set_thread_count(0)
    for size in settings.prefilter_sizes:
        bandwidth = copy_bandwidth(size, isospline.thread_count())
        for dtype in ("uint8", "float32"):
            data = (np.random.default_rng(size).random((size,) * 3, dtype=np.float32) * 255).astype(dtype)
            for degree in (2, 3):
                yield {
                    "size": size,
                    "dtype": dtype,
                    "degree": degree,
                    "threads": isospline.thread_count(),
                    "copy_bytes_per_second": bandwidth,
                } | compare(data, degree, settings.repetitions)


def compare(data, degree, repetitions):
    seconds, filtered = take_turns(
        {
            "isospline": lambda: isospline.Volume(data, degree=degree),
            "scipy": lambda: ndimage.spline_filter(data, degree, np.float32, "mirror"),
        },
        repetitions,
    )
    expected = filtered["scipy"]
    difference = float(np.abs(filtered["isospline"].coefficients - expected).max() / np.abs(expected).max())
    assert difference <= 1e-5, f"coefficients differ by {difference:.1e} of the largest"
    del expected, filtered
    return {
        "seconds": {name: spread(times) for name, times in seconds.items()},
        "difference": difference,
        "least_bytes": data.nbytes + 4 * data.size,
        "memory_over_coefficients": peak_growth(lambda: isospline.Volume(data, degree=degree)) / (4 * data.size),
    }


def copy_bandwidth(size, threads):
    """Bytes a second, read and written, of the best of five copies of float32 arrays."""
    source, target = np.ones(size**3, np.float32), np.zeros(size**3, np.float32)
    parts = list(zip(np.array_split(source, threads), np.array_split(target, threads)))
    best = np.inf
    with ThreadPoolExecutor(threads) as pool:
        for _ in range(5):
            start = time.perf_counter()
            list(pool.map(lambda part: np.copyto(part[1], part[0]), parts))
            best = min(best, time.perf_counter() - start)
    return 2 * source.nbytes / best


def peak_growth(function):
    """The largest growth of the process during a call, in bytes."""
    Path("/proc/self/clear_refs").write_text("5", encoding="utf-8")
    before = memory_of_process("VmRSS")
    result = function()
    growth = memory_of_process("VmHWM") - before
    del result
    return growth


def memory_of_process(field):
    """VmRSS (the current value) or VmHWM (the largest since the last reset), in bytes."""
    return (
        int(re.search(rf"{field}:\s+(\d+) kB", Path("/proc/self/status").read_text(encoding="utf-8")).group(1)) * 1024
    )


def of_bandwidth(result):
    return result["least_bytes"] / result["copy_bytes_per_second"] / result["seconds"]["isospline"]["median"]


def ratio(result):
    return result["seconds"]["scipy"]["median"] / result["seconds"]["isospline"]["median"]


def goals(results):
    """The results of the largest size."""
    size = max(result["size"] for result in results)
    (found,) = (r for r in results if (r["size"], r["dtype"], r["degree"]) == (size, "uint8", 2))
    bandwidth = f"{found['copy_bytes_per_second'] / 1e9:.3g} GB/s"
    label = f"{size}^3; {of_bandwidth(found):.0%} of the copy bandwidth of {bandwidth}"
    return [at_least(GOALS[0][0], 10, {label: ratio(found)})]


def table(results):
    rows = [
        (
            f"{result['size']}^3",
            result["dtype"],
            result["degree"],
            *(with_spread(result["seconds"][name], 1e3) for name in ("isospline", "scipy")),
            ratio(result),
            result["size"] ** 3 / result["seconds"]["isospline"]["median"] / 1e6,
            result["copy_bytes_per_second"] / 1e9,
            f"{of_bandwidth(result):.0%}",
            result["memory_over_coefficients"],
        )
        for result in results
    ]
    return markdown_table(
        (
            "size",
            "samples",
            "degree",
            "isospline, ms",
            "scipy, ms",
            "ratio",
            "Mvoxel/s",
            "copy, GB/s",
            "of bandwidth",
            "memory",
        ),
        rows,
    )
