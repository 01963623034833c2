"""Queries of points at isosurfaces."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np

from .. import _core
from ..base.signatures import methods_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ..base.results import ClosestPoints, SurfaceSamples
    from ..base.types import Progress


@methods_of("Isosurface")
class SurfaceQueries(_core.Isosurface):
    """The part of `Isosurface` about points."""

    __slots__ = ()

    @overload
    def contains(
        self, points: ArrayLike, *, certify: Literal[False] = False, progress: Progress = None
    ) -> NDArray[np.bool_]: ...

    @overload
    def contains(
        self, points: ArrayLike, *, certify: Literal[True], progress: Progress = None
    ) -> NDArray[np.uint8]: ...

    def contains(self, points: ArrayLike, *, certify: bool = False, progress: Progress = None) -> NDArray[Any]:
        r"""Whether points are in the solid that the surface bounds.

        .. math:: f(\mathbf{x}) \ge f_0, \text{ or } f(\mathbf{x}) < f_0 \text{ for } \texttt{inside="below"}

        Parameters
        ----------
        points : (..., 3) array_like, world units
        certify : bool
            Returns what is proven of the model of the stored float32 coefficients, by arithmetic that accounts for all
            rounding. For surfaces without `clip`, `mask` and `largest`, and not `closed`.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        (...) bool array, or uint8 array
            By the sign of :math:`f - f_0`, evaluated in float64; where f equals the level, up to rounding errors, it
            counts as above. At samples that the model interpolates, these are the errors of the float32 coefficients
            as well, about 3e-7 of the largest one around. Parts that `clip` or `mask` cut away are outside. So is
            everything outside of `volume.bounds`, for each boundary rule, but for samples on the border whose positions
            are outside by rounding errors: the answer at samples is that of `to_mask`.

            With `certify`, 1 for a point that is proven to be in the solid, 0 for one that is proven not to be, and 2
            for one that is undecided, because it is on the surface or on the border of the volume to within rounding.

        Raises
        ------
        ValueError
            For a point that is not finite. With `certify`, for a surface with `clip`, `mask` or `largest`, and a closed
            one.

        Examples
        --------
        >>> import isospline
        >>> field = isospline.volumes.sphere(0.7)
        >>> volume = field.volume(32)
        >>> isospline.Isosurface(volume, field.level).contains([(0, 0, 0), (0.6, 0, 0), (0.8, 0, 0), (5, 0, 0)])
        array([ True,  True, False, False])
        """
        return super().contains(points, certify, progress)

    def to_mask(self, *, whole_cells: bool = False, progress: Progress = None) -> NDArray[np.bool_]:
        """The samples that are in the solid, as bool array.

        Sums and means of the mask, and of data in it, are those of the samples of the solid: ``to_mask().mean()`` of
        pores is the porosity by counting. `enclosed_volume` is more precise.

        Parameters
        ----------
        whole_cells : bool
            Whether to return the samples of all cells that contain a part of the solid instead: their centres (degree
            2) or their corners (odd degrees). As `mask` of another surface of the volume, this keeps all of the other
            one that is in this solid. These are more samples than those in the solid.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        bool array of the volume's shape
            True where a sample's position is in the solid, as `mask`, `largest` and `clip` leave it. f is compared with
            the level there: a sample where it equals the level, up to the rounding of the model's coefficients, is in
            the solid if that is above. Samples on a plane of `clip` and at the border of the volume can be in the
            solid.

        Examples
        --------
        The bones in a body, without the table on which it lies:

        >>> import numpy as np
        >>> import isospline
        >>> z, y, x = np.mgrid[0:32, 0:32, 0:32]
        >>> samples = np.where(z > 9, 0.0, -1000.0)
        >>> samples[z < 5] = 700  # the table
        >>> samples[(x - 16) ** 2 + (y - 16) ** 2 + (z - 20) ** 2 < 36] = 700  # a bone
        >>> volume = isospline.Volume(samples)
        >>> body = isospline.Isosurface(volume, -500, largest=1)
        >>> bones = isospline.Isosurface(volume, 300, mask=body.to_mask(whole_cells=True))
        >>> len(isospline.Isosurface(volume, 300).components().bounds), len(bones.components().bounds)
        (2, 1)

        The samples of a body, counted:

        >>> int(body.to_mask().sum()), int((samples[9:] > -500).sum())
        (22528, 22528)
        """
        return super().to_mask(whole_cells, progress)

    def closest_points(
        self,
        points: ArrayLike,
        *,
        max_distance: float = math.inf,
        tolerance: float | None = None,
        progress: Progress = None,
    ) -> ClosestPoints:
        """The points of the surface that are nearest to given points.

        Branch and bound over the cells of the shell and parts of them [1]_: a part is excluded only if its Bernstein
        coefficients prove that the surface is not in it, or that it is not nearer there. The result is the global
        minimum, up to the error bound that is returned with it.

        Parameters
        ----------
        points : (..., 3) array_like, world units
        max_distance : float, world units
            Farther parts of the surface are not searched. A small distance saves most of the time.
        tolerance : float, world units, optional
            The error bound that the search aims at; by default a millionth of the shortest edge of a voxel.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        ClosestPoints
            `points`, (..., 3) float64: on the surface, to about 1e-11 of a voxel; NaN if there is none within
            `max_distance`. `distances`, (...) float64: to these points; infinite if there is none. `error_bounds`,
            (...) float64: no part of the surface is nearer than ``minimum(distances, max_distance) - error_bounds``, up
            to rounding. `primitive_ids`, (...) uint64: of the cells and caps, as in `Scene.cast_rays`, or
            INVALID_PRIMITIVE_ID. `primitive_normals`, (..., 3) float64: unit, outward; zero if there is no point, or
            the gradient vanishes.

        Raises
        ------
        ValueError
            For a point that is not finite or has a coordinate above 1e100, a `max_distance` below 0, and a tolerance
            that is not above 0.

        Notes
        -----
        Parts that `mask` and `clip` cut away are ignored. Caps count as surface: the nearest point may be on a cap. If
        the surface is open, the nearest point may be on the rim of the cut or of the volume. The search ends after
        16384 parts. So the error bound exceeds the tolerance only if too many parts of the surface are almost equally
        near, as at the centre of a sphere.

        The bound is on the distance. If the nearest point is at distance d, a point of the surface whose distance is
        larger by e may be about sqrt(2 e d) away from it. Most results are nevertheless exact up to rounding, because
        Newton's method finds them.

        The first call at a level builds a tree of the shell.

        References
        ----------
        .. [1] A. H. Land, A. G. Doig, "An automatic method of solving discrete programming problems", Econometrica 28,
           1960.

        Examples
        --------
        >>> import isospline
        >>> field = isospline.volumes.sphere(0.7)
        >>> volume = field.volume(32)
        >>> surface = isospline.Isosurface(volume, field.level)
        >>> nearest = surface.closest_points([(0.2, 0, 0), (0, 0, 3)])
        >>> nearest["distances"].round(4)
        array([0.5, 2.3])
        >>> nearest["points"].round(4) + 0.0
        array([[0.7, 0. , 0. ],
               [0. , 0. , 0.7]])
        >>> bool((nearest["error_bounds"] < 1e-7).all())
        True
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
        """Distances of points from the surface, negative inside.

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
            The distance from `closest_points`, world units, with a sign from `contains`; plus or minus infinity if the
            surface is farther away than `max_distance`.

        Raises
        ------
        ValueError
            As in `closest_points`.

        Warns
        -----
        UserWarning
            If distances may be too large by more than the tolerance. `closest_points` returns an error bound for each.

        Notes
        -----
        Distances are those to the surface f = level and to its caps. Other ends of the solid, at a cut that is not
        capped or at the border of a volume that is not closed, do not count.

        Examples
        --------
        >>> import isospline
        >>> field = isospline.volumes.torus(0.6, 0.25)
        >>> volume = field.volume(64)
        >>> surface = isospline.Isosurface(volume, field.level)
        >>> surface.signed_distance([(0.6, 0, 0.1), (0.6, 0, 0.5), (0.2, 0, 0)]).round(3)
        array([-0.15,  0.25,  0.15])
        """
        return super().signed_distance(points, max_distance, tolerance, progress)

    def sample_points(self, count: int, *, seed: int = 0, progress: Progress = None) -> SurfaceSamples:
        """Random points of the surface, uniform by area in world space.

        Parameters
        ----------
        count : int
            Number of points.
        seed : int
            Seed of the random numbers, 0 to 2^32 - 1. The same seed gives the same points for any number of threads. A
            smaller count gives the first points of a larger one.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        SurfaceSamples
            `points`, (count, 3) float64: on the surface, world units, to about 1e-12 of a voxel. `primitive_ids`,
            (count,) uint64: of the cells and caps. `primitive_normals`, (count, 3) float64: unit, outward.

        Raises
        ------
        ValueError
            For a count below 0, a seed out of range, and, unless the count is 0, a surface without points.

        Notes
        -----
        The surface is f = level, without the parts that `mask` and `clip` cut away, and with its caps.

        The mean of a function over these points, times `area`, is an estimate of its integral.

        Examples
        --------
        >>> import numpy as np
        >>> import isospline
        >>> field = isospline.volumes.sphere(0.7)
        >>> volume = field.volume(32)
        >>> points = isospline.Isosurface(volume, field.level).sample_points(1000)["points"]
        >>> bool(abs(np.linalg.norm(points, axis=1) - 0.7).max() < 1e-3), bool(abs(points.mean(axis=0)).max() < 0.05)
        (True, True)
        """
        return super().sample_points(count, seed, progress)

    def thickness(
        self,
        points: ArrayLike,
        *,
        method: Literal["max_sphere", "ray"] = "max_sphere",
        ripple: float | None = None,
        progress: Progress = None,
    ) -> NDArray[np.float64]:
        """The thickness of the solid at points of its surface.

        Parameters
        ----------
        points : (..., 3) array_like, world units
            On the surface, such as those of `sample_points`. For other points, the nearest points of the surface are
            used.
        method : {"max_sphere", "ray"}
            "ray" is the length of the inward normal within the solid. "max_sphere" is the diameter of the largest ball
            in the solid whose distance from the point is at most `ripple`.
        ripple : float, optional
            For "max_sphere", world units: the height of ripples of the surface, such as those of noise, that do not
            matter. By default half of the shortest edge of a voxel. With 0, the ball touches the surface at the point,
            and the thickness is never larger than that of "ray".
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        (...) float64 array, world units
            Infinite if there is no opposite side because the solid is open, at the border of the volume if it is not
            closed or at a cut that is not capped. NaN if the gradient vanishes or there is no surface.

        Raises
        ------
        ValueError
            For a point that is not finite or has a coordinate above 1e100, another method, and a ripple below 0.

        Notes
        -----
        The names are those of trimesh.proximity.thickness. "max_sphere" is the local thickness of [1]_, for which a
        ball may be `ripple` away from the point: a ball that has to touch a noisy surface at the point is bounded by
        the ripples beside it. The ball shrinks on the inward normal [2]_. Then it moves to where it can grow, until it
        is the largest one nearby. On noisy surfaces a larger one may be elsewhere within `ripple`. Up to its precision,
        the ball is never smaller than the touching one. The precision is a fiftieth of `ripple`, but from a thousandth
        to a hundredth of a voxel's shortest edge. On a smooth surface, `ripple` has an effect only near edges and where
        the thickness changes: there, a ball may fit that is larger than the touching one.

        References
        ----------
        .. [1] T. Hildebrand, P. Rüegsegger, "A new method for the model-independent assessment of thickness in
           three-dimensional images", Journal of Microscopy 185, 1997.
        .. [2] J. Ma, S. W. Bae, S. Choi, "3D medial axis point approximation using nearest neighbors and the normal
           field", The Visual Computer 28, 2012.

        Examples
        --------
        >>> import isospline
        >>> field = isospline.volumes.torus(0.6, 0.25)
        >>> volume = field.volume(48)
        >>> torus = isospline.Isosurface(volume, field.level)
        >>> torus.thickness([(0.85, 0, 0), (0, 0.6, 0.25)]).round(2)
        array([0.5, 0.5])
        >>> float(torus.thickness((0.6, 0, 0.25), method="ray").round(3))
        0.5
        """
        return super().thickness(points, method, ripple, progress)
