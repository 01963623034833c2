"""Values of a volume's model on the three grid planes through a point."""

from __future__ import annotations

import numpy as np

from ..levels import index_shape

#: Points along the longer side of a slice, at rest and during movement.
FINE, COARSE = 320, 112


def sample_slices(volume, index, points=FINE):
    """Sample the grid planes x, y and z = const through a point.

    Parameters
    ----------
    volume : Volume
    index : (3,) float
        The point, in grid coordinates.
    points : int
        The number of points along the longer side of each slice; at most two per sample are used.

    Returns
    -------
    list of three (rows, columns) float32 arrays
        The planes x, y and z = const. Columns run along the first and rows along the second of the other two axes.
        The first and the last ones are on the border of the volume.
    """
    counts = np.array(index_shape(volume))
    place = np.clip(index, 0, counts - 1)
    affine = volume.affine
    slices = []
    for axis in range(3):
        across, along = [other for other in range(3) if other != axis]
        longest = max(counts[across], counts[along]) - 1 or 1
        step = max(longest / (points - 1), 0.5)
        columns, rows = (
            np.linspace(0, counts[each] - 1, round((counts[each] - 1) / step) + 1) for each in (across, along)
        )
        grid = np.empty((len(rows), len(columns), 3))
        grid[..., axis] = place[axis]
        grid[..., across], grid[..., along] = columns, rows[:, None]
        world = grid.reshape(-1, 3) @ affine[:3, :3].T + affine[:3, 3]
        slices.append(volume.sample(world).astype(np.float32).reshape(grid.shape[:2]))
    return slices
