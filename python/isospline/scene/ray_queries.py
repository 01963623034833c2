"""Queries of rays in scenes."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np

from .. import _core
from ..base.signatures import methods_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, DTypeLike, NDArray

    from ..base.results import Crossings, Hits
    from ..base.types import HitOutput, Progress


@methods_of("Scene")
class RayQueries(_core.Scene):
    """The part of `Scene` about rays."""

    __slots__ = ()

    def cast_rays(
        self,
        rays: ArrayLike,
        directions: ArrayLike | None = None,
        *,
        t_near: float = 0.0,
        t_far: float = math.inf,
        coherent: bool | None = None,
        certify: bool = False,
        outputs: Iterable[HitOutput] = ("t_hit", "geometry_ids", "primitive_ids", "primitive_normals"),
        dtype: DTypeLike | None = None,
        out: dict[str, NDArray[Any]] | None = None,
        progress: Progress = None,
    ) -> Hits:
        """First crossing of each ray with the scene.

        Parameters
        ----------
        rays : (..., 6) array_like, float32 or float64
            Origin and direction, ox oy oz dx dy dz, in world units. Directions need not have length one.
            Tensors of other libraries are taken as they are; a warning tells if one requires a gradient, which is lost.
        directions : (..., 3) array_like, optional
            Directions of the rays, if `rays` has their origins alone, of shape (..., 3).
        t_near, t_far : float
            Only crossings with t in [t_near, t_far] count. t is in units of the direction's length.
        coherent : bool, optional
            Whether consecutive rays are close together, as the primary rays of a picture. Coherent rays are traced in
            SIMD packets where they are so close that this is faster, others one by one. By default, this is found out
            from the rays themselves; if they are far from each other, they are traced in another order. The hits are
            the same, bit for bit. Rays at volumes of stores are sorted unless they are coherent, so that most chunks
            are read once.
        certify : bool
            Adds what is proven of each ray's first crossing with the model of the stored float32 coefficients, by
            arithmetic that is rounded outwards and independent of the other outputs. The scene's visible objects must
            be isosurfaces without clip, mask and largest=, and none may be closed. `certificate` gives the proof
            itself, of one ray.
        outputs : sequence of str
            Names of the arrays to return. Only these are computed: ``outputs=("t_hit",)`` is the fastest.
        dtype : dtype, optional
            Type of arrays of real numbers, float64 or float32; by default that of the rays. Hits are computed in
            float64 and then rounded.
        out : dict of arrays, optional
            Arrays to write the outputs to, such as the result of an earlier call: C-contiguous, of the right shape and
            type. Missing ones are created.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        Hits
            A mapping whose items are also attributes: ``hits.t_hit`` is ``hits["t_hit"]``. By default it has these
            items:

            ``t_hit``: (...) dtype; inf if the ray misses. ``geometry_ids``: (...) uint32, of the object; `INVALID_ID`
            if the ray misses. ``primitive_ids``: (...) uint64; `INVALID_PRIMITIVE_ID` if the ray misses. For a mesh,
            the face. For an isosurface, the place of the cell in the volume, which is the same for every level: see
            `Volume.cell_at`. Caps have ids from ``volume.cell_count`` on, in the order of the half-spaces of `clip`.
            ``primitive_normals``: (..., 3) dtype, unit and outward, in world space. For an isosurface, along the exact
            gradient and away from its `inside`; for a cap, that of its plane; zero if the ray misses.

            Others, if `outputs` names them:

            ``positions``: (..., 3) dtype, in world space; NaN if the ray misses. ``primitive_uvs``: (..., 2) float32,
            weights of a triangle's second and third corner; 0 for isosurfaces. ``gradient_magnitudes``: (...) dtype, of
            an isosurface's model, also on caps, in values per world unit; 0 for meshes.

            Derivatives of hits, if `outputs` names them. All are zero for rays that miss, and for rays that graze,
            which ``grazing`` tells: (...) bool, the sine of the angle between ray and surface is below 2^-20, and
            derivatives have no bound. The derivatives of normals, and those by the level and by coefficients, are zero
            on caps and meshes.

            ``dt_dlevel``: (...) dtype, 1 / <gradient of f, direction>. ``dt_dorigin``, ``dt_ddirection``: (..., 3)
            dtype, -n / <n, direction> with the normal n, and t times that. ``dnormal_dlevel``: (..., 3) dtype,
            ``dnormal_dorigin``, ``dnormal_ddirection``: (..., 3, 3) dtype, of the unit normal along the surface; the
            last axis is that of the origin's or direction's coordinates. ``coefficient_indices``: (..., (n+1)^3) int64,
            ``coefficient_weights``: (..., (n+1)^3) dtype, of the coefficients in f at the hit. The derivative of t by a
            coefficient is -weight ``dt_dlevel``. Indices are places in ``volume.coefficients.ravel("K")``;
            `Volume.adjoint` takes gradients by coefficients to those by samples. In a scene of several degrees there
            are as many as for the highest one; weights of the others are zero. ``coefficient_gradients``: (...,
            (n+1)^3, 3) dtype, the gradients of these weights by the position in the world.

            With `certify`:

            ``statuses``: (...) uint8, what is proven of the ray: 0 for a miss, 1 for a hit, 2 if it is undecided,
            because the ray begins, ends or touches the surface closer to it than the bound of all rounding.
            ``t_bounds``: (..., 2) float64, a lower and an upper bound of the first crossing's t. There is no point of
            the surface between t_near and the lower bound. The ray of a hit crosses the surface at or before the upper
            bound. For a miss, both are inf; for an undecided ray, the upper bound is inf. ``level_bounds``: (...)
            float64. An undecided ray is at most this far from the level, in values, at its lower bound of t; 0 for
            other rays. ``normal_axes``: (..., 3) float64, unit vectors, and ``normal_angles``: (...) float64, in
            radians. The outward normal at the first crossing is within the angle of the axis. The axis is zero and the
            angle NaN if the ray does not hit; they are zero and pi if nothing is proven of the normal.
            ``model_distances``: (...) float64, in world units. The surface of the coefficients in exact arithmetic,
            before they were rounded to float32, comes this near to the first crossing; inf if that is not proven within
            a voxel, NaN if the ray does not hit.

        Raises
        ------
        ValueError
            If `rays` has another shape, an origin or direction is not finite, a direction is zero, the limits are NaN,
            an output name is unknown, `dtype` is another type, or an array of `out` has another shape, cannot be
            written to, or is not among `outputs`. With `certify`, if the scene has a visible object for which nothing
            can be proven.
        TypeError
            If `rays` does not hold real numbers, or an array of `out` has another type.
        """
        return super().cast_rays(rays, directions, t_near, t_far, coherent, certify, outputs, dtype, out, progress)

    @overload
    def test_occlusions(
        self,
        rays: ArrayLike,
        directions: ArrayLike | None = None,
        *,
        t_near: float = 0.0,
        t_far: float = math.inf,
        coherent: bool | None = None,
        certify: Literal[False] = False,
        progress: Progress = None,
    ) -> NDArray[np.bool_]: ...

    @overload
    def test_occlusions(
        self,
        rays: ArrayLike,
        directions: ArrayLike | None = None,
        *,
        t_near: float = 0.0,
        t_far: float = math.inf,
        coherent: bool | None = None,
        certify: Literal[True],
        progress: Progress = None,
    ) -> NDArray[np.uint8]: ...

    def test_occlusions(
        self,
        rays: ArrayLike,
        directions: ArrayLike | None = None,
        *,
        t_near: float = 0.0,
        t_far: float = math.inf,
        coherent: bool | None = None,
        certify: bool = False,
        progress: Progress = None,
    ) -> NDArray[Any]:
        """Whether each ray crosses anything; stops at the first crossing found.

        It sees the objects that cast shadows; the other queries see those that are visible, see `set_visibility`.

        Parameters
        ----------
        rays : (..., 6) array_like, float32 or float64
            As in `cast_rays`.
        directions : (..., 3) array_like, optional
            As in `cast_rays`.
        t_near, t_far : float
            Only crossings with t in [t_near, t_far] count.
        coherent : bool, optional
            As in `cast_rays`. Rays from neighbouring points to one light are coherent. The result is the same.
        certify : bool
            Returns instead what is proven. The conditions of `cast_rays` hold for the objects that cast shadows.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        (...) bool array, or uint8 array
            True if the ray crosses something. With `certify`, 1 for a ray that is proven to cross a surface, 0 for one
            that is proven to cross none, and 2 for one that is undecided.

        Raises
        ------
        ValueError, TypeError
            As in `cast_rays`.
        """
        return super().test_occlusions(rays, directions, t_near, t_far, coherent, certify, progress)

    def list_intersections(
        self,
        rays: ArrayLike,
        directions: ArrayLike | None = None,
        *,
        t_near: float = 0.0,
        t_far: float = math.inf,
        progress: Progress = None,
    ) -> Crossings:
        """All crossings of each ray with the scene, in the order of t.

        Each crossing is listed once, even on a face between cells, or on an edge or a corner of triangles. The
        crossings of a closed isosurface, for example one with ``closed=True``, alternately enter and leave.

        Parameters
        ----------
        rays : (..., 6) array_like, float32 or float64
            As in `cast_rays`; ray i is the i-th in C order.
        directions : (..., 3) array_like, optional
            As in `cast_rays`.
        t_near, t_far : float
            Only crossings with t in [t_near, t_far] count.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        Crossings
            For N rays and M crossings. The crossings of ray i are the items from ``ray_splits[i]`` to ``ray_splits[i +
            1]``.

            ``ray_splits``: (N + 1,) int64. ``ray_ids``: (M,) int64. ``t_hit``: (M,) float64. ``geometry_ids``: (M,)
            uint32. ``primitive_ids``: (M,) uint64, as in `cast_rays`. ``primitive_uvs``: (M, 2) float32, weights of a
            triangle's second and third corner, 0 for isosurfaces. ``primitive_normals``: (M, 3) float64, as in
            `cast_rays`. ``positions``: (M, 3) float64, world space. ``entering``: (M,) bool, whether the ray goes to
            the inner side, <normal, direction> < 0.

        Raises
        ------
        ValueError, TypeError
            As in `cast_rays`.

        Examples
        --------
        >>> import numpy as np
        >>> import isospline
        >>> z, y, x = np.mgrid[-8:9, -8:9, -8:9]
        >>> volume = isospline.Volume(np.sqrt(x**2 + y**2 + z**2), origin=(-8, -8, -8))
        >>> scene = isospline.Scene([isospline.Isosurface(volume, 5.0, inside="below")])
        >>> crossings = scene.list_intersections([(-20, 0, 0, 1, 0, 0)])
        >>> np.round(crossings["t_hit"]).tolist(), crossings["entering"].tolist()
        ([15.0, 25.0], [True, False])
        """
        return super().list_intersections(rays, directions, t_near, t_far, progress)

    @overload
    def count_intersections(
        self,
        rays: ArrayLike,
        directions: ArrayLike | None = None,
        *,
        t_near: float = 0.0,
        t_far: float = math.inf,
        certify: Literal[False] = False,
        progress: Progress = None,
    ) -> NDArray[np.int32]: ...

    @overload
    def count_intersections(
        self,
        rays: ArrayLike,
        directions: ArrayLike | None = None,
        *,
        t_near: float = 0.0,
        t_far: float = math.inf,
        certify: Literal[True],
        progress: Progress = None,
    ) -> NDArray[np.uint8]: ...

    def count_intersections(
        self,
        rays: ArrayLike,
        directions: ArrayLike | None = None,
        *,
        t_near: float = 0.0,
        t_far: float = math.inf,
        certify: bool = False,
        progress: Progress = None,
    ) -> NDArray[Any]:
        """The number of crossings of each ray with the scene.

        Parameters
        ----------
        rays, directions, t_near, t_far
            As in `list_intersections`.
        certify : bool
            Returns instead whether the number is proven to be odd; for the scenes of `cast_rays` with `certify`.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        (...) int32 array, or uint8 array
            The number of crossings. With `certify`, 0 for a number that is proven to be even, 1 for one that is proven
            to be odd, and 2 for one that is undecided, because an end of the ray, or of its part in the volume, is on a
            surface to within rounding.

        Raises
        ------
        ValueError, TypeError
            As in `cast_rays`.
        """
        return super().count_intersections(rays, directions, t_near, t_far, certify, progress)

    def secondary_rays(
        self, rays: ArrayLike, hits: dict[str, NDArray[Any]], directions: ArrayLike
    ) -> NDArray[np.float64]:
        """Rays that leave the surface at hits of other rays.

        A ray that begins exactly at a hit would often hit the same surface again because of rounding, which is known as
        shadow acne. These rays begin a small distance off the surface, on the side that they go to. The distance is a
        proven bound on the rounding, and needs no parameter: about 1e-13 to 1e-11 of a voxel for isosurfaces, and about
        1e-13 of the scene's size for meshes.

        Parameters
        ----------
        rays : (..., 6) array_like, world units
            The rays that were given to `cast_rays`.
        hits : Hits
            The result of `cast_rays`, with its default outputs in float64. Every ray must have hit.
        directions : (..., 3) array_like
            Directions of the new rays in world space, one for each hit; any length except zero.

        Returns
        -------
        (..., 6) float64 array
            Rays for `cast_rays` and `test_occlusions`: origin and direction, world units.

        Raises
        ------
        ValueError
            For shapes that do not fit, a ray that missed, hits in float32 or without one of these outputs, ids that the
            scene does not have, and directions that are zero or not finite.

        Examples
        --------
        >>> import numpy as np
        >>> import isospline
        >>> field = isospline.volumes.sphere(0.7)
        >>> volume = field.volume(32)
        >>> scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
        >>> rays = np.array([(0, -2, 0, 0, 1, 0.1), (0, -2, 0.3, 0, 1, 0)])
        >>> hits = scene.cast_rays(rays)
        >>> scene.test_occlusions(scene.secondary_rays(rays, hits, hits["primitive_normals"]))
        array([False, False])
        """
        return super().secondary_rays(rays, hits, directions)
