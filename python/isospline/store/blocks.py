"""Blocks of a volume, with the samples around them on which the result for a block depends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .layout import slices_of

Box = tuple[tuple[int, int], ...]


def with_halo(box: Box, halo: int, shape: Any, boundary: str) -> Box:
    """A box and `halo` samples around it.

    In a mirrored volume, the box ends at the border; the filter applies the boundary rule there. In a periodic volume,
    the box continues beyond the border, with indices below 0 and above the last; a box longer than a period is reduced
    to the whole volume.
    """
    grown = []
    for (first, last), size in zip(box, shape):
        low, high = first - halo, last + halo
        if boundary == "mirror":
            low, high = max(low, 0), min(high, size)
        if high - low >= size:
            low, high = 0, size
        grown.append((low, high))
    return tuple(grown)


def read_box_folded(read: Callable[[Box], NDArray[Any]], box: Box, shape: Any, boundary: str) -> NDArray[Any]:
    """Read a box with `read`; indices beyond the volume are mapped into it by the boundary rule."""
    return read_indices(
        read, [inside_indices(np.arange(first, last), size, boundary) for (first, last), size in zip(box, shape)]
    )


def read_indices(read: Callable[[Box], NDArray[Any]], indices: Sequence[NDArray[np.int64]]) -> NDArray[Any]:
    """Read some indices along each axis with `read`: as boxes of consecutive indices, which are then joined."""
    found = [np.unique(each, return_inverse=True) for each in indices]
    runs = [np.split(each, np.flatnonzero(np.diff(each) > 1) + 1) for each, _ in found]

    def join(axis, box):
        if axis == len(runs):
            return read(box)
        parts = [join(axis + 1, (*box, (int(run[0]), int(run[-1]) + 1))) for run in runs[axis]]
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=axis)

    samples = join(0, ())
    for axis, (each, place) in enumerate(found):
        if len(place) != len(each) or (place[1:] < place[:-1]).any():
            samples = samples.take(place, axis=axis)
    return samples


def inside_indices(indices: NDArray[np.int64], size: int, boundary: str) -> NDArray[np.int64]:
    """The indices inside the volume to which the boundary rule maps some indices."""
    if size == 1:
        return np.zeros_like(indices)
    period = size if boundary == "periodic" else 2 * size - 2
    within = indices % period
    return np.where(within < size, within, period - within)


def cut(block: NDArray[Any], box: Box, grown: Box) -> NDArray[Any]:
    """The part of a block without its halo: `grown` is the box with the halo, `box` without it."""
    return block[slices_of([(first - low, last - low) for (first, last), (low, _) in zip(box, grown)])]
