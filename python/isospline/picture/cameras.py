"""Cameras that show all of a scene, from one side or from all around."""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Sequence
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.mistakes import sentence
from ..base.parameters import check_count, check_plain, check_type, number
from ..base.signatures import explained
from ..base.views import DEFAULT_VIEW, SIZE, Vector, View, direction_of
from ..cameras import OrthographicCamera, PerspectiveCamera
from ..cameras.camera import _Camera
from ..scene import Isosurface, Mesh, Scene
from ..suggest.presentation import suggested_view


class HasBounds(Protocol):
    """An object with a box: scenes, isosurfaces, meshes and volumes, and data sets of other libraries."""

    @property
    def bounds(self) -> Any: ...


Bounded = HasBounds | ArrayLike
Projection = Literal["perspective", "orthographic"]
#: The smallest and the largest <n, x> over all visible points x, (N, 2), for each n of an (N, 3) array.
Extent = Callable[[Vector], Vector]
#: The parts of the width that are left free on the left and on the right, and of the height below, for marks.
Space = tuple[float, float, float]
NO_SPACE: Space = (0.0, 0.0, 0.0)


def check_camera(camera: object) -> None:
    """Raise TypeError unless an object is a camera."""
    expected = "a PerspectiveCamera, a ProjectionPlaneCamera, an OrthographicCamera or a PanoramicCamera"
    check_type(camera, "camera", _Camera, expected)


@explained
def camera_for(
    scene: Bounded,
    *,
    view: View = DEFAULT_VIEW,
    up: ArrayLike | None = None,
    projection: Projection = "perspective",
    field_of_view: float = 30.0,
    size: tuple[int, int] = SIZE,
    margin: float = 0.05,
) -> PerspectiveCamera | OrthographicCamera:
    """Make a camera that shows all of a scene, or of a box, in the middle of the image.

    The camera is fitted to the drawn objects: surfaces after cuts, their caps, and meshes, not to the corners of their
    box. Nothing is cut off at the sides of the image, and along one axis of the image both sides touch the margin;
    in a wide field of view the eye may have to be farther away than that, in front of all objects.

    Parameters
    ----------
    scene : Scene, Isosurface, Mesh, list of these, anything else that has bounds, or (2, 3) float
        The scene, or the lower and the upper corner of a box, in world units. Of other objects that have bounds, their
        box is fitted.
    view : str or (3,) float
        The side of the eye: a vector towards the eye, or a name. By convention, objects face -y, z is upwards, and left
        is their own left, +x. The default, ``"suggested"``, is the view and the upward direction of `suggest_view` if
        all surfaces are of one volume and `up` is not given, otherwise "three-quarter".

        ===================================  =========  ===================================================
        name                                 the eye    the image
        ===================================  =========  ===================================================
        ``"front"``, ``"anterior"``          at -y      x to the right, z upwards
        ``"back"``, ``"posterior"``          at +y      x to the left, z upwards
        ``"left"``, ``"right"``              at +x, -x  z upwards
        ``"top"``                            at +z      x to the right, y upwards, as a map
        ``"superior"``                       at +z      x to the left, -y upwards: a patient's face is above
        ``"bottom"``, ``"inferior"``         at -z      x to the right, -y upwards, as radiologists see slices
        ``"three-quarter"``                  at -y      turned to the object's right and upwards, shows form
        ``"iso"``                            (1,-1,1)   from the front, the left and above
        ``"+x"`` to ``"-z"``                 there      z upwards; for ``"+z"`` y, for ``"-z"`` -y
        ===================================  =========  ===================================================

        In a patient's coordinates (LPS, as in DICOM, ITK and `read_volume`) these are the patient's sides.
    up : (3,) float, optional
        The upward direction in the image; by default that of the view. Use ``(0, 0, -1)`` if slices are stored from
        head to feet.
    projection : {"perspective", "orthographic"}
        The kind of camera.
    field_of_view : float
        Vertical field of view of a perspective camera, in degrees.
    size : (int, int)
        Width and height of the image; only their ratio counts.
    margin : float
        Fraction of the image's width and height to leave free, both sides together; at least 0 and below 1.

    Returns
    -------
    PerspectiveCamera or OrthographicCamera

    Raises
    ------
    ValueError
        For an unknown view or projection, an empty box, a scene without visible surfaces, and values that cameras
        refuse.

    Examples
    --------
    >>> import isospline
    >>> isospline.camera_for([(-1, -1, -1), (1, 1, 1)], view="top", projection="orthographic", margin=0, size=(9, 9))
    OrthographicCamera(eye=(0, 0, 4.73205080757), target=(0, 0, 0), up=(0, 1, 0), height=2)
    """
    framing = dict(projection=projection, field_of_view=field_of_view, size=size, margin=margin)
    return camera_beside(NO_SPACE, scene, view, up, **framing)


