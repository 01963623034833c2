"""Points on the pixels of cameras."""

import numpy as np


def project(world_to_ndc, points, size):
    """Pixel coordinates of points."""
    ndc = points @ world_to_ndc[:3, :3].T + world_to_ndc[:3, 3]
    w = points @ world_to_ndc[3, :3] + world_to_ndc[3, 3]
    return ndc[..., :2] / w[..., None] * size


def corners_of(bounds):
    return np.array([[bounds[i][0], bounds[j][1], bounds[k][2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
