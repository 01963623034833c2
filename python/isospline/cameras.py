"""Cameras that have all of a scene in view, from one side or from all around."""

from __future__ import annotations

import math
from typing import Any, Literal, Protocol, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .mistakes import sentence
from .parameters import check_count
from .signatures import explained


class HasBounds(Protocol):
    """What has a box: scenes, isosurfaces, meshes and volumes, and the data sets of other libraries."""

    @property
    def bounds(self) -> Any: ...


Bounded = Union[HasBounds, ArrayLike]
View = Union[str, ArrayLike]
Projection = Literal["perspective", "orthographic"]
Vector = NDArray[np.float64]

#: The names of views: the vector from what is seen towards the eye, and the one that is upwards in the image.
VIEWS: dict[str, tuple[tuple[int, int, int], tuple[int, int, int]]] = {
    "+x": ((1, 0, 0), (0, 0, 1)),
    "-x": ((-1, 0, 0), (0, 0, 1)),
    "+y": ((0, 1, 0), (0, 0, 1)),
    "-y": ((0, -1, 0), (0, 0, 1)),
    "+z": ((0, 0, 1), (0, 1, 0)),
    "-z": ((0, 0, -1), (0, -1, 0)),
    "iso": ((1, -1, 1), (0, 0, 1)),
}
_SIDES = {"front": "-y", "back": "+y", "left": "-x", "right": "+x", "top": "+z", "bottom": "-z"}
VIEWS.update({name: VIEWS[axis] for name, axis in _SIDES.items()})


@explained
def camera_for(
    scene: Bounded, *, view: View = "iso", up: ArrayLike | None = None, projection: Projection = "perspective",
    field_of_view: float = 30.0, size: tuple[int, int] = (640, 360), margin: float = 0.05,
) -> _core.PerspectiveCamera | _core.OrthographicCamera:  # fmt: skip
    """Make a camera that has all of a scene, or of a box, in view and in the middle of the image.

    Parameters
    ----------
    scene : Scene, Isosurface, Mesh, or anything else that has bounds, or (2, 3) float
        What to look at; bounds are the lower and the upper corner of a box, world units.
    view : str or (3,) float
        The side that the eye is on: a vector from the box towards the eye, or a name. ``"+x"``, ``"-x"``, ``"+y"``,
        ``"-y"``, ``"+z"`` and ``"-z"`` are the axes of the world; ``"right"``, ``"left"``, ``"back"``, ``"front"``,
        ``"top"`` and ``"bottom"`` are the same in this order; ``"iso"`` is from the front, the right and above. z is
        upwards, except that y is so from the top and -y from the bottom, which keeps x to the right in all of
        front, top and bottom.

        The names tell of axes, not of anatomy. In patient coordinates of DICOM and ITK (LPS), the front is the
        patient's face, the left of the world the patient's right, and the bottom shows axial slices as
        radiologists do; in those of NIfTI (RAS), x and y point the other way, and ``"+y"`` shows the face.
    up : (3,) float, optional
        What is upwards in the image, where it is not to be the view's own.
    projection : {"perspective", "orthographic"}
        The kind of camera.
    field_of_view : float
        Of a perspective camera, vertical, in degrees.
    size : (int, int)
        Width and height of the image that the camera is for; only their ratio counts.
    margin : float
        Part of the image to leave free, at least 0 and below 1.

    Returns
    -------
    PerspectiveCamera or OrthographicCamera

    Raises
    ------
    ValueError
        For an unknown view or projection, an empty box, and whatever the cameras refuse.

    Examples
    --------
    >>> import isospline
    >>> isospline.camera_for([(-1, -1, -1), (1, 1, 1)], view="top", projection="orthographic", margin=0, size=(9, 9))
    OrthographicCamera(eye=(0, 0, 4.73205), target=(0, 0, 0), up=(0, 1, 0), height=2)
    """
    lower, upper = _bounds(scene)
    direction, natural_up = _direction(view)
    up = np.asarray(natural_up if up is None else up, dtype=float)
    if projection not in ("perspective", "orthographic"):
        raise ValueError(f"projection: expected 'perspective' or 'orthographic', got {projection!r}")
    if not 0 <= margin < 1:
        raise ValueError(f"margin: expected a part of the image, at least 0 and below 1, got {margin!r}")
    width, height = size
    if not (width > 0 and height > 0):
        raise ValueError(f"size: expected a width and a height above 0, got {size!r}")
    center = (lower + upper) / 2
    radius = np.linalg.norm(upper - lower) / 2 or 1.0

    # Any camera on this side has the image's axes, and checks what was given.
    trial = _core.PerspectiveCamera(direction, (0, 0, 0), up, field_of_view)
    right, upwards, forward = trial.world_to_camera[:3, :3]
    corners = np.stack(np.meshgrid(*zip(lower - center, upper - center), indexing="ij"), axis=-1).reshape(-1, 3)
    x, y, z = np.abs(corners @ right), np.abs(corners @ upwards), corners @ forward

    # Each corner is inside the margin: |y| <= half_height and |x| <= half_width, times its depth in a perspective.
    if projection == "orthographic":
        half_height = max(y.max(), x.max() * height / width, radius * 1e-6) / (1 - margin)
        eye = center + direction * (radius * (1 + math.sqrt(3)))
        return _core.OrthographicCamera(eye, center, up, height=2 * half_height)
    half_height = math.tan(math.radians(field_of_view) / 2) * (1 - margin)
    half_width = half_height * width / height
    distance = max((y / half_height - z).max(), (x / half_width - z).max(), radius * 1e-3 - z.min())
    return _core.PerspectiveCamera(center + direction * distance, center, up, field_of_view)


