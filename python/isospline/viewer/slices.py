"""Values of a volume's model on the three grid planes through a point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..scene.cells import index_shape
from ..store.detail import Scales
from .checked import Checked, count, field, vector

#: Points along the longer side of a slice by default, and the most of them.
POINTS, MOST_POINTS = 320, 2048
#: The smallest distance of points, in samples.
FINEST = 0.125
#: The share of the points that is drawn during movement.
COARSE = 0.35


@dataclass(frozen=True)
class SliceView(Checked):
    """The part of a slice that is seen.

    Attributes
    ----------
    lower, upper : (2,) tuple of float
        Its corners, in grid coordinates along the slice's two axes.
    points : int
        Points along its longer side, at equal distances in space.
    """

    lower: tuple[float, ...] = field(vector(2))
    upper: tuple[float, ...] = field(vector(2))
    points: int = field(count, POINTS)

    def __post_init__(self):
        super().__post_init__()
        if self.points > MOST_POINTS:
            raise ValueError(f"points: expected at most {MOST_POINTS}, got {self.points}")
        if not all(least <= most for least, most in zip(self.lower, self.upper)):
            raise ValueError(f"upper: expected at least {list(self.lower)}, got {list(self.upper)}")


def value_at(volume, index):
    """The value of a Volume, or of the finest of Scales, at a point in grid coordinates."""
    affine = volume.affine
    finest = volume.volume(0) if isinstance(volume, Scales) else volume
    return float(finest.sample(affine[:3, :3] @ index + affine[:3, 3]))


def sample_slices(volume, index, views=None, share=1.0, *, progress=None):
    """Sample the grid planes x, y and z = const through a point.

    Parameters
    ----------
    volume : Volume or Scales
        Of a store, each slice shows the overview or the finer scale that has a sample for each of its points. Grid
        coordinates are those of the finest scale.
    index : (3,) float
        The point, in grid coordinates.
    views : three SliceView, optional
        The parts that are seen; by default, all of the slices. Points are at most as close as `FINEST`.
    share : float
        The share of the points that is used.
    progress : callable, optional
        As that of `Volume.sample`, for each slice.

    Returns
    -------
    list of three ((2,) lower, (2,) upper, (rows, columns) float32 array)
        The planes x, y and z = const. Columns run along the first and rows along the second of the other two axes,
        from `lower` to `upper`, in grid coordinates within the volume.
    """
    last = np.array(index_shape(volume)) - 1
    place = np.clip(index, 0, last)
    affine = volume.affine
    lengths = np.linalg.norm(affine[:3, :3], axis=0)  # of a step along each axis of the grid
    slices = []
    for axis in range(3):
        plane = [other for other in range(3) if other != axis]
        view = SliceView((0, 0), last[plane].tolist()) if views is None else views[axis]
        lower, upper = (np.clip(corner, 0, last[plane]) for corner in (view.lower, view.upper))
        extent = (upper - lower) * lengths[plane]
        steps = np.maximum(extent.max() / max(share * view.points - 1, 1) / lengths[plane], FINEST)
        columns, rows = (np.linspace(a, b, round((b - a) / step) + 1) for a, b, step in zip(lower, upper, steps))
        grid = np.empty((len(rows), len(columns), 3))
        grid[..., axis] = place[axis]
        grid[..., plane[0]], grid[..., plane[1]] = columns, rows[:, None]
        world = grid.reshape(-1, 3) @ affine[:3, :3].T + affine[:3, 3]
        shown = volume
        if isinstance(volume, Scales):
            shown = volume.volume(volume.choose_for_points(steps * lengths[plane], plane))
        values = shown.sample(world, progress=progress)
        slices.append((lower, upper, values.astype(np.float32).reshape(grid.shape[:2])))
    return slices


def with_slices(state, source):
    """A state with slices of a volume, unless it has slices of another one; of a mesh, the same state."""
    if not source.is_volume or state.slices.volume is not None:
        return state
    slices = state.slices.replace(volume=source.key, index=source.middle, window=source.window())
    return state.replace(slices=slices)
