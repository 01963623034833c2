"""Views from the front, with the top above: of a volume whose directions are not known, or contradict what is in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .grid import Grid
from .posture import Posture, Side

#: The default view, as multiples of the object's left, its front and upwards.
_THREE_QUARTER = (-0.45, 1.0, 0.3)
#: Outlines that are as large as the largest one to this part are equally good to look at.
_AS_LARGE = 0.9

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class SuggestedView:
    """A view of a volume, as `suggest_view` returns it.

    Attributes
    ----------
    view : (3,) tuple of float
        The vector from the volume to the eye, in the world.
    up : (3,) tuple of float
        The upward direction in the image, and away from the ground.
    reason : str
        What was recognised; empty if nothing was: the view is then "three-quarter".
    """

    view: Vector = (-0.45, -1.0, 0.3)
    up: Vector = (0.0, 0.0, 1.0)
    reason: str = ""


def view_of(posture: Posture | None, grid: Grid, direction: NDArray[np.float64]) -> SuggestedView:
    """The view of a solid in a posture; `direction` has the directions of the axes x, y and z in the world."""
    if posture is None:
        return SuggestedView()
    up = _vector(posture.up, direction)
    front = _vector(
        _widest_side(posture.up.axis, grid, direction) if posture.front is None else posture.front, direction
    )
    left = np.cross(up, front)
    towards = np.array(_THREE_QUARTER) @ [left, front, up]
    if np.allclose(towards, SuggestedView.view) and np.allclose(up, SuggestedView.up):
        return SuggestedView()
    return SuggestedView(as_tuple(towards), as_tuple(up), posture.reason)


def _widest_side(upright: int, grid: Grid, direction: NDArray[np.float64]) -> Side:
    """The side of a solid without a front that shows most of it; of equal ones the one nearest to -y."""
    axes = [axis for axis in range(3) if axis != upright]
    sizes = {axis: np.count_nonzero(grid.inside.any(axis=axis)) * grid.spacing[axes[axes[0] == axis]] for axis in axes}
    wide = [Side(axis, end) for axis in axes for end in (0, 1) if sizes[axis] >= _AS_LARGE * max(sizes.values())]
    return min(wide, key=lambda side: _vector(side, direction) @ (1e-3, 1, 1e-3))


def _vector(side: Side, direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """The outward direction of a side in the world; axes of arrays are z, y, x."""
    along = direction[:, 2 - side.axis]
    return along / np.linalg.norm(along) * (1.0 if side.end else -1.0)


def as_tuple(vector: NDArray[np.float64]) -> Vector:
    x, y, z = (float(value) + 0.0 for value in np.round(vector, 12))
    return x, y, z