def camera_beside(
    space: Space,
    scene: Bounded,
    view: View = DEFAULT_VIEW,
    up: ArrayLike | None = None,
    **framing: Any,
) -> PerspectiveCamera | OrthographicCamera:
    """The camera of `camera_for` that leaves space for marks; `framing` are its other options."""
    view, up = suggested_for(scene, view, up)
    return _Fit(extent_of(scene), view, up, space=space, **framing).camera()


@explained
def turntable_cameras(
    scene: Bounded,
    count: int,
    *,
    view: View = DEFAULT_VIEW,
    up: ArrayLike | None = None,
    projection: Projection = "perspective",
    field_of_view: float = 30.0,
    size: tuple[int, int] = SIZE,
    margin: float = 0.05,
) -> list[PerspectiveCamera | OrthographicCamera]:
    """Make the cameras of one turn around a scene or a box, at a constant distance. `turntable` makes the video.

    The eye moves counter-clockwise as seen from above, so that the scene seems to turn clockwise. The first camera
    looks from `view`. The camera after the last one would be the first again.

    Parameters
    ----------
    scene : Scene, Isosurface, Mesh, list of these, anything else that has bounds, or (2, 3) float
        As in `camera_for`.
    count : int
        Number of cameras of the whole turn, at least 1.
    view, up, projection, field_of_view, size, margin
        As in `camera_for`; the eye turns about `up`. The whole scene is visible from every side.

    Returns
    -------
    list of PerspectiveCamera or OrthographicCamera

    Raises
    ------
    ValueError
        For a count below 1, and as in `camera_for`.

    Examples
    --------
    >>> import isospline
    >>> cameras = isospline.turntable_cameras([(-1, -1, -1), (1, 1, 1)], 4, view="front")
    >>> [camera.eye.round(1).tolist() for camera in cameras[:2]]
    [[0.0, -4.9, 0.0], [4.9, -0.0, 0.0]]
    """
    framing = dict(projection=projection, field_of_view=field_of_view, size=size, margin=margin)
    return cameras_around(NO_SPACE, scene, count, view, up, **framing)


def cameras_around(
    space: Space,
    scene: Bounded,
    count: int,
    view: View = DEFAULT_VIEW,
    up: ArrayLike | None = None,
    **framing: Any,
) -> list[PerspectiveCamera | OrthographicCamera]:
    """The cameras of `turntable_cameras` that leave space for marks; `framing` are its other options."""
    view, up = suggested_for(scene, view, up)
    return turn(extent_of(scene), count, view, up, space=space, **framing)


def suggested_for(scene: Any, view: View, up: ArrayLike | None) -> tuple[View, ArrayLike | None]:
    """The view and the upward direction of a camera: the suggested ones by default, if there are any."""
    is_default = isinstance(view, str) and view == DEFAULT_VIEW and up is None
    suggested = suggested_view(scene) if is_default else None
    return (view, up) if suggested is None else (suggested.view, suggested.up)


