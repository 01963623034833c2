"""The samples of a label's smooth surface: positive in the label, with the volume of its voxels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..scene import Isosurface, Volume

# The field counts small boxes as flat, which specks are not: the volume is measured at most so often, until its error
# is below the tolerance.
_MEASURES, _TOLERANCE = 3, 2e-3
# The part of the time until there is a field.
_UNTIL_FIELD = 0.9


def volume_of_label(
    labels: NDArray[np.integer],
    number: int,
    background: int,
    deviations: NDArray[np.float64],
    frame: dict[str, Any],
    progress: Callable[[float], object],
) -> Volume:
    """A volume that is positive in a label and negative in all others, and encloses as much as the voxels do.

    Parameters
    ----------
    labels : (nz, ny, nx) integer array
    number, background : int
        The label, and the one whose volume may change a little.
    deviations : (3,) float64 array
        Standard deviation of the smoothing in voxels along z, y and x.
    frame : dict
        Where the volume is.
    """
    field = _core.LabelField(
        *_in_32_bits(labels, number, background),
        deviations[::-1],
        lambda fraction: progress(_UNTIL_FIELD * fraction),
    )
    count = field.voxel_count
    goal = float(count)
    for _ in range(_MEASURES):
        error = field.enclose(goal)
        volume = Volume(field.samples(), **frame)
        measured = Isosurface(volume, 0.0, closed=True).enclosed_volume(tolerance=_TOLERANCE / 2)
        voxel = volume.spacing.prod() * abs(np.linalg.det(volume.direction))
        missing = count - measured.value / voxel
        if abs(missing) < max(_TOLERANCE * count, measured.error / voxel):
            break
        goal = goal * (1 + error) + missing  # partial volumes of specks are too large
    progress(1.0)
    return volume


def _in_32_bits(labels: NDArray[np.integer], number: int, background: int) -> tuple[NDArray[np.int32], int, int]:
    """A map, a label and the background as they are, or as ranks if one of them does not fit."""
    limits = np.iinfo(np.int32)
    given = (number, background, int(labels.min()), int(labels.max()))
    if min(given) >= limits.min and max(given) <= limits.max:
        return np.ascontiguousarray(labels, np.int32), number, background
    values, ranks = np.unique(labels, return_inverse=True)
    rank_of = {value: rank for rank, value in enumerate(values.tolist())}
    in_order = np.ascontiguousarray(ranks.reshape(labels.shape), np.int32)
    return in_order, rank_of[number], rank_of.get(background, -1)


def box_of(mask: NDArray[np.bool_], margin: NDArray[np.integer] | int = 0) -> tuple[slice, slice, slice]:
    """The smallest box of the true samples, with a margin."""
    margins = np.broadcast_to(margin, 3)
    ranges = []
    for axis in range(3):
        others = tuple(each for each in range(3) if each != axis)
        places = np.flatnonzero(mask.any(axis=others))
        ranges.append(slice(max(places[0] - margins[axis], 0), int(places[-1]) + 1 + int(margins[axis])))
    return ranges[0], ranges[1], ranges[2]
