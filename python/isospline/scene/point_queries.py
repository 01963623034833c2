"""Queries of points in scenes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from .. import _core
from ..base.parameters import whole_number
from ..base.signatures import methods_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ..base.results import ClosestPoints
    from ..base.types import Progress


@methods_of("Scene")
class PointQueries(_core.Scene):
    """The part of `Scene` about points."""

    __slots__ = ()

    def closest_points(
        self,
        points: ArrayLike,
        *,
        max_distance: float = math.inf,
        tolerance: float | None = None,
        progress: Progress = None,
    ) -> ClosestPoints:
        """The points of the scene's objects that are nearest to given points.

        Parameters
        ----------
        points : (..., 3) array_like, world units
        max_distance : float, world units
            Parts that are farther away are not searched.
        tolerance : float, world units, optional
            As in `Isosurface.closest_points`.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        ClosestPoints
            As in `Isosurface.closest_points`: `points`, `distances`, `error_bounds` (0 on meshes), `primitive_ids`,
            `primitive_normals`. Also `geometry_ids`, (...) uint32: INVALID_ID if nothing is within `max_distance`; and
            `primitive_uvs`, (..., 2) float64: weights of a triangle's second and third corner; 0 on isosurfaces.

        Raises
        ------
        ValueError
            As in `Isosurface.closest_points`.

        Notes
        -----
        Objects are those that `cast_rays` sees, with their transforms, including shear and mirroring, and with the caps
        of isosurfaces. If several objects are equally near, the one with the smallest id is returned.

        Examples
        --------
        >>> import isospline
        >>> tetrahedron = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
        ...                              [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
        >>> scene = isospline.Scene([tetrahedron])
        >>> nearest = scene.closest_points([(0.2, 0.3, -2)])
        >>> nearest["points"].round(6), nearest["distances"], nearest["primitive_ids"]
        (array([[0.2, 0.3, 0. ]]), array([2.]), array([0], dtype=uint64))
        """
        return super().closest_points(points, max_distance, tolerance, progress)

    def signed_distance(
        self,
        points: ArrayLike,
        *,
        max_distance: float = math.inf,
        tolerance: float | None = None,
        progress: Progress = None,
    ) -> NDArray[np.float64]:
        """Distances of points from the scene's objects; negative inside of any object.

        Parameters
        ----------
        points : (..., 3) array_like, world units
        max_distance, tolerance : float, world units
            As in `closest_points`.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        (...) float64 array
            The distance from `closest_points`, world units, with a sign from `occupancy`; plus or minus infinity if
            nothing is within `max_distance`.

        Raises
        ------
        ValueError
            As in `closest_points`.

        Examples
        --------
        >>> import isospline
        >>> tetrahedron = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
        ...                              [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
        >>> isospline.Scene([tetrahedron]).signed_distance([(0.1, 0.2, 0.3), (-1, 0, 0)])
        array([-0.1,  1. ])
        """
        return super().signed_distance(points, max_distance, tolerance, progress)

    def occupancy(self, points: ArrayLike, *, progress: Progress = None) -> NDArray[np.bool_]:
        """Whether points are inside of any object of the scene.

        Parameters
        ----------
        points : (..., 3) array_like, world units
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        (...) bool array
            For an isosurface, the result of `Isosurface.contains`. A point is inside of a mesh, which must be closed,
            if a ray from it meets the mesh's triangles an odd number of times. Only objects that `cast_rays` sees
            count.

        Raises
        ------
        ValueError
            For a point that is not finite.

        Examples
        --------
        >>> import isospline
        >>> tetrahedron = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
        ...                              [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
        >>> isospline.Scene([tetrahedron]).occupancy([(0.1, 0.2, 0.3), (-1, 0, 0)])
        array([ True, False])
        """
        return super().occupancy(points, progress)

    def compute_closest_points(self, query_points: ArrayLike) -> ClosestPoints:
        """Open3D's name for `closest_points`."""
        return self.closest_points(query_points)

    def compute_distance(self, query_points: ArrayLike) -> NDArray[np.float64]:
        """Open3D's name for the `distances` of `closest_points`."""
        return self.closest_points(query_points).distances

    def compute_signed_distance(self, query_points: ArrayLike, nsamples: int = 1) -> NDArray[np.float64]:
        """Open3D's name for `signed_distance`. `nsamples`, an odd number, has no effect, because rays are exact."""
        _check_sample_count(nsamples)
        return self.signed_distance(query_points)

    def compute_occupancy(self, query_points: ArrayLike, nsamples: int = 1) -> NDArray[np.float32]:
        """Open3D's name for `occupancy`, as float32: 1 inside, 0 outside. `nsamples`, an odd number, has no
        effect.
        """
        _check_sample_count(nsamples)
        return self.occupancy(query_points).astype(np.float32)

    def extent(self, directions: ArrayLike) -> NDArray[np.float64]:
        r"""The extent, along directions, of all objects that the camera sees.

        .. math:: \min_x \langle n, x \rangle, \quad \max_x \langle n, x \rangle

        over all points x of meshes, surfaces and caps, after all cuts. `camera_for` fits this extent into the image.
        Objects that the camera does not see are left out.

        Parameters
        ----------
        directions : (..., 3) array_like of numbers
            The vectors n, of any length, in world space.

        Returns
        -------
        (..., 2) float64 array
            The smallest and the largest product; world units if n has unit length. For isosurfaces, the interval may be
            wider than the exact one, by less than two cells at each end. inf and -inf if no object is visible.

        Raises
        ------
        ValueError
            For a direction that is not finite.

        Examples
        --------
        >>> import isospline
        >>> field = isospline.volumes.torus()
        >>> torus = field.volume(64)
        >>> isospline.Scene([isospline.Isosurface(torus, field.level)]).extent([(0, 0, 1), (1, 1, 0)]).round(1)
        array([[-0.3,  0.3],
               [-1.2,  1.2]])
        """
        return super().extent(directions)


def _check_sample_count(nsamples):
    """Open3D casts several rays and takes a vote. Our rays are exact, so one is enough."""
    if whole_number(nsamples, "nsamples") < 1 or nsamples % 2 == 0:
        raise ValueError(f"nsamples: expected an odd number above 0, got {nsamples}")