def turn(
    extent: Extent, count: int, view: View, up: ArrayLike | None, **framing: Any
) -> list[PerspectiveCamera | OrthographicCamera]:
    """The cameras of `cameras_around`; the extent is asked for before each of them."""
    check_count(count)
    direction, natural_up = direction_of(view)
    check_plain(up, "up")
    axis = np.asarray(natural_up if up is None else up, dtype=float)
    fits = []
    for step in range(int(count)):
        side = _turned(direction, axis, 2 * math.pi * step / count)
        fits.append(_Fit(extent, side, axis, **framing))

    # At the farthest distance, all is visible from every side.
    center = extent(np.eye(3)).mean(axis=1)
    if fits[0].projection == "orthographic":
        height = max(fit.height_about(center) for fit in fits)
        radius = max(fit.radius for fit in fits)
        return [fit.orthographic(fit.shifted(center, height), height, radius) for fit in fits]
    distance = max(fit.distance_from(center) for fit in fits)
    targets = [center - distance * fit.aside @ fit.axes[:2] for fit in fits]
    return [fit.perspective(target - distance * fit.axes[2], target) for fit, target in zip(fits, targets)]


class _Fit:
    """The cameras on one side of an object that show all of it; `extent` is the object's extent."""

    def __init__(
        self,
        extent,
        view,
        up,
        *,
        projection="perspective",
        field_of_view=30.0,
        size=SIZE,
        margin=0.05,
        space=NO_SPACE,
    ):
        direction, natural_up = direction_of(view)
        check_plain(up, "up")
        self.up = np.asarray(natural_up if up is None else up, dtype=float)
        if projection not in ("perspective", "orthographic"):
            raise ValueError(f"projection: expected 'perspective' or 'orthographic', got {projection!r}")
        margin = number(margin, "margin")
        if not 0 <= margin < 1:
            raise ValueError(f"margin: expected a part of the image, at least 0 and below 1, got {margin!r}")
        if not (isinstance(size, Sequence) and [isinstance(each, numbers.Real) for each in size] == [True, True]):
            raise TypeError(sentence("size", "two numbers, a width and a height", size))
        width, height = size
        if not (width > 0 and height > 0):
            raise ValueError(f"size: expected a width and a height above 0, got {size!r}")
        self.projection, self.field_of_view, self.aspect, self.free = projection, field_of_view, width / height, margin
        self.space, self.below = np.array(space[:2]), space[2]

        # Any camera on this side has the image's axes, and checks what was given.
        trial = PerspectiveCamera(direction, (0, 0, 0), self.up, field_of_view)
        self.axes = trial.world_to_camera[:3, :3]  # right, up, forward
        half_height = math.tan(math.radians(field_of_view) / 2)
        wide = half_height * self.aspect * np.maximum(1 - margin - 2 * self.space[::-1], 1e-3)
        high = half_height * np.maximum(1 - margin - 2 * np.array([0.0, self.below]), 1e-3)
        self.slopes = np.array([*wide, *high])
        #: The middle of the free part of the image, to the right of the middle of the image and above it, as slopes.
        self.aside = np.array([wide[0] - wide[1], high[0] - high[1]]) / 2
        # Outward normals of the sides of the view: right and left, top and bottom.
        right, upwards, forward = self.axes
        sides = zip((right, -right, upwards, -upwards), self.slopes)
        self.sides = np.array([towards - slope * forward for towards, slope in sides])
        extents = extent(np.concatenate([self.axes, self.sides]))
        self.extents = extents[:3]
        self.reach = extents[3:, 1]
        self.radius = np.linalg.norm(self.extents[:, 1] - self.extents[:, 0]) / 2 or 1.0

    def camera(self):
        """The nearest camera that shows the object, in the middle."""
        middle = self.extents.mean(axis=1)
        if self.projection == "orthographic":
            height = self.height_about(middle @ self.axes)
            return self.orthographic(self.shifted(middle @ self.axes, height), height, self.radius)
        # Along an axis of the image, both sides touch at one position of the eye; farther back, the margins stay equal.
        first, second = self.slopes[::2], self.slopes[1::2]
        depths = -(self.reach[::2] + self.reach[1::2]) / (first + second)
        depth = min(depths.min(), self.extents[2, 0] - self.radius * 1e-3)
        across = (self.reach[::2] - self.reach[1::2] + (first - second) * depth) / 2
        return self.perspective(np.array([*across, depth]) @ self.axes, np.array([*across, middle[2]]) @ self.axes)

    def shifted(self, center, height):
        """The target of an orthographic camera that shows a centre in the middle of the free part of the image."""
        right = (self.space[1] - self.space[0]) / 2 * height * self.aspect
        return center + right * self.axes[0] - self.below / 2 * height * self.axes[1]

    def distance_from(self, center):
        """The distance of the eye of a perspective camera that shows a centre in the middle of the free part."""
        depth = self.axes[2] @ center
        slopes = self.slopes - np.repeat(self.aside, 2) * (1, -1, 1, -1)
        distances = (self.reach - self.sides @ center) / slopes
        return max(distances.max(), depth - self.extents[2, 0] + self.radius * 1e-3)

    def height_about(self, center):
        """The height of the image that an orthographic camera looking at a centre needs."""
        x, y = np.abs(self.extents[:2] - (self.axes[:2] @ center)[:, None]).max(axis=1)
        wide = max(1 - self.free - self.space.sum(), 1e-3)
        high = max(1 - self.free - self.below, 1e-3)
        return 2 * max(y / high, x / (self.aspect * wide), self.radius * 1e-6)

    def orthographic(self, center, height, radius):
        eye = center - self.axes[2] * (radius * (1 + math.sqrt(3)))
        return OrthographicCamera(eye, center, self.up, height=height)

    def perspective(self, eye, target):
        return PerspectiveCamera(eye, target, self.up, self.field_of_view)


