"""Measuring time: methods take turns, outliers are measured again, results are medians with their spread."""

import statistics
import time

#: A time this many times the median of its method is an outlier.
OUTLIER = 1.25


def timed(call):
    """The seconds that a call takes, and its result."""
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def take_turns(calls, repetitions):
    """The seconds of each of the named calls, as lists, and their results.

    The calls take turns, forwards and backwards, so that other load of the machine affects all of them. A first round,
    which is not timed, warms up. Outliers are measured again.
    """
    results = {name: call() for name, call in calls.items()}
    seconds = {name: [] for name in calls}
    for repetition in range(repetitions):
        for name in list(calls) if repetition % 2 == 0 else reversed(list(calls)):
            seconds[name].append(timed(calls[name])[0])
    measure_outliers_again(seconds, lambda names: {name: timed(calls[name])[0] for name in names})
    return seconds, results


def measure_outliers_again(seconds, measure):
    """Replaces the largest of each method's times while it is an outlier, at most as often as there are times:
    `measure(names)` gives one more time of each of these methods."""
    for _ in range(max(map(len, seconds.values()), default=0)):
        names = [name for name, times in seconds.items() if max(times) > OUTLIER * statistics.median(times)]
        if not names:
            return
        for name, again in measure(names).items():
            times = seconds[name]
            times[times.index(max(times))] = again


def spread(values):
    """Median, smallest and largest."""
    return {"median": float(statistics.median(values)), "minimum": float(min(values)), "maximum": float(max(values))}


def rates(count, seconds):
    """Millions per second: median, smallest and largest of the runs."""
    return spread([count / time / 1e6 for time in seconds])
