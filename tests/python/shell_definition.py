"""The shell as the paper defines it, cell by cell, in float64 NumPy: slow, and independent of the library's code."""

from math import comb

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

BOUNDARY_MODES = {"mirror": "reflect", "periodic": "wrap"}


def padded_coefficients(volume):
    """Coefficients as float64, with those beyond the border that the outer cells read."""
    coefficients = volume.coefficients
    pad = volume.degree // 2
    # NumPy's "reflect" repeats single samples as mirroring does, for any width.
    return np.pad(coefficients, pad, mode=BOUNDARY_MODES[volume.boundary])


def two_scale(coefficients, degree, axis):
    """The two-scale relation of §5 along one axis; rows begin with the first coefficient of the first cell."""
    coarse = np.moveaxis(coefficients, axis, 0)
    fine = np.zeros((2 * (len(coarse) - degree) + degree, *coarse.shape[1:]))
    for m in range(len(fine)):
        for j in range(len(coarse)):
            if 0 <= m + degree - 2 * j <= degree + 1:
                fine[m] += coarse[j] * comb(degree + 1, m + degree - 2 * j) / 2**degree
    return np.moveaxis(fine, 0, axis)


def in_windows(reduce, flags, size, step):
    """Reduce the flags in windows of `size`^3, every `step` along each axis, by `reduce`: any or all."""
    for axis in range(3):
        windows = sliding_window_view(flags, size, axis=axis)
        flags = reduce(windows[(slice(None),) * axis + (slice(None, None, step),)], axis=-1)
    return flags


def both_signs(coefficients, degree, cells_per_side=1):
    """Whether the coefficients of a cell, at `cells_per_side` sub-cells along its edges, have both signs."""
    below = coefficients < 0
    size = cells_per_side + degree
    return in_windows(np.any, below, size, cells_per_side) & ~in_windows(np.all, below, size, cells_per_side)


def border(shape):
    flags = np.ones(shape, dtype=bool)
    flags[1:-1, 1:-1, 1:-1] = False
    return flags


def shell(volume, level, *, prune_depth=2, prune_border=True):
    """Bool array over the cells, in the order of the axes of the volume's data."""
    degree = volume.degree
    coefficients = padded_coefficients(volume) - level
    initial = both_signs(coefficients, degree)
    for _ in range(prune_depth):
        for axis in range(3):
            coefficients = two_scale(coefficients, degree, axis)
    pruned = initial & both_signs(coefficients, degree, 2**prune_depth)
    return pruned if prune_border else np.where(border(initial.shape), initial, pruned)


def cut_by_mask(cells, mask, degree):
    """The cells that a mask over the samples keeps."""
    return cells & (mask if degree % 2 == 0 else in_windows(np.all, mask, 2, 1))