@explained
def turntable(
    scene: Bounded, count: int, *, view: View = "iso", up: ArrayLike | None = None,
    projection: Projection = "perspective", field_of_view: float = 30.0, size: tuple[int, int] = (640, 360),
    margin: float = 0.05,
) -> list[_core.PerspectiveCamera | _core.OrthographicCamera]:  # fmt: skip
    """Make the cameras of one turn around a scene, or a box, at a constant distance.

    The eye goes counter-clockwise as seen from above, so that the scene seems to turn clockwise. The first camera looks
    from `view`, and one more would be the first again.

    Parameters
    ----------
    scene : Scene, Isosurface, Mesh, or anything else that has bounds, or (2, 3) float
        What to look at.
    count : int
        Cameras of the whole turn, at least 1.
    view, up, projection, field_of_view, size, margin
        As for `camera_for`; the eye turns about `up`. All of the scene is in view from every side.

    Returns
    -------
    list of PerspectiveCamera or OrthographicCamera

    Raises
    ------
    ValueError
        For a count below 1, and as `camera_for` does.

    Examples
    --------
    >>> import isospline
    >>> cameras = isospline.turntable([(-1, -1, -1), (1, 1, 1)], 4, view="front")
    >>> [camera.eye.round(1).tolist() for camera in cameras[:2]]
    [[0.0, -4.9, 0.0], [4.9, -0.0, 0.0]]
    """
    check_count(count)
    bounds = _bounds(scene)
    direction, natural_up = _direction(view)
    up = np.asarray(natural_up if up is None else up, dtype=float)
    cameras = [
        camera_for(
            bounds, view=_turned(direction, up, 2 * math.pi * step / count), up=up, projection=projection,
            field_of_view=field_of_view, size=size, margin=margin,
        )
        for step in range(int(count))
    ]  # fmt: skip

    # The farthest of them has all in view from everywhere.
    if projection == "orthographic":
        height = max(camera.height for camera in cameras)
        return [_core.OrthographicCamera(each.eye, each.target, up, height=height) for each in cameras]
    distance = max(np.linalg.norm(camera.eye - camera.target) for camera in cameras)
    return [
        _core.PerspectiveCamera(
            each.target + (each.eye - each.target) * (distance / np.linalg.norm(each.eye - each.target)),
            each.target, up, field_of_view,
        )
        for each in cameras
    ]  # fmt: skip


def _turned(vector: Vector, axis: Vector, angle: float) -> Vector:
    """A vector turned counter-clockwise about an axis of any length, by Rodrigues' formula."""
    axis = axis / (np.linalg.norm(axis) or 1.0)
    along = axis * (axis @ vector)
    return along + math.cos(angle) * (vector - along) + math.sin(angle) * np.cross(axis, vector)


def _bounds(scene: Bounded) -> NDArray[np.float64]:
    """Lower and upper corner of a scene or a box."""
    try:
        bounds = np.asarray(getattr(scene, "bounds", scene), dtype=float)
    except (TypeError, ValueError):
        raise TypeError(sentence("scene", "a scene or a box of shape (2, 3)", scene)) from None
    if bounds.shape != (2, 3):
        raise ValueError(f"scene: expected a scene or a box of shape (2, 3), got shape {bounds.shape}")
    if not (np.isfinite(bounds).all() and (bounds[0] <= bounds[1]).all()):
        raise ValueError(f"scene: expected a box that is not empty, got {bounds.tolist()}")
    return bounds


def _direction(view: View) -> tuple[Vector, tuple[int, int, int]]:
    """Unit vector towards the eye, and upwards."""
    if isinstance(view, str):
        if view not in VIEWS:
            raise ValueError(f"view: expected one of {', '.join(VIEWS)}, or a vector, got {view!r}")
        direction, up = VIEWS[view]
    else:
        direction, up = view, (0, 0, 1)
    direction = np.asarray(direction, dtype=float)
    if direction.shape != (3,) or not np.isfinite(direction).all() or not direction.any():
        raise ValueError(f"view: expected three finite numbers, not all of them zero, got {direction.tolist()}")
    direction = direction / np.linalg.norm(direction)
    if abs(direction @ np.asarray(up)) > 1 - 1e-6:
        up = VIEWS["+z" if direction[2] > 0 else "-z"][1]
    return direction, up
