"""Measuring time: medians, and methods that take turns."""

import statistics
import time


def timed(call):
    """Seconds that a call takes, and what it returns."""
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def median_seconds(call, repetitions):
    return statistics.median(timed(call)[0] for _ in range(repetitions))


def take_turns(calls, repetitions):
    """Seconds of each of the named calls, as lists, and what each returned.

    The calls take turns, forth and back, so that whatever else the machine does falls on all of them. A first round,
    which is not timed, warms up.
    """
    results = {name: call() for name, call in calls.items()}
    seconds = {name: [] for name in calls}
    for repetition in range(repetitions):
        for name in list(calls) if repetition % 2 == 0 else reversed(list(calls)):
            seconds[name].append(timed(calls[name])[0])
    return seconds, results


def rates(count, seconds):
    """Millions a second: median, smallest and largest of the runs."""
    return {
        "median": count / statistics.median(seconds) / 1e6,
        "minimum": count / max(seconds) / 1e6,
        "maximum": count / min(seconds) / 1e6,
    }
