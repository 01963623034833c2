"""Checks whether a given shape of raw samples is plausible, and suggests the shape and the type of a raw file.

Neighbouring samples of a volume are similar. So the correlation of samples at a distance in the file has peaks where
that is the distance of rows or slices. If the given shape has them elsewhere, and another shape of as many samples has
them at peaks, the given one is probably wrong.
"""

from __future__ import annotations

import math
import os
import re

import numpy as np

from ..base.system import warn

# Shape, x first, and type in the name of a raw file.
_NAMED = re.compile(r"(?<!\d)(\d+)x(\d+)x(\d+)_(u?int(?:8|16|32|64)|float(?:32|64))(?![a-z0-9])", re.IGNORECASE)

# The smallest correlation of neighbours in a volume, and the largest one in scrambled samples.
ALIKE, UNLIKE = 0.6, 0.35
# Another shape is likelier if the sum of 1 - correlation along y and z is less than this fraction, and by this much.
BETTER, BETTER_BY = 0.6, 0.02
# The number of runs of samples that are compared, and their length.
RUNS, LENGTH = 1024, 64
# The smallest number of samples along an axis for which a shape is checked or suggested.
LEAST = 4
# The smallest number of samples for which a shape is suggested.
FEWEST = 1000
# The types that are tried for a raw file; of equally likely ones, the first is suggested.
TYPES = ("u1", "<u2", "<i2", ">u2", ">i2", "<f4", ">f4", "<f8")
# Floating-point numbers that are not between these, or zero, are bits of another type.
TINY, HUGE = 1e-30, 1e30
# The largest number of bytes that are kept in memory.
MOST_KEPT = 1 << 24
# The largest sum of 1 - correlation along x, y and z for which a shape is suggested.
MOST_UNLIKE = 0.6


def shape_of_name(path):
    """The shape (nz, ny, nx) and the type in the name of a raw file; None if it has none."""
    named = _NAMED.search(os.path.basename(path))
    return named and (tuple(int(count) for count in named.group(3, 2, 1)), named.group(4).lower())


def describe_raw(path):
    """The shape and the type, such as "<u2", by a raw file's name or else by its samples; None if neither tells."""
    named = shape_of_name(path)
    if named and math.prod(named[0]) * np.dtype(named[1]).itemsize == os.path.getsize(path):
        return named[0], _text_of(np.dtype(named[1]))
    return suggest_raw(path)


def suggest_raw(path, offset=0):
    """The shape (nz, ny, nx) and the type of the samples in a raw file whose neighbours are most alike.

    Parameters
    ----------
    path : path-like
    offset : int
        Bytes before the samples.

    Returns
    -------
    ((int, int, int), str) or None
        None if no shape and type make neighbours alike.
    """
    size, found = os.path.getsize(path) - offset, []
    for dtype in map(np.dtype, TYPES):
        if size < FEWEST * dtype.itemsize or size % dtype.itemsize:
            continue
        likeness = _Likeness(path, dtype, offset, size // dtype.itemsize)
        if not likeness.is_plausible() or likeness(1) < ALIKE:
            continue
        shape = _best_shape(likeness, size // dtype.itemsize)
        if shape is not None:
            found.append((1 - likeness(1) + _unlikeness(likeness, shape), shape, _text_of(dtype)))
    unlikeness, *best = min(found, key=lambda each: each[0], default=(math.inf,))
    return tuple(best) if unlikeness < MOST_UNLIKE else None


def _text_of(dtype):
    """Such as "u1" and "<u2"."""
    return dtype.str.lstrip("|")


def warn_of_scrambled_shape(path, shape, dtype, offset, order):
    """Warn if samples [z, y, x] differ much from their neighbours along y or z, or less in another shape."""
    count = math.prod(shape)
    likeness = _Likeness(path, dtype, offset, count)
    if likeness(1) < ALIKE or min(shape) < LEAST:
        return
    _, ny, nx = shape
    strides = nx, nx * ny
    is_scrambled = min(map(likeness, strides)) < UNLIKE
    if not is_scrambled and _are_peaks(likeness, strides):
        return
    best = _best_shape(likeness, count)
    given, found = (math.inf if each is None else _unlikeness(likeness, each) for each in (shape, best))
    is_better = found < BETTER * given - BETTER_BY
    if is_scrambled or is_better:
        meaning = f"; did you mean {best}?" if is_better else ""
        warn(
            f"shape: expected samples that are similar to their neighbours, got rows or slices that differ in shape "
            f"{tuple(shape)} ({order}){meaning}"
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
    """The correlation of samples in a file with those a stride after them."""

    def __init__(self, path, dtype, offset, count):
        self._path, self._dtype, self._offset, self._count = path, np.dtype(dtype), offset, count
        is_small = count * self._dtype.itemsize <= MOST_KEPT
        self._kept = np.fromfile(path, self._dtype, count, offset=offset) if is_small else None
        self._found = {}

    def __call__(self, stride):
        if stride not in self._found:
            self._found[stride] = self._correlation(stride)
        return self._found[stride]

    def is_plausible(self):
        """Whether some samples are finite numbers that a measurement may have, and not all the same."""
        with np.errstate(invalid="ignore"):  # of signalling NaNs
            some = np.abs(self._at(np.linspace(0, self._count - LENGTH, RUNS).astype(np.int64), LENGTH))
        return bool(((some == 0) | ((some > TINY) & (some < HUGE))).all()) and np.ptp(some) > 0

    def _correlation(self, stride):
        count = self._count - stride - LENGTH
        if count < 1:
            return 1.0
        first = np.unique(np.linspace(0, count - 1, RUNS).astype(np.int64) + np.arange(RUNS) * 37 % 101)
        first = np.minimum(first, count - 1)
        here, there = self._at(first, LENGTH), self._at(first + stride, LENGTH)
        if not (np.isfinite(here).all() and np.isfinite(there).all()):
            return 1.0
        deviation = here.std() * there.std()
        if not (math.isfinite(deviation) and deviation > 0):
            return 1.0
        return float(((here - here.mean()) * (there - there.mean())).mean() / deviation)

    def _at(self, first, length):
        """Runs of samples, one after the other.

        Those of a large file are read each time, because mapped pages count as memory of the process.
        """
        if self._kept is not None:
            return self._kept[first[:, None] + np.arange(length)].ravel().astype(float)
        size, found = length * self._dtype.itemsize, bytearray()
        with open(self._path, "rb", buffering=0) as file:
            for place in (self._offset + first * self._dtype.itemsize).tolist():
                file.seek(place)
                found += file.read(size)
        return np.frombuffer(found, self._dtype).astype(float)
