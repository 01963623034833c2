"""Solids on coarse grids: sampling, pieces, sections and mirror images."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..interop.mesh_topology import roots_of
from ..scene.cells import index_shape

#: The side of a level on which a solid is.
Inside = Literal["above", "below"]
#: Most points of a grid along the longest side of a volume.
FINEST = 96
# The part of a side that few points cover, and the number of layers that may be padding.
_FEW, _PADDED = 0.01, 3
# The part of the next layer that the first one of a solid with a flat end has at least; a round end has less.
_FLAT = 0.8


@dataclass(frozen=True, eq=False)
class Grid:
    """Which points of a coarse grid are inside of a solid.

    Attributes
    ----------
    inside : (nz, ny, nx) bool array
    spacing : (3,) float64 array
        Distances between the points along the array's axes, world units.
    """

    inside: NDArray[np.bool_]
    spacing: NDArray[np.float64]

    def largest_piece(self) -> Grid:
        """The largest connected piece of the solid."""
        return Grid(pieces(self.inside)[0] == 0, self.spacing)

    def filling(self) -> float:
        """The part of its box that the solid fills."""
        box = [np.ptp(np.flatnonzero(self.sections(axis))) + 1 for axis in range(3)]
        return float(np.count_nonzero(self.inside) / np.prod(box))

    def cut_sides(self) -> int:
        """The number of sides at which the solid begins with many points, at the border or, flat, behind padding."""
        count = 0
        for axis in range(3):
            parts = self.sections(axis) * (self.inside.shape[axis] / self.inside.size)
            for outer in (parts, parts[::-1]):
                (begin, *_) = np.flatnonzero(outer[:_PADDED]).tolist() or [0]
                is_cut = begin == 0 or outer[begin] > _FLAT * outer[begin + 1 : begin + 2].max(initial=0)
                count += int(outer[begin] > _FEW and is_cut)
        return count

    def sections(self, axis: int) -> NDArray[np.int64]:
        """The numbers of inside points in the layers across an axis."""
        return np.count_nonzero(self.inside, axis=tuple(each for each in range(3) if each != axis))


class Samples(NamedTuple):
    """Values at about equally distant points of a volume, the distances in world units and in samples of the volume."""

    values: NDArray[Any]
    spacing: NDArray[np.float64]
    steps: NDArray[np.int64]

    def solid(self, level: float, inside: Inside) -> Grid:
        """The solid above or below a level."""
        return Grid(self.values < level if inside == "below" else self.values > level, self.spacing)

    def place(self, axis: int, point: int) -> int:
        """The index of a point in the volume, along an axis of the array."""
        step = int(self.steps[axis])
        return step // 2 + point * step


def some_samples(data: Any, spacing: NDArray[np.float64]) -> Samples:
    """Some samples of an array; `spacing` is that of its axes."""
    steps = _steps(np.array(data.shape), spacing)
    return Samples(np.asarray(data[tuple(slice(step // 2, None, step) for step in steps)]), spacing * steps, steps)


def samples_of(volume: Any) -> Samples:
    """The model's values at some of the samples of a volume."""
    counts = np.array(index_shape(volume)[::-1])
    spacing = np.linalg.norm(volume.affine[:3, :3], axis=0)[::-1]
    steps = _steps(counts, spacing)
    axes = [np.arange(step // 2, count, step, dtype=float) for step, count in zip(steps, counts)]
    index = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)[:, ::-1]
    values = volume.sample(index @ volume.affine[:3, :3].T + volume.affine[:3, 3])
    return Samples(values.reshape([len(axis) for axis in axes]), spacing * steps, steps)


def _steps(counts, spacing):
    """Steps between samples, so that the points are about equally far apart along all axes."""
    finest = (counts * spacing).max() / FINEST
    return np.minimum(np.maximum(1, np.rint(finest / spacing).astype(int)), np.maximum(1, counts - 1))


def pieces(inside: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Number the connected pieces of a solid, whose points are neighbours across faces.

    Returns
    -------
    numbers : int array of the shape of `inside`
        0 for the largest piece, 1 for the next; -1 outside.
    sizes : (N,) int array
        Numbers of points of the pieces, in descending order.
    """
    places = np.full(inside.shape, -1)
    places[inside] = np.arange(np.count_nonzero(inside))
    pairs = []
    for axis in range(3):
        a, b = np.moveaxis(places, axis, 0)[:-1], np.moveaxis(places, axis, 0)[1:]
        both = (a >= 0) & (b >= 0)
        pairs.append(np.stack([a[both], b[both]]))
    first, second = np.concatenate(pairs, axis=1)
    root = roots_of(first, second, np.count_nonzero(inside))
    roots, number, sizes = np.unique(root, return_inverse=True, return_counts=True)
    order = np.argsort(-sizes, kind="stable")
    rank = np.empty(len(roots), int)
    rank[order] = np.arange(len(roots))
    numbers = np.full(inside.shape, -1)
    numbers[inside] = rank[number.reshape(-1)]
    return numbers, sizes[order]


def smoothed(image: NDArray[np.float64], widths: NDArray[np.int64]) -> NDArray[np.float64]:
    """Means over boxes of 2 w + 1 points along each axis, twice; outside, the image is 0."""
    for axis, width in enumerate(widths):
        for _ in range(2):
            padded = np.pad(image, [(width + 1, width) if each == axis else (0, 0) for each in range(image.ndim)])
            sums = np.moveaxis(np.cumsum(padded, axis=axis), axis, 0)
            image = np.moveaxis((sums[2 * width + 1 :] - sums[: -2 * width - 1]) / (2 * width + 1), 0, axis)
    return image


def symmetry(grid: Grid, axis: int) -> float:
    """The largest part of a solid that is common with its mirror image along an axis, of both together."""
    inside = np.moveaxis(grid.inside, axis, 0)
    sections = grid.sections(axis)
    places = np.arange(len(sections))
    middle = round(2 * np.average(places, weights=sections))
    reach = max(2, len(sections) // 12)
    best = 0.0
    for double in range(middle - reach, middle + reach + 1):
        partner = double - places
        is_in = (partner >= 0) & (partner < len(places))
        mirrored = np.zeros_like(inside)
        mirrored[is_in] = inside[partner[is_in]]
        common = np.count_nonzero(inside & mirrored)
        best = max(best, common / (2 * sections.sum() - common))
    return float(best)


def relief(grid: Grid, axis: int, end: int) -> float:
    """How rough a solid is, seen along an axis from its end 0 or 1.

    It is the root mean square of depths minus smoothed depths, as a part of the size of the outline.
    """
    inside = np.moveaxis(grid.inside, axis, 0)[:: -1 if end else 1]
    outline = inside.any(axis=0)
    across = np.delete(grid.spacing, axis)
    size = np.sqrt(np.count_nonzero(outline) * across.prod())
    depth = np.where(outline, inside.argmax(axis=0) * grid.spacing[axis], 0.0)
    widths = np.maximum(1, np.rint(0.06 * size / across)).astype(int)
    share = smoothed(outline.astype(float), widths)
    inner = outline & (share > 0.95)
    if not inner.any():
        return 0.0
    difference = (depth - smoothed(depth, widths) / np.maximum(share, 1e-9))[inner]
    return float(np.sqrt(np.mean(difference**2)) / size)
