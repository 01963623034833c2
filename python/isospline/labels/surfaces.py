"""The surface of one label: its field in a box, as an isosurface with the label's name and colour."""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.mistakes import sentence
from ..io import VolumeData
from ..looks import Material
from ..scene import Isosurface
from .segments import Segment
from .signed_field import box_of, volume_of_label

#: The default standard deviation of the smoothing, in voxels.
SMOOTHING = 1.5
# Its limits: without smoothing there are stairs, and a wide one takes long.
_LEAST, _MOST = 0.5, 4.0
# The margin of a label's box, in standard deviations and in voxels at least.
_MARGIN, _LEAST_MARGIN = 6.0, 6


def check_smoothing(smoothing: Any) -> None:
    """Check the parameter."""
    if isinstance(smoothing, bool) or not isinstance(smoothing, numbers.Real):
        raise TypeError(sentence("smoothing", "a number of voxels", smoothing))
    if not _LEAST <= float(smoothing) <= _MOST:
        raise ValueError(f"smoothing: expected a number of voxels from {_LEAST} to {_MOST}, got {smoothing}")


def deviations_of(spacing: tuple[float, ...], smoothing: float) -> NDArray[np.float64]:
    """Standard deviations in voxels along z, y and x; the same in the world along all axes."""
    return smoothing * math.prod(spacing) ** (1 / 3) / np.array(spacing[::-1])


def surface_of(
    data: VolumeData,
    segment: Segment,
    background: int,
    smoothing: float,
    options: dict[str, Any],
    progress: Callable[[float], object],
) -> Isosurface:
    """The surface of a segment of a map."""
    deviations = deviations_of(data.spacing, smoothing)
    margin = np.maximum(np.ceil(_MARGIN * deviations), _LEAST_MARGIN).astype(int)
    box = box_of(data.data == segment.value, margin)
    first = data.position([each.start for each in reversed(box)])
    frame = {**data.frame, "origin": first}
    volume = volume_of_label(data.data[box], segment.value, background, deviations, frame, progress)
    look: dict[str, Any] = {"name": segment.name, "color": segment.color}
    if isinstance(material := options.get("material"), Material):
        look, options = {}, {**options, "material": material if material.name else material.replace(name=segment.name)}
    return Isosurface(volume, 0.0, **{"closed": True, **look, **options})
