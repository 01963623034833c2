"""Named views: for cameras, for lights, and for the viewer.

There is one rule, with or without a patient: objects face -y, z is upwards, and left is their own left, +x. This is how
a patient is placed in the coordinates of DICOM and ITK (LPS), which `read_volume` uses.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .parameters import unit_vector

Vector = NDArray[np.float64]
View = str | ArrayLike

#: The vector from the object to the eye, and the upward direction in the image.
VIEWS: dict[str, tuple[tuple[float, float, float], tuple[int, int, int]]] = {
    "front": ((0, -1, 0), (0, 0, 1)),
    "back": ((0, 1, 0), (0, 0, 1)),
    "left": ((1, 0, 0), (0, 0, 1)),
    "right": ((-1, 0, 0), (0, 0, 1)),
    "top": ((0, 0, 1), (0, 1, 0)),
    "bottom": ((0, 0, -1), (0, -1, 0)),
    "iso": ((1, -1, 1), (0, 0, 1)),
    "three-quarter": ((-0.45, -1, 0.3), (0, 0, 1)),
    "anterior": ((0, -1, 0), (0, 0, 1)),
    "posterior": ((0, 1, 0), (0, 0, 1)),
    "superior": ((0, 0, 1), (0, -1, 0)),
    "inferior": ((0, 0, -1), (0, -1, 0)),
    "+x": ((1, 0, 0), (0, 0, 1)),
    "-x": ((-1, 0, 0), (0, 0, 1)),
    "+y": ((0, 1, 0), (0, 0, 1)),
    "-y": ((0, -1, 0), (0, 0, 1)),
    "+z": ((0, 0, 1), (0, 1, 0)),
    "-z": ((0, 0, -1), (0, -1, 0)),
}

#: Width and height of pictures by default.
SIZE = (640, 480)
#: The view of pictures by default: that of `suggest_view` for a scene of one volume, otherwise "three-quarter".
DEFAULT_VIEW = "suggested"


def direction_of(view: View) -> tuple[Vector, tuple[int, int, int]]:
    """The unit vector towards the eye, and the upward direction in the image."""
    if isinstance(view, str):
        if view not in VIEWS and view != DEFAULT_VIEW:
            raise ValueError(f"view: expected one of {DEFAULT_VIEW}, {', '.join(VIEWS)}, or a vector, got {view!r}")
        towards, up = VIEWS["three-quarter" if view == DEFAULT_VIEW else view]
        direction = unit_vector(towards, "view")
    else:
        direction, up = unit_vector(view, "view"), (0, 0, 1)
    if abs(direction @ np.asarray(up)) > 1 - 1e-6:
        up = VIEWS["+z" if direction[2] > 0 else "-z"][1]
    return direction, up


def light_from(side: str) -> tuple[float, float, float]:
    """The direction in which light from a side travels."""
    if side not in VIEWS:
        raise ValueError(f"direction: expected one of {', '.join(VIEWS)}, or a vector, got {side!r}")
    x, y, z = VIEWS[side][0]
    return -x, -y, -z
