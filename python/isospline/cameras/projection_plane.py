"""The paper's camera: an eye and a projection plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..base.parameters import vector
from ..base.signatures import explained_methods
from .camera import _Pinhole


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class ProjectionPlaneCamera(_Pinhole):
    """A pinhole given by its eye and its projection plane, as in the paper.

    The ray of the point P of the plane is x = E + t (P - E): t is 0 in the eye E and 1 on the plane. The edges need not
    be perpendicular, and pixels need not be square.

    Parameters
    ----------
    eye : (3,) float
        E, world units.
    right, down : (3,) float
        Edges of the image, world units: along its whole width, and along its whole height.
    corner, center : (3,) float
        The top left corner of the image, or its centre, world units. Give one of them.
    distortion : (4,), (5,), (8,) or (12,) float, optional
        Distortion of the lens, in OpenCV's order; see `from_opencv`. The ray of the image point P then goes through the
        point of the plane that the lens shows at P.

    Raises
    ------
    ValueError
        For edges that are zero or parallel, an eye in the plane, numbers that are not finite, a distortion that folds
        the image, and unless exactly one of `corner` and `center` is given.

    References
    ----------
    P. Thévenaz, M. Unser, "High-quality isosurface rendering with exact gradient", ICIP 2001, section 3.

    Examples
    --------
    >>> import isospline
    >>> camera = isospline.ProjectionPlaneCamera((0, -5, 0), center=(0, 0, 0), right=(1.6, 0, 0), down=(0, 0, -0.9))
    >>> camera.corner
    array([-0.8 ,  0.  ,  0.45])
    """

    eye: NDArray[np.float64]
    right: NDArray[np.float64]
    down: NDArray[np.float64]
    corner: NDArray[np.float64]
    #: (12,) float64 array: the lens's coefficients in OpenCV's order, or None.
    distortion: NDArray[np.float64] | None

    def __init__(
        self,
        eye: ArrayLike,
        *,
        right: ArrayLike,
        down: ArrayLike,
        corner: ArrayLike | None = None,
        center: ArrayLike | None = None,
        distortion: ArrayLike | None = None,
    ) -> None:
        if (corner is None) == (center is None):
            raise ValueError(f"corner, center: expected one of them, got {'none' if corner is None else 'both'}")
        edges = {"right": vector(right, "right"), "down": vector(down, "down")}
        if center is None:
            first = vector(corner, "corner")  # type: ignore[arg-type]
        else:
            first = vector(center, "center") - 0.5 * (edges["right"] + edges["down"])
        lens = None if distortion is None else _core._distortion(distortion)
        self._keep(eye=vector(eye, "eye"), **edges, corner=first, distortion=lens)

    @classmethod
    def from_opencv(
        cls,
        intrinsics: ArrayLike,
        rotation: ArrayLike,
        translation: ArrayLike | None = None,
        size: tuple[int, int] | None = None,
        *,
        pixel_center: float = 0.0,
        distortion: ArrayLike | None = None,
    ) -> ProjectionPlaneCamera:
        r"""The camera of a calibration by OpenCV.

        .. math:: w (u, v, 1)^T = K (R X + t), \quad w > 0

        Parameters
        ----------
        intrinsics : (3, 3) float
            K: rows (fx, skew, cx), (0, fy, cy) and (0, 0, 1), pixels.
        rotation : (3, 3), (3,), (4, 4) or (3, 4) float
            R, world to camera; or the rotation vector of `cv2.solvePnP`, axis times angle; or, without a translation,
            the extrinsic matrix (R t), as in Open3D's `create_rays_pinhole`.
        translation : (3,) or (3, 1) float, optional
            t.
        size : (int, int)
            Width and height of the calibrated image in pixels. Pictures of another size show the same scene, in more or
            fewer pixels.
        pixel_center : float
            u and v in the centre of the top left pixel: 0 in OpenCV, 0.5 in Open3D, COLMAP and others.
        distortion : (4,), (5,), (8,) or (12,) float, optional
            OpenCV's distCoeffs: k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4. Rays are those of the distorted
            photograph, so that a picture matches it pixel by pixel, without `cv2.undistort`.

        Returns
        -------
        ProjectionPlaneCamera

        Raises
        ------
        ValueError
            For a K of another form, an R that is not a rotation, a `size` of None, numbers that are not finite, a
            tilted sensor (the last two of 14 coefficients), and a distortion that folds the image, because its
            polynomial is not monotonic there.

        Examples
        --------
        >>> import isospline
        >>> K = [(800, 0, 319.5), (0, 800, 239.5), (0, 0, 1)]
        >>> camera = isospline.ProjectionPlaneCamera.from_opencv(K, (0, 0, 0), (0, 0, 10), size=(640, 480))
        >>> camera.eye + 0.0
        array([  0.,   0., -10.])
        """
        return _core._camera_from_opencv(intrinsics, rotation, translation, size, pixel_center, distortion)

    def replace(self, **changes: Any) -> ProjectionPlaneCamera:
        """The same camera with changed parameters: ``camera.replace(eye=(0, -20, 0))``.

        Parameters
        ----------
        **changes
            Parameters of the constructor.
        """
        if "center" in changes:
            changes = {"corner": None, **changes}
        return super().replace(**changes)
