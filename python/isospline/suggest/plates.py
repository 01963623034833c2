"""Plates and holders on which an object lies: thin and flat, at the border of the volume, and unlike the object."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .grid import Grid, pieces
from .posture import Side

#: The largest thickness of a plate, as a part of its shorter side, and the least part of its rectangle that it fills.
_THIN, _FULL = 0.2, 0.7
#: The outer layers of a plate differ by this factor at most; behind it, no layer has more than this part of them.
_EVEN, _NARROWER = 0.8, 0.6
#: The least size of what lies on a plate, as a part of the plate, and of its largest piece, as a part of all of it.
_OBJECT, _WHOLE = 0.03, 0.3
#: How far a plate may be from the end of the volume, as a part of its length.
_NEAR = 0.3
#: The least spread of the points of a plate, as a part of the next larger one.
_FLAT = 0.1


class Plate(NamedTuple):
    """A plate at one side of a grid.

    Attributes
    ----------
    side : Side
    layers : int
        The number of layers from that side to the end of the plate.
    is_left_out : bool
        Whether it does not belong to the object: it is a piece of its own at the border of the volume, or the border
        cuts it at two sides at least.
    """

    side: Side
    layers: int
    is_left_out: bool


def find_plate(grid: Grid) -> Plate | None:
    """The plate at an end of a solid, on which a smaller object lies; None if there is no single one.

    The rule does not apply to plates alone, to those with as much on the other side, and to layers of about equal size.
    """
    found = [_plate_at(grid, Side(axis, end)) for axis in range(3) for end in (0, 1)]
    plates = [plate for plate in found if plate is not None]
    return plates[0] if len(plates) == 1 else None


def _plate_at(grid: Grid, side: Side) -> Plate | None:
    layers = np.moveaxis(grid.inside, side.axis, 0)[:: -1 if side.end else 1]
    sections = np.count_nonzero(layers, axis=(1, 2))
    is_plate = sections >= _EVEN * sections.max()
    begin = int(is_plate.argmax())
    end = int(np.flatnonzero(is_plate)[-1]) + 1  # a hollow plate has two layers with less between them
    # Partly filled layers on both sides belong to the plate.
    first = begin - 1 if begin and sections[begin - 1] > _NARROWER * sections[begin] else begin
    last = end + 1 if end < len(sections) and sections[end] > _NARROWER * sections[begin] else end
    behind = sections[last:]
    size = sections[begin:end].sum()
    if begin > _NEAR * len(sections) or not len(behind) or behind.max() > _NARROWER * sections[begin]:
        return None
    if behind.sum() < _OBJECT * size or sections[:first].sum() > 0.5 * behind.sum():
        return None
    if pieces(layers[last:])[1][0] < _WHOLE * behind.sum():
        return None
    outline = np.any(layers[begin:end], axis=0)
    rows, columns = (np.flatnonzero(outline.any(axis=each)) for each in (1, 0))
    across = np.delete(grid.spacing, side.axis)
    extent = np.array([np.ptp(rows) + 1, np.ptp(columns) + 1])
    if (last - first) * grid.spacing[side.axis] > _THIN * (extent * across).min():
        return None
    if np.count_nonzero(outline) < _FULL * extent.prod():
        return None
    at_border = [rows[0] == 0, rows[-1] == len(outline) - 1, columns[0] == 0, columns[-1] == outline.shape[1] - 1]
    is_apart = not (layers[last - 1] & layers[last]).any()
    return Plate(side, last, sum(map(int, at_border)) >= (1 if is_apart else 2))


def is_only_plate(grid: Grid) -> bool:
    """Whether a solid is a plate at the border of the volume, and specks."""
    numbers, sizes = pieces(grid.inside)
    if not len(sizes) or sizes[0] < (1 - _OBJECT) * sizes.sum():
        return False
    places = np.argwhere(numbers == 0)
    if len(places) < 3:  # no plane
        return False
    if not ((places.min(axis=0) == 0) | (places.max(axis=0) == np.array(numbers.shape) - 1)).any():
        return False
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov((places * grid.spacing).T)), 0))
    return bool(spread[0] < _FLAT * spread[1])
