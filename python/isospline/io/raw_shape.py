"""Checks whether a given shape of raw samples is plausible.

Neighbouring samples of a volume are similar. So the correlation of samples at a distance in the file has peaks where
that is the distance of rows or slices. If the given shape has them elsewhere, and another shape of as many samples has
them at peaks, the given one is probably wrong.
"""

from __future__ import annotations

import math

import numpy as np

from ..base.system import warn

# The smallest correlation of neighbours in a volume, and the largest one in scrambled samples.
ALIKE, UNLIKE = 0.6, 0.35
# Another shape is likelier if the sum of 1 - correlation along y and z is less than this fraction, and by this much.
BETTER, BETTER_BY = 0.6, 0.02
# The number of runs of samples that are compared, and their length.
RUNS, LENGTH = 1024, 64
# The smallest number of samples along an axis for which a shape is checked or suggested.
LEAST = 4


def warn_of_scrambled_shape(data, order):
    """Warn if samples [z, y, x] differ much from their neighbours along y or z, or less in another shape."""
    likeness = _Likeness(data.reshape(-1))
    if likeness(1) < ALIKE or min(data.shape) < LEAST:
        return
    _, ny, nx = data.shape
    strides = nx, nx * ny
    is_scrambled = min(map(likeness, strides)) < UNLIKE
    if not is_scrambled and _are_peaks(likeness, strides):
        return
    best = _best_shape(likeness, data.size)
    given, found = (math.inf if each is None else _unlikeness(likeness, each) for each in (data.shape, best))
    is_better = found < BETTER * given - BETTER_BY
    if is_scrambled or is_better:
        meaning = f"; did you mean {best}?" if is_better else ""
        warn(
            f"shape: expected samples that are similar to their neighbours, got rows or slices that differ in shape "
            f"{tuple(data.shape)} ({order}){meaning}"
        )


def _unlikeness(likeness, shape):
    """The differences of neighbours along y and z."""
    _, ny, nx = shape
    return 2 - likeness(nx) - likeness(nx * ny)


def _are_peaks(likeness, strides):
    """Whether samples a row or a slice apart are more alike than those a little more or less apart, or half as far."""
    row, slice_ = strides
    return _is_peak(likeness, row, 1) and _is_peak(likeness, slice_, row)


def _is_peak(likeness, stride, step):
    near = (stride + sign * step for sign in (-2, -1, 1, 2))
    parts = (stride // parts for parts in (2, 3, 4) if stride % (parts * step) == 0)
    return all(likeness(each) <= likeness(stride) for each in (*near, *parts) if each > 2 * step)


def _best_shape(likeness, count):
    """The shape of that many samples whose rows and slices are at peaks and most alike; None if there is none."""
    divisors = sorted(
        {each for low in range(1, math.isqrt(count) + 1) if count % low == 0 for each in (low, count // low)}
    )
    rows = [nx for nx in divisors if LEAST <= nx <= count // LEAST**2 and _is_local_peak(likeness, nx, 1)]
    shapes = [
        (count // (nx * ny), ny, nx)
        for nx in sorted(rows, key=likeness, reverse=True)[:8]
        for ny in divisors
        if LEAST <= ny <= count // nx // LEAST and (count // nx) % ny == 0 and _is_local_peak(likeness, nx * ny, nx)
    ]
    return min(shapes, key=lambda shape: _unlikeness(likeness, shape), default=None)


def _is_local_peak(likeness, stride, step):
    return all(likeness(stride + each) <= likeness(stride) for each in (-step, step))


class _Likeness:
    """The correlation of samples with those a stride after them in the file."""

    def __init__(self, flat):
        self._flat, self._found = flat, {}

    def __call__(self, stride):
        if stride not in self._found:
            self._found[stride] = self._correlation(stride)
        return self._found[stride]

    def _correlation(self, stride):
        count = len(self._flat) - stride - LENGTH
        if count < 1:
            return 1.0
        first = np.unique(np.linspace(0, count - 1, RUNS).astype(np.int64) + np.arange(RUNS) * 37 % 101)
        places = np.minimum(first, count - 1)[:, None] + np.arange(LENGTH)
        here, there = self._flat[places].astype(float).ravel(), self._flat[places + stride].astype(float).ravel()
        if not (np.isfinite(here).all() and np.isfinite(there).all()):
            return 1.0
        deviation = here.std() * there.std()
        if not (math.isfinite(deviation) and deviation > 0):
            return 1.0
        return float(((here - here.mean()) * (there - there.mean())).mean() / deviation)
