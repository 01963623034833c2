"""Light from interleaved samples: the pixels of a block of 4 x 4 send their rays in different directions.

So the mean over such a block has sixteen times the directions of a pixel, and the differences of its pixels cancel:
A. Keller, W. Heidrich, "Interleaved sampling", Eurographics Workshop on Rendering 2001.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .pixels import row_bands

if TYPE_CHECKING:
    from .image import Image

    Window = tuple[int, int, int, int]

#: The layers that tell surfaces apart.
GUIDES = ("position", "normal", "geometry_ids")
# The pixels on each side that count, and their weights: blocks of 4 x 4, centred.
_REACH = 2
_WEIGHTS = np.array((0.5, 1, 1, 1, 0.5), np.float32) / 4
#: Pixels beside a crop on which its pixels depend: those of the mean, and those that decide which of them are needed.
MARGIN = 2 * _REACH
# Of one smooth surface: the smallest cosine of the angle between normals, and the largest slope from point to point.
_ALIKE, _SLOPE = 0.8, 0.4


def widened(crop: Window | None, size: tuple[int, int]) -> tuple[Window | None, tuple[slice, slice]]:
    """A crop with the pixels on which it depends, and where it is in these."""
    if crop is None:
        return None, (slice(None), slice(None))
    column, row, width, height = crop
    left, top = max(0, column - MARGIN), max(0, row - MARGIN)
    right, bottom = min(size[0], column + width + MARGIN), min(size[1], row + height + MARGIN)
    inner = slice(row - top, row - top + height), slice(column - left, column - left + width)
    return (left, top, right - left, bottom - top), inner


def seen_parts(
    pairs: list[tuple[NDArray[np.float32], NDArray[np.float32]]], guides: Image
) -> list[NDArray[np.float32]]:
    """The parts of lights that reach each pixel, (height, width), from colours (height, width, 4): lit, and unhidden.

    They are means over the block around each pixel, where it shows the same smooth surface. Pixels beside another
    surface may show a part of it; they have the means of such pixels.
    """
    sums_of_colors = [tuple(color[..., :3].sum(axis=-1) for color in pair) for pair in pairs]
    weights = [(unhidden > 1e-6).astype(np.float32) for _, unhidden in sums_of_colors]  # the others tell nothing
    parts = [lit / np.maximum(unhidden, 1e-6) * known for (lit, unhidden), known in zip(sums_of_colors, weights)]
    results = [np.ones(part.shape, np.float32) for part in parts]
    is_edge = np.zeros(guides.geometry_ids.shape, bool)
    for rows in row_bands(guides.geometry_ids):
        first, last = rows.start, min(rows.stop, len(guides.geometry_ids))
        position, normal, id = (getattr(guides, name)[first:last] for name in GUIDES)
        sums, totals = ([np.zeros(id.shape, np.float32) for _ in parts] for _ in range(2))
        for weight, here, there, is_beside in _offsets(guides.geometry_ids.shape, first, last):
            apart = guides.position[there] - position[here]
            square_distance = np.einsum("...i,...i", apart, apart)
            height = np.einsum("...i,...i", apart, normal[here])
            is_same = id[here] == guides.geometry_ids[there]
            is_same &= np.einsum("...i,...i", normal[here], guides.normal[there]) >= _ALIKE
            is_same &= height * height <= _SLOPE**2 * square_distance
            share = weight * is_same
            if is_beside:
                is_edge[first:last][here] |= ~is_same & (guides.geometry_ids[there] != _core.INVALID_ID)
            for sum, total, part, known in zip(sums, totals, parts, weights):
                sum[here] += share * part[there]
                total[here] += share * known[there]
        for result, sum, total in zip(results, sums, totals):
            np.divide(sum, total, out=result[first:last], where=total > 0)
    # The centre of a pixel with a part of a surface may miss it.
    is_edge |= guides.geometry_ids == _core.INVALID_ID
    edges = [mean_on_plane(part, is_edge * known) for part, known in zip(parts, weights)]
    return [np.where(is_edge, edge, result) for edge, result in zip(edges, results)]


def mean_on_plane(part: NDArray[Any], weights: NDArray[Any]) -> NDArray[np.float32]:
    """The means of numbers (height, width) over the block around each pixel, with weights; 0 where all of these are."""
    sum, total = _blurred(part * weights), _blurred(weights)
    return np.divide(sum, total, out=np.zeros_like(sum), where=total > 0)


def near(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The pixels in whose block there is a pixel of a mask."""
    return _blurred(mask) > 0


def _blurred(numbers):
    """The weighted sum over the block around each pixel; there is nothing outside of the picture."""
    padded = np.pad(np.asarray(numbers, np.float32), _REACH)
    height, width = numbers.shape
    across = sum(weight * padded[:, k : k + width] for k, weight in enumerate(_WEIGHTS))
    return sum(weight * across[k : k + height] for k, weight in enumerate(_WEIGHTS))


def _offsets(shape, first, last) -> Iterator[tuple[np.float32, Any, Any, bool]]:
    """For each pixel of a block its weight, the pairs of pixels that it relates, and whether these are neighbours.

    The first of each pair is in some rows, the second in the picture.
    """
    height, width = shape
    for down, weight_down in zip(range(-_REACH, _REACH + 1), _WEIGHTS):
        rows = slice(max(first, -down), min(last, height - down))
        for right, weight_right in zip(range(-_REACH, _REACH + 1), _WEIGHTS):
            columns = slice(max(0, -right), min(width, width - right))
            here = slice(rows.start - first, rows.stop - first), columns
            there = slice(rows.start + down, rows.stop + down), slice(columns.start + right, columns.stop + right)
            if rows.stop > rows.start and columns.stop > columns.start:
                yield weight_down * weight_right, here, there, abs(down) + abs(right) == 1
