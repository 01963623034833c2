"""Holders that touch what they hold: large parts at the border of the volume that hang on by little."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .grid import Grid, pieces

#: Layers of points that are taken off, so that holders come apart from what they hold.
_OFF = 2
#: The least size of a holder, as a part of what it holds; ears and noses are smaller.
_LEAST = 0.015


def holders(grid: Grid) -> NDArray[np.bool_]:
    """The points of a solid that belong to its holders."""
    numbers, _ = pieces(_eroded(grid.inside, _OFF))
    core = numbers == 0
    for _ in range(_OFF + 1):
        core = grown(core) & grid.inside
    found = np.zeros_like(core)
    if not core.any():
        return found
    numbers, sizes = pieces(grid.inside & ~core)
    for number in np.flatnonzero(sizes >= _LEAST * np.count_nonzero(core)):
        piece = numbers == number
        if any(np.moveaxis(piece, axis, 0)[[0, -1]].any() for axis in range(3)):
            found |= piece
    return found


def grown(inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """A solid with all neighbours of its points across faces."""
    result = inside.copy()
    for axis in range(3):
        along, to = np.moveaxis(inside, axis, 0), np.moveaxis(result, axis, 0)
        to[1:] |= along[:-1]
        to[:-1] |= along[1:]
    return result


def _eroded(inside: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    """A solid without the outer layers of its points; the border of the grid does not count as outside."""
    outside = ~inside
    for _ in range(count):
        outside = grown(outside)
    return ~outside
