"""How far hits are from the truth."""

import numpy as np

#: Hits farther apart than this, in voxels, are different ones.
TOLERANCE = 1e-3


def differences(t_hit, t_true, voxels_per_t):
    """Rays that lose their crossing, that have a wrong one or none to have, and quantiles of the distance, in voxels,
    of those hits that both have."""
    hit, exists = np.isfinite(t_hit), np.isfinite(t_true)
    distance = np.abs(np.where(hit & exists, t_hit, 0) - np.where(hit & exists, t_true, 0)) * voxels_per_t
    both = distance[hit & exists]
    return {
        "lost": int((exists & ~hit).sum()),
        "wrong": int((hit & ~exists).sum() + (both > TOLERANCE).sum()),
        "distance_median": float(np.median(both)) if len(both) else None,
        "distance_max": float(both.max()) if len(both) else None,
    }
