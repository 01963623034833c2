"""Measures of a label and its surface."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..io import VolumeData
from ..scene import Isosurface
from .segments import Segment
from .signed_field import box_of


def measure(segment: Segment, surface: Isosurface, mask: NDArray[np.bool_], data: VolumeData) -> dict[str, Any]:
    """The row of a table: volume and area of the surface, number of voxels, and centroid of the voxels."""
    box = box_of(mask)
    volume, area = surface.enclosed_volume(), surface.area()
    places = np.stack(np.nonzero(mask[box]), axis=-1)
    center = places.mean(axis=0) + [each.start for each in box]
    return {
        "numbers": segment.number,
        "names": segment.name,
        "voxel_counts": len(places),
        "enclosed_volumes": volume.value,
        "volume_errors": volume.error,
        "areas": area.value,
        "area_errors": area.error,
        "centroids": data.position(center[::-1]),
    }
