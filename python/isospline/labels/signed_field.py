"""The samples of a label's smooth surface: positive in the label, with the volume of its voxels."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from ..scene import Isosurface, Volume
from . import separable
from .partial_volumes import partial_volumes

#: The least magnitude of a sample: voxel centres keep their side.
LEAST_SAMPLE = np.float32(0.005)
#: The largest magnitude of a sample.
MOST_SAMPLE = np.float32(1)
# Rounds of smoothing, each followed by a correction of volume; corrections without smoothing after them.
_ROUNDS, _CORRECTIONS = 4, 3
# Low-pass filters in a round.
_FILTERS = 3
# Standard deviation in which volume is preserved, relative to that of smoothing.
_VOLUME_SCALE = 2.0
# The largest correction of a sample.
_LARGEST_STEP = 0.5
# Divisions of a voxel in corrections, and for the volume at the end: as many as this number of boxes allows.
_DIVISIONS, _MOST_DIVISIONS, _BOXES = 2, 12, 2e7
# Goal of the last correction, relative to the volume, and the number of its steps. From a large error on, surfaces
# between two labels are moved, too.
_TOLERANCE, _STEPS, _LARGE_ERROR = 5e-4, 8, 3e-3
# Partial volumes count boxes as flat, which specks are not: the volume is measured at most so often, until its error is
# below the tolerance.
_MEASURES, _MEASURED_TOLERANCE = 3, 2e-3
# The least derivative of a volume, and the margin of a label's box in standard deviations of the smoothing.
_LEAST_SLOPE, _MARGIN = 1e-3, 6.0


def signed_field(
    labels: NDArray[np.integer],
    number: int,
    background: int,
    deviations: NDArray[np.float64],
    progress: Callable[[float], object] = lambda fraction: None,
) -> NDArray[np.float32]:
    """Samples of a function that is positive in a label and negative in all others.

    Each label near this one, and the background, has a field of its own. Half the difference between this label's field
    and the largest of the others is its field where three labels meet: at each place, one label has a positive one.
    Where only two labels are near, their own fields differ in sign only, so this changes nothing.

    Parameters
    ----------
    labels : (nz, ny, nx) integer array
    number, background : int
        The label, and the one whose volume may change a little.
    deviations : (3,) float64 array
        Standard deviation of the smoothing in voxels along z, y and x.
    """
    is_label = labels == number
    near = (
        separable.apply(separable.gaussian(labels.shape, _VOLUME_SCALE * deviations), is_label.astype(np.float32)) > 0
    )
    others = np.unique(labels[near & ~is_label])
    parts = 2 + (len(others) if len(others) > 1 else 0)

    def report(done):
        return lambda fraction: progress((done + fraction) / parts)

    field, is_crossed = _own_field(labels, number, deviations, report(0))
    if len(others) > 1:
        largest = np.full_like(field, -MOST_SAMPLE)
        margin = np.ceil(_MARGIN * deviations).astype(int)
        for place, other in enumerate(others):
            box = box_of(near & (labels == other), margin)
            rival, _ = _own_field(labels[box], other, deviations, report(1 + place))
            np.maximum(largest[box], rival, out=largest[box])
        field = np.where(near, 0.5 * (field - largest), -MOST_SAMPLE)
    field = _with_exact_volume(field, labels, is_label, background, deviations, is_crossed)
    progress(1.0)
    return field


def _own_field(labels, number, deviations, progress):
    """The field of one label against all others together, and about how many voxels its surface crosses."""
    is_label = labels == number
    sign = np.where(is_label, np.float32(1), np.float32(-1))
    smooth = separable.low_pass(labels.shape, deviations)
    spread = separable.gaussian(labels.shape, _VOLUME_SCALE * deviations)
    to_coefficients = separable.quadratic_interpolation(labels.shape)
    field = _kept(_contrast(labels, is_label, deviations), sign)
    for step in range(_ROUNDS + _CORRECTIONS):
        if step < _ROUNDS:
            for _ in range(_FILTERS):
                field = _kept(separable.apply(smooth, field), sign)
        # Newton's method for the volume near each voxel.
        found = partial_volumes(separable.apply(to_coefficients, field), _DIVISIONS)
        missing = separable.apply(spread, is_label - found.dense())
        slope = separable.apply(spread, found.dense_derivatives())
        missing /= np.maximum(slope, _LEAST_SLOPE)
        field = _kept(field + np.clip(missing, -_LARGEST_STEP, _LARGEST_STEP), sign)
        progress((step + 1) / (_ROUNDS + _CORRECTIONS))
    return field, len(found.voxels)


def _kept(field, sign):
    """The samples with magnitudes within limits, on the side of their voxels."""
    return sign * np.clip(field * sign, LEAST_SAMPLE, MOST_SAMPLE)


def _contrast(labels, is_label, deviations):
    """The smoothed indicator of a label, less the largest one among those of the other labels."""
    blur = separable.gaussian(labels.shape, deviations)
    own = separable.apply(blur, is_label.astype(np.float32))
    near = own > 0
    largest = np.zeros_like(own)
    margin = np.ceil(_MARGIN * deviations).astype(int)
    others = np.unique(labels[near & ~is_label])
    if len(others) == 1:
        return own - (1 - own)
    for other in others:
        box = box_of(near & (labels == other), margin)
        indicator = (labels[box] == other).astype(np.float32)
        smoothed = separable.apply(separable.gaussian(indicator.shape, deviations), indicator)
        np.maximum(largest[box], smoothed, out=largest[box])
    return np.where(near, own - largest, -MOST_SAMPLE)


def box_of(mask: NDArray[np.bool_], margin: NDArray[np.integer] | int = 0) -> tuple[slice, slice, slice]:
    """The smallest box of the true samples, with a margin."""
    margins = np.broadcast_to(margin, 3)
    ranges = []
    for axis in range(3):
        others = tuple(each for each in range(3) if each != axis)
        places = np.flatnonzero(mask.any(axis=others))
        ranges.append(slice(max(places[0] - margins[axis], 0), int(places[-1]) + 1 + int(margins[axis])))
    return ranges[0], ranges[1], ranges[2]


def _with_exact_volume(field, labels, is_label, background, deviations, crossed):
    """The field, moved by a small constant where the label meets the background, or everywhere if it does not."""
    sign = np.where(is_label, np.float32(1), np.float32(-1))
    to_coefficients = separable.quadratic_interpolation(labels.shape)
    divisions = int(np.clip((_BOXES / max(crossed, 1)) ** (1 / 3), 2 * _DIVISIONS, _MOST_DIVISIONS))

    def volumes(field):
        return partial_volumes(separable.apply(to_coefficients, field), divisions)

    count = np.count_nonzero(is_label)
    goal = float(count)
    for _ in range(_MEASURES):
        error = np.inf
        for weight, tolerance in _free_sides(labels, is_label, background, deviations):
            if not abs(error) < tolerance:
                field, error = _moved(field, weight, goal, sign, volumes)
        measured = Isosurface(Volume(field), 0.0, closed=True).enclosed_volume(tolerance=_MEASURED_TOLERANCE / 2)
        missing = count - measured.value
        if abs(missing) < max(_MEASURED_TOLERANCE * count, measured.error):
            break
        goal = goal * (1 + error) + missing  # partial volumes of specks are too large
    return field


def _free_sides(labels, is_label, background, deviations) -> Iterator[tuple[NDArray[np.float32] | float, float]]:
    """Where a label's surface may be moved, and the error from which on it is moved there."""
    spread = separable.gaussian(labels.shape, _VOLUME_SCALE * deviations)
    beside = separable.apply(spread, (labels == background).astype(np.float32))
    beside /= np.maximum(separable.apply(spread, (~is_label).astype(np.float32)), 1e-6)
    if beside.max() > 0.5:
        yield beside, _TOLERANCE
    yield 1.0, _LARGE_ERROR


def _moved(field, weight, goal, sign, volumes):
    """Add a multiple of a weight to the field, by the secant method, so that its volume reaches a goal."""
    offset, step, best = 0.0, 0.0, (field, np.inf)
    last = None
    for _ in range(_STEPS):
        moved = _kept(field + offset * weight, sign) if offset else field
        found = volumes(moved)
        error = found.volume / goal - 1
        if abs(error) < abs(best[1]):
            best = moved, error
        if abs(error) < _TOLERANCE:
            break
        if last is None:
            slope = float((found.dense_derivatives() * weight).sum(dtype=float)) / goal
        else:
            slope = (error - last) / step
        if not slope > 0:
            break
        last, step = error, float(np.clip(-error / slope, -0.2, 0.2))
        offset += step
    return best