def _turned(vector: Vector, axis: Vector, angle: float) -> Vector:
    """A vector rotated counter-clockwise about an axis of any length, by Rodrigues' formula."""
    axis = axis / (np.linalg.norm(axis) or 1.0)
    along = axis * (axis @ vector)
    return along + math.cos(angle) * (vector - along) + math.sin(angle) * np.cross(axis, vector)


def extent_of(scene: Bounded) -> Extent:
    """A function that returns the extent of a scene or a box along directions."""
    is_list = isinstance(scene, (list, tuple)) and any(isinstance(each, (Isosurface, Mesh)) for each in scene)
    if is_list or isinstance(scene, (Isosurface, Mesh)):
        scene = Scene(scene)
    if isinstance(scene, Scene):
        if not np.isfinite(scene.extent(np.eye(3))).all():
            raise ValueError("scene: expected visible surfaces, got a scene without surfaces")
        return scene.extent
    lower, upper = _bounds(scene)
    corners = np.stack(np.meshgrid(*zip(lower, upper), indexing="ij"), axis=-1).reshape(-1, 3)

    def extent(directions: Vector) -> Vector:
        along = directions @ corners.T
        return np.stack([along.min(axis=1), along.max(axis=1)], axis=1)

    return extent


def _bounds(scene: Bounded) -> NDArray[np.float64]:
    """Lower and upper corner of a box."""
    check_plain(scene, "scene")
    try:
        bounds = np.asarray(getattr(scene, "bounds", scene), dtype=float)
    except (TypeError, ValueError):
        raise TypeError(sentence("scene", "a scene or a box of shape (2, 3)", scene)) from None
    if bounds.shape != (2, 3):
        raise ValueError(f"scene: expected a scene or a box of shape (2, 3), got shape {bounds.shape}")
    if not (np.isfinite(bounds).all() and (bounds[0] <= bounds[1]).all()):
        raise ValueError(f"scene: expected a box that is not empty, got {bounds.tolist()}")
    return bounds
