"""Progress of long operations: a bar on a terminal, otherwise plain lines, with the remaining time."""

from __future__ import annotations

import sys
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from .. import _core
from .handed import handed
from .mistakes import sentence

#: Seconds between two plain lines.
LINE_INTERVAL = 10.0

#: The rate is that of so many lines. That of all would promise an early end where the last parts are the slowest.
RATE_LINES = 6

#: From this fraction on, the rate gives the remaining time.
LEAST_MADE = 1e-3


class Bar:
    """A callable that shows the finished fraction on standard error, for ``progress=True``."""

    def __init__(self, title: str = "", leave: bool = True) -> None:
        from tqdm import tqdm

        layout = (title and f"{title:<14}") + "{percentage:3.0f}%|{bar}| {elapsed}<{remaining}"
        self._bar = tqdm(total=1.0, leave=leave, bar_format=layout, file=sys.stderr)
        self._begun = False

    def __call__(self, fraction: float) -> None:
        if not self._begun:  # earlier work does not count for the rate
            self._begun = True
            self._bar.initial = fraction
        self._bar.update(fraction - self._bar.n)

    def close(self) -> None:
        """End the line."""
        self._bar.close()

    def __del__(self) -> None:
        self.close()


class Lines:
    """A callable that prints the finished fraction to standard error, one line every ten seconds."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._begin = self._told = time.monotonic()
        self._ends: deque[tuple[float, float]] = deque(maxlen=RATE_LINES)

    def __call__(self, fraction: float) -> None:
        now = time.monotonic()
        if not self._ends:  # earlier work does not count for the rate
            self._ends.append((self._begin, fraction))
        if now - self._told < LINE_INTERVAL:
            return
        self._told = now
        begin, first = self._ends[0]
        self._ends.append((now, fraction))
        made = fraction - first
        left = f", {_clock((now - begin) * (1 - fraction) / made)} left" if made > LEAST_MADE else ""
        print(
            f"isospline: {self._title}: {fraction:.0%}, {_clock(now - self._begin)}{left}", file=sys.stderr, flush=True
        )

    def close(self) -> None:
        """There is nothing to clean up."""


def _clock(seconds: float) -> str:
    from tqdm import tqdm

    return tqdm.format_interval(round(seconds))


def part_of(progress: Callable[[float], object] | None, number: int, count: int) -> Callable[[float], object] | None:
    """A callback for one of `count` equal parts of an operation."""
    return None if progress is None else lambda fraction: progress((number + fraction) / count)


def tell(progress: Callable[[float], object] | None, fraction: float) -> None:
    """Call a callback with the finished fraction; raises Cancelled if it asks for that."""
    if progress is not None:
        go_on = progress(fraction)
        if go_on is not None and not go_on:
            raise _core.Cancelled


@handed
def as_callable(progress: Any) -> Callable[[float], object] | None:
    """The callback for a parameter `progress`."""
    if progress is None or progress is False:
        return None
    if progress is True:
        return Bar()
    if not callable(progress):
        raise TypeError(sentence("progress", "a callable, True for a bar, or None", progress))
    given: Callable[[float], object] = progress
    return given
