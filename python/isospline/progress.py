"""Progress of long operations as a bar."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .mistakes import sentence


class Bar:
    """A callable that shows the finished fraction on standard error, for ``progress=True``."""

    def __init__(self) -> None:
        from tqdm import tqdm

        self._bar = tqdm(total=100, unit="%", bar_format="{l_bar}{bar}| {elapsed}<{remaining}")

    def __call__(self, fraction: float) -> None:
        self._bar.update(round(100 * fraction) - self._bar.n)

    def __del__(self) -> None:
        self._bar.close()


def as_callable(progress: Any) -> Callable[[float], object] | None:
    """What a parameter `progress` stands for."""
    if progress is None or progress is False:
        return None
    if progress is True:
        return Bar()
    if not callable(progress):
        raise TypeError(sentence("progress", "a callable, True for a bar, or None", progress))
    return progress
