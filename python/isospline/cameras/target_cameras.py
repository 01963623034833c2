"""Cameras that are given by an eye and a target."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..base.mistakes import sentence
from ..base.parameters import number, optional, text, vector
from ..base.signatures import explained_methods
from .camera import _Camera, _LinearCamera, _Pinhole

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..base.types import CameraPosition, Point


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class PerspectiveCamera(_Pinhole):
    """An eye that looks at a target: a pinhole, or a thin lens.

    With a lens, only objects in the plane in focus are sharp. Every sample of a pixel goes through another point of the
    lens, so pictures need many samples: `render(..., samples=64)`. Depth, position and all other layers come from the
    ray through the centre.

    Parameters
    ----------
    eye, target : (3,) float
        Points, world units.
    up : (3,) float
        Any vector that the image shows pointing upwards; not parallel to the viewing direction.
    field_of_view : float
        Whole angle in degrees, above 0 and below 180.
    field_of_view_axis : {"vertical", "horizontal", "diagonal"}
        The side, or diagonal, of the image that the angle is measured along.
    aperture_radius : float
        Of the lens, world units; 0 is a pinhole. See `with_lens` for f-numbers.
    focus_distance : float, optional
        From the eye to the plane in focus, along the viewing direction, world units; by default to the target.

    Raises
    ------
    ValueError
        For an eye on its target, an up vector along the viewing direction, an angle out of range, a negative aperture,
        a focus distance that is not positive, numbers that are not finite.

    Examples
    --------
    >>> import isospline
    >>> camera = isospline.PerspectiveCamera(eye=(0, -10, 0), target=(0, 0, 0), field_of_view=30)
    >>> camera.rays((640, 360)).shape
    (360, 640, 6)
    """

    eye: NDArray[np.float64]
    target: NDArray[np.float64]
    up: NDArray[np.float64]
    #: float, degrees: the whole angle.
    field_of_view: float
    field_of_view_axis: Literal["vertical", "horizontal", "diagonal"]
    #: float, world units; 0 is a pinhole.
    aperture_radius: float
    #: float, world units: from the eye to the plane in focus, along the viewing direction.
    focus_distance: float

    def __init__(
        self,
        eye: ArrayLike,
        target: ArrayLike,
        up: ArrayLike = (0.0, 0.0, 1.0),
        field_of_view: float = 30.0,
        *,
        field_of_view_axis: Literal["vertical", "horizontal", "diagonal"] = "vertical",
        aperture_radius: float = 0.0,
        focus_distance: float | None = None,
    ) -> None:
        own_focus = optional(number, focus_distance, "focus_distance")
        places = {"eye": vector(eye, "eye"), "target": vector(target, "target"), "up": vector(up, "up")}
        to_target = float(np.linalg.norm(places["target"] - places["eye"]))
        object.__setattr__(self, "_exact", {"focus_distance": own_focus})
        self._keep(
            **places,
            field_of_view=number(field_of_view, "field_of_view"),
            field_of_view_axis=text(field_of_view_axis, "field_of_view_axis"),
            aperture_radius=number(aperture_radius, "aperture_radius"),
            focus_distance=to_target if own_focus is None else own_focus,
        )

    def with_lens(
        self,
        aperture_radius: float | None = None,
        *,
        f_number: float | None = None,
        focal_length: float | None = None,
        focus_distance: float | None = None,
    ) -> PerspectiveCamera:
        """The same camera with another lens.

        Parameters
        ----------
        aperture_radius : float, optional
            Of the lens, world units.
        f_number, focal_length : float, optional
            Instead of the radius: N and f of a lens whose aperture has the diameter f / N; f in world units.
        focus_distance : float, optional
            From the eye to the plane in focus, along the viewing direction, world units; by default to the target.

        Returns
        -------
        PerspectiveCamera

        Raises
        ------
        ValueError
            Unless either the radius or both the f-number and the focal length are given, and for numbers that the
            camera does not accept.

        Examples
        --------
        >>> import isospline
        >>> camera = isospline.PerspectiveCamera(eye=(0, -10, 0), target=(0, 0, 0))
        >>> camera.with_lens(f_number=2, focal_length=0.5, focus_distance=9).aperture_radius
        0.125
        """
        if (aperture_radius is None) == (f_number is None):
            given = "none" if f_number is None else "both"
            raise ValueError(f"aperture_radius, f_number: expected one of them, got {given}")
        if (f_number is None) != (focal_length is None):
            given = "focal_length" if f_number is None else "f_number"
            raise ValueError(f"f_number, focal_length: expected both of them or none, got {given}")
        if f_number is not None:
            aperture_radius = _positive(focal_length, "focal_length") / (2.0 * _positive(f_number, "f_number"))
        return self.replace(aperture_radius=aperture_radius, focus_distance=focus_distance)

    @classmethod
    def from_pyvista(cls, camera_position: Sequence[ArrayLike], view_angle: float = 30.0) -> PerspectiveCamera:
        """The camera of a PyVista plotter, or of VTK.

        Parameters
        ----------
        camera_position : three of (3,) float
            Position, focal point and view up, as `Plotter.camera_position` has them.
        view_angle : float
            Vertical, degrees, as `Plotter.camera.view_angle`.

        Returns
        -------
        PerspectiveCamera

        Examples
        --------
        >>> import isospline
        >>> camera = isospline.PerspectiveCamera.from_pyvista([(0, -9, 3), (0, 0, 0), (0, 0, 1)], 25)
        >>> camera.to_pyvista()
        (((0.0, -9.0, 3.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), 25.0)
        """
        return cls(*_camera_position(camera_position), view_angle)

    def to_pyvista(self, size: tuple[int, int] | None = None) -> tuple[CameraPosition, float]:
        """The camera for a PyVista plotter.

        Parameters
        ----------
        size : (int, int), optional
            Width and height of the image; needed if the field of view is not vertical.

        Returns
        -------
        camera_position : three tuples
            Position, focal point and view up, for `Plotter.camera_position`.
        view_angle : float
            Vertical, degrees, for `Plotter.camera.view_angle`.

        Raises
        ------
        ValueError
            If the field of view is not vertical and `size` is None.
        """
        view_angle = self.field_of_view
        if self.field_of_view_axis != "vertical":
            if size is None:
                expected = "width and height of the image, since the field of view is not vertical"
                raise ValueError(f"size: expected {expected}, got None")
            upper, lower = _core._left_corners(self, size)
            view_angle = 2.0 * float(np.degrees(np.arctan(0.5 * np.linalg.norm(lower - upper))))
        return _to_camera_position(self), view_angle


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class OrthographicCamera(_LinearCamera):
    """Parallel rays from the plane through an eye, along target - eye.

    Parameters
    ----------
    eye, target : (3,) float
        Points, world units. Objects behind the plane through the eye are not visible.
    up : (3,) float
        Any vector that the image shows pointing upwards; not parallel to the viewing direction.
    height : float
        Height of the image, world units; the width follows from the shape of the image.

    Raises
    ------
    ValueError
        For an eye on its target, an up vector along the viewing direction, a height that is not positive, numbers that
        are not finite.

    Examples
    --------
    >>> import isospline
    >>> camera = isospline.OrthographicCamera(eye=(0, -10, 0), target=(0, 0, 0), height=4)
    >>> camera.rays((640, 360))[0, 0, 3:]
    array([0., 1., 0.])
    """

    eye: NDArray[np.float64]
    target: NDArray[np.float64]
    up: NDArray[np.float64]
    #: float, world units: height of the image.
    height: float

    def __init__(self, eye: ArrayLike, target: ArrayLike, up: ArrayLike = (0.0, 0.0, 1.0), *, height: float) -> None:
        self._keep(
            eye=vector(eye, "eye"),
            target=vector(target, "target"),
            up=vector(up, "up"),
            height=number(height, "height"),
        )

    @classmethod
    def from_pyvista(cls, camera_position: Sequence[ArrayLike], parallel_scale: float) -> OrthographicCamera:
        """The camera of a PyVista plotter in parallel projection.

        Parameters
        ----------
        camera_position : three of (3,) float
            Position, focal point and view up, as `Plotter.camera_position` has them.
        parallel_scale : float
            Half of the height of the image, world units, as `Plotter.camera.parallel_scale`.

        Returns
        -------
        OrthographicCamera
        """
        scale = number(parallel_scale, "parallel_scale")
        if not (np.isfinite(scale) and scale > 0.0):
            raise ValueError(sentence("parallel_scale", "a finite number above 0", parallel_scale))
        return cls(*_camera_position(camera_position), height=2.0 * scale)

    def to_pyvista(self) -> tuple[CameraPosition, float]:
        """The camera for a PyVista plotter in parallel projection.

        Returns
        -------
        camera_position : three tuples
            Position, focal point and view up, for `Plotter.camera_position`.
        parallel_scale : float
            Half of the height of the image, world units, for `Plotter.camera.parallel_scale`.
        """
        return _to_camera_position(self), 0.5 * self.height


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class PanoramicCamera(_Camera):
    """All around an eye, in equirectangular projection.

    Columns are longitudes, from -180 to 180 degrees, rows are latitudes, from 90 down to -90 degrees, and the middle of
    the image shows the target. Pixels on the horizon are square if the image is twice as wide as high. The depth of a
    panorama is the distance from the eye. The projection is not linear, so there is no `world_to_ndc`.

    Parameters
    ----------
    eye, target : (3,) float
        Points, world units.
    up : (3,) float
        Any vector that the middle of the image shows pointing upwards; not parallel to the viewing direction.

    Raises
    ------
    ValueError
        For an eye on its target, an up vector along the viewing direction, numbers that are not finite.

    Examples
    --------
    >>> import isospline
    >>> camera = isospline.PanoramicCamera(eye=(0, 0, 0), target=(0, 1, 0))
    >>> camera.rays((3, 1))[0, :, 3:].round(3) + 0.0
    array([[-0.866, -0.5  ,  0.   ],
           [ 0.   ,  1.   ,  0.   ],
           [ 0.866, -0.5  ,  0.   ]])
    """

    eye: NDArray[np.float64]
    target: NDArray[np.float64]
    up: NDArray[np.float64]

    def __init__(self, eye: ArrayLike, target: ArrayLike, up: ArrayLike = (0.0, 0.0, 1.0)) -> None:
        self._keep(eye=vector(eye, "eye"), target=vector(target, "target"), up=vector(up, "up"))


def _camera_position(value: Any) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Position, focal point and view up of PyVista."""
    expected = "three points: position, focal point and view up"
    if isinstance(value, str):
        raise ValueError(f'camera_position: expected {expected}, got "{value}"')
    if not hasattr(type(value), "__getitem__"):  # PyVista's own class has no __iter__
        raise TypeError(sentence("camera_position", expected, value))
    points = [vector(each, "camera_position") for each in value]
    if len(points) != 3:
        raise ValueError(f"camera_position: expected {expected}, got {len(points)} of them")
    return points[0], points[1], points[2]


def _to_camera_position(camera: PerspectiveCamera | OrthographicCamera) -> CameraPosition:
    return _point(camera.eye), _point(camera.target), _point(camera.up)


def _point(place: NDArray[np.float64]) -> Point:
    x, y, z = place.tolist()
    return x, y, z


def _positive(value: Any, parameter: str) -> float:
    given = number(value, parameter)
    if not 0 < given < np.inf:
        raise ValueError(f"{parameter}: expected a positive finite number, got {value!r}")
    return given
