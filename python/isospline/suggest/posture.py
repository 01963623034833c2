"""How a solid stands: which axis of its grid is upwards, and which side is the front.

Each rule states when it does not apply; without a rule, nothing is said about the solid.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .grid import Grid, relief, symmetry

#: A flat end has this part of the widest section; a neck has this. The first layer of both is this part of the second,
#: which has this many points.
_FLAT, _NECK_FLAT, _SHARP, _POINTS = 0.35, 0.15, 0.75, 150
#: The same part for an end on which a solid stands.
_FOOT = 0.6
#: A head fills this part of its box. It has a mirror image with this much in common, and this much more than from front
#: to back.
_COMPACT, _MIRRORED, _MORE = 0.3, 0.8, 0.01
#: The relief of a face and of a back of a head, as parts of their size; how much more the face has than the back; and
#: how different the left and the right side may be.
_FACE, _BACK, _ROUGHER, _EVEN = (0.012, 0.06), 0.02, 1.4, 1.3
#: The neck is narrower than the head by this factor, and lies within this part of the length from the lower end.
_NECK, _LOW = 0.8, 0.4
#: How far the middle of the bones of a trunk is behind the middle of the body, as a part of its depth.
_SPINE = 0.1


class Side(NamedTuple):
    """One end of an axis of a grid: 0 where its index begins, 1 where it ends."""

    axis: int
    end: int

    @property
    def opposite(self) -> Side:
        return Side(self.axis, 1 - self.end)


class Posture(NamedTuple):
    """The upper side of a solid, its front if it has one, why, and whether it is a head."""

    up: Side
    front: Side | None
    reason: str
    is_head: bool = False


def head_posture(grid: Grid) -> Posture | None:
    """A head is cut at the neck, its left is like its right, and its face has more relief than its back.

    The rule does not apply to solids without a flat end, with thin parts, or with sides of about the same relief.
    """
    if grid.filling() < _COMPACT:
        return None
    cuts = [[end for end in (0, 1) if is_flat(grid, Side(axis, end), _NECK_FLAT)] for axis in range(3)]
    if not any(cuts):
        return None
    common = [symmetry(grid, axis) for axis in range(3)]
    reliefs = np.array([[relief(grid, axis, end) for end in (0, 1)] for axis in range(3)])
    ratios = reliefs.max(axis=1) / np.maximum(reliefs.min(axis=1), 1e-12)
    for upright, facing, across in sorted(itertools.permutations(range(3)), key=lambda axes: -ratios[axes[1]]):
        is_even = common[across] >= max(_MIRRORED, common[facing] + _MORE) and ratios[across] <= _EVEN
        has_face = _FACE[0] <= reliefs[facing].max() <= _FACE[1] and reliefs[facing].min() <= _BACK
        if not (cuts[upright] and is_even and has_face and ratios[facing] >= _ROUGHER):
            continue
        lower = cuts[upright][0] if len(cuts[upright]) == 1 else _neck_end(grid.sections(upright))
        if lower is not None:
            front = Side(facing, int(reliefs[facing].argmax()))
            return Posture(Side(upright, 1 - lower), front, "it looks like a head, cut at the neck", is_head=True)
    return None


def standing_posture(grid: Grid) -> Posture | None:
    """A solid stands on its only flat end, if that is nearly as wide as its widest section.

    The rule does not apply to solids that have two flat ends or none, or that the border of the volume cuts there.
    """
    sides = [Side(axis, end) for axis in range(3) for end in (0, 1)]
    flat = [side for side in sides if is_flat(grid, side, _FLAT)]
    if len(flat) != 1 or not is_flat(grid, flat[0], _FOOT) or meets_border(grid, flat[0]):
        return None
    return Posture(flat[0].opposite, None, "it stands on its only flat end")


def is_flat(grid: Grid, side: Side, part: float) -> bool:
    """Whether a solid ends in a plane across an axis."""
    sections = grid.sections(side.axis)[:: -1 if side.end else 1]
    begin = np.flatnonzero(sections)[0]
    first, second = sections[begin], sections[begin + 1 :][:1].sum()
    return bool(second >= max(part * sections.max(), _POINTS) and first >= _SHARP * second)


def meets_border(grid: Grid, side: Side) -> bool:
    """Whether a solid reaches one of the last two layers at an end."""
    layers = np.moveaxis(grid.inside, side.axis, 0)
    return bool((layers[-2:] if side.end else layers[:2]).any())


def _neck_end(sections: NDArray[np.int64]) -> int | None:
    """The end of a head that is cut at both ends near which it is narrowest, or None if that is not clear."""
    inner = sections[np.flatnonzero(sections)[0] : np.flatnonzero(sections)[-1] + 1]
    narrowest = int(inner.argmin())
    place = narrowest / max(1, len(inner) - 1)
    if inner[narrowest] > _NECK * inner.max() or _LOW < place < 1 - _LOW:
        return None
    return int(place > 0.5)


def trunk_posture(grid: Grid, bones: NDArray[np.bool_]) -> Posture | None:
    """A trunk, lying along the first axis, has its spine at the back; by convention the last layers are at the head.

    The rule does not apply unless the solid is cut at both ends of that axis, is wider than deep, and has its bones
    clearly nearer to one side.
    """
    inside = grid.inside
    if not all(is_flat(grid, Side(0, end), _FLAT) for end in (0, 1)):
        return None
    columns = np.flatnonzero(grid.sections(2))
    third = np.ptp(columns) // 3
    rows = np.arange(inside.shape[1])
    middle = np.s_[:, :, columns[0] + third : columns[-1] - third + 1]  # without arms, and with the spine
    body, bone = inside[middle].sum(axis=(0, 2)), (inside & bones)[middle].sum(axis=(0, 2))
    depth, width = np.ptp(np.flatnonzero(body)) * grid.spacing[1], np.ptp(columns) * grid.spacing[2]
    if not bone.any() or width < depth:
        return None
    offset = (np.average(rows, weights=bone) - np.average(rows, weights=body)) * grid.spacing[1] / depth
    if abs(offset) < _SPINE:
        return None
    return Posture(Side(0, 1), Side(1, int(offset < 0)), "it looks like a trunk, whose spine is at its back")
