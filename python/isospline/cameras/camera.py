"""What all cameras have."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..base.signatures import explained_methods
from ..base.values import Value


@explained_methods
class _Camera(Value):
    """A camera, whose numbers the compiled module checks."""

    def _check(self) -> None:
        _core._check_camera(self)

    def rays(self, size: tuple[int, int]) -> NDArray[np.float64]:
        """The rays through the centres of all pixels.

        Parameters
        ----------
        size : (int, int)
            Width and height of the image in pixels.

        Returns
        -------
        (height, width, 6) float64 array
            Origins and directions, world units; the first pixel is the top left one. A direction of a perspective
            camera has the component 1 along the viewing direction, so that t is the depth. A direction of a projection
            plane goes from the eye to the plane. All others have unit length. With a lens, these are the rays through
            its centre.
        """
        return _core._camera_rays(self, size)

    @property
    def world_to_camera(self) -> NDArray[np.float64]:
        """(4, 4) float64 array: maps column vectors of world space to camera space.

        Camera space is that of OpenEXR and RenderMan: x to the right, y up, z forward from the eye; it is left-handed.
        """
        return _core._world_to_camera(self)


@explained_methods
class _LinearCamera(_Camera):
    """A camera that a matrix describes."""

    def world_to_ndc(self, size: tuple[int, int]) -> NDArray[np.float64]:
        """Maps column vectors of world space to the image; divide by the fourth part.

        (0, 0) is the top left corner of the image and (1, 1) the bottom right one, as in OpenEXR and RenderMan.

        Parameters
        ----------
        size : (int, int)
            Width and height of the image in pixels.

        Returns
        -------
        (4, 4) float64 array

        Raises
        ------
        ValueError
            For a lens with distortion, which no matrix describes.
        """
        return _core._world_to_ndc(self, size)


@explained_methods
class _Pinhole(_LinearCamera):
    """A pinhole, or a lens around it."""

    def to_opencv(
        self, size: tuple[int, int], *, pixel_center: float = 0.0
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """The camera in OpenCV's form; see `ProjectionPlaneCamera.from_opencv`.

        Parameters
        ----------
        size : (int, int)
            Width and height of the image in pixels.
        pixel_center : float
            u and v in the centre of the top left pixel: 0 in OpenCV, 0.5 in Open3D, COLMAP and others.

        Returns
        -------
        intrinsics, rotation, translation : (3, 3), (3, 3) and (3,) float64 array
            K, R and t. The coefficients of a lens with distortion are `distortion`.

        Raises
        ------
        ValueError
            If the image is mirrored.
        """
        return _core._camera_to_opencv(self, size, pixel_center)
