"""Checks whether a given shape of raw samples is plausible.

Neighbouring samples of a volume are similar. If neighbours along x are similar, but neighbours along y or z are not,
the shape is probably wrong.
"""

from __future__ import annotations

import itertools
import math
import warnings

import numpy as np

# The smallest correlation of neighbours in a volume, and the largest one in scrambled samples.
ALIKE, UNLIKE = 0.6, 0.35
# The number of runs of samples that are compared, and their length.
RUNS, LENGTH = 1024, 64


def warn_of_scrambled_shape(data, order):
    """Warn if samples [z, y, x] differ much from their neighbours along y or z."""
    flat = data.reshape(-1)
    along_x = _likeness(flat, 1)
    if along_x < ALIKE or min(data.shape) < 4:
        return
    if _worst(flat, data.shape) >= UNLIKE:
        return
    better = {shape: _worst(flat, shape) for shape in set(itertools.permutations(data.shape)) - {data.shape}}
    best = max(better, key=better.__getitem__, default=None)
    meaning = f"; did you mean {best}?" if best and better[best] >= ALIKE else ""
    warnings.warn(
        f"shape: expected samples that are similar to their neighbours, got rows or slices that differ in shape "
        f"{tuple(data.shape)} ({order}){meaning}",
        stacklevel=2,
    )


def _worst(flat, shape):
    """The smaller one of the correlations of neighbours along y and z."""
    _, ny, nx = shape
    return min(_likeness(flat, nx), _likeness(flat, nx * ny))


def _likeness(flat, stride):
    """The correlation of samples with those `stride` after them."""
    count = len(flat) - stride - LENGTH
    if count < 1:
        return 1.0
    first = np.unique(np.linspace(0, count - 1, RUNS).astype(np.int64) + np.arange(RUNS) * 37 % 101)
    places = np.minimum(first, count - 1)[:, None] + np.arange(LENGTH)
    here, there = flat[places].astype(float).ravel(), flat[places + stride].astype(float).ravel()
    if not (np.isfinite(here).all() and np.isfinite(there).all()):
        return 1.0
    deviation = here.std() * there.std()
    if not (math.isfinite(deviation) and deviation > 0):
        return 1.0
    return float(((here - here.mean()) * (there - there.mean())).mean() / deviation)
