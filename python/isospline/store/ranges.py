"""Smallest and largest coefficient that influence each brick of 8 x 8 x 8 cells, as core/isospline/brick/ranges.h."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .blocks import read_box_folded
from .layout import box_of, chunk_path, is_whole_chunk, open_array, read_box, writing
from .metadata import OCTET_SIZE, cell_shape

BRICK_SIZE = OCTET_SIZE // 2


@dataclass(frozen=True)
class WriteRanges:
    """Compute and write one chunk of the array of a level's ranges."""

    root: Path
    key: str
    ranges_key: str
    degree: int
    boundary: str

    def __call__(self, index: Any) -> None:
        target = open_array(self.root, self.ranges_key, "r+")
        if is_whole_chunk(self.root, self.ranges_key, target, index):
            return
        shape = open_array(self.root, self.key).shape
        octets = box_of(index[:3], target.chunks[:3], target.shape[:3])
        box = []
        for (first, last), cells in zip(octets, cell_shape(shape, self.degree)):
            # Cell c has degree + 1 coefficients, beginning at c - degree // 2.
            begin, end = first * OCTET_SIZE, min(last * OCTET_SIZE, cells)
            box.append((begin - self.degree // 2, end - self.degree // 2 + self.degree))
        read = functools.partial(read_box, self.root, self.key)
        coefficients = read_box_folded(read, tuple(box), shape, self.boundary)
        bricks = [2 * (last - first) for first, last in octets]
        least = _extremes(coefficients, np.minimum, np.float32(np.inf), bricks, self.degree)
        greatest = _extremes(coefficients, np.maximum, np.float32(-np.inf), bricks, self.degree)
        with writing(chunk_path(self.root, self.ranges_key, index)):
            target[tuple(slice(first, last) for first, last in octets)] = np.stack([least, greatest], axis=-2)


def _extremes(coefficients, extreme, beyond, bricks, degree) -> NDArray[np.float32]:
    """The extreme of each brick, by octet: (octets z, y, x, 8); the last index has the brick's bits x, y and z."""
    for axis, count in enumerate(bricks):
        along = np.moveaxis(coefficients, axis, 0)
        # The last brick may have fewer cells; bricks of an octet beyond the grid have none.
        cells = len(along) - degree
        missing = count * BRICK_SIZE - cells
        padding = np.full((missing, *along.shape[1:]), beyond)
        padded = np.concatenate([along, padding])
        result = padded[0 : count * BRICK_SIZE : BRICK_SIZE].copy()
        for reach in range(1, BRICK_SIZE + degree):
            extreme(result, padded[reach : reach + (count - 1) * BRICK_SIZE + 1 : BRICK_SIZE], out=result)
        first_beyond = -(-cells // BRICK_SIZE)
        result[first_beyond:] = beyond
        coefficients = np.moveaxis(result, 0, axis)
    z, y, x = (count // 2 for count in bricks)
    return coefficients.reshape(z, 2, y, 2, x, 2).transpose(0, 2, 4, 1, 3, 5).reshape(z, y, x, 8)
