"""The two levels that a surface changes between, and its first ray."""

import numpy as np


def two_levels(subject):
    """The subject's level and one a hundredth of the data's range above it."""
    return subject.level + 0.01 * float(np.ptp(subject.data.astype(np.float64))), subject.level


def shared_ray(surface, scene, levels, camera):
    """A ray (1, 6) of the camera that hits a scene's surface at all levels: the nearest to the middle of the image."""
    side = 64
    rays = camera.rays((side, side)).reshape(-1, 6)
    hit = np.ones(len(rays), bool)
    for level in levels:
        surface.level = level
        hit &= np.isfinite(scene.cast_rays(rays)["t_hit"])
    if not hit.any():
        raise ValueError("subject: expected a ray of the whole view that hits at both levels, got none")
    row, column = np.divmod(np.arange(len(rays)), side)
    return rays[np.where(hit, np.hypot(row - side / 2, column - side / 2), np.inf).argmin()][None]
