"""The paper's baseline, and settings of experiments that no picture needs.

References
----------
P. Thévenaz, M. Unser, "High-quality isosurface rendering with exact gradient", ICIP 2001.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Literal

from . import _core
from .base.results import HopStatistics
from .base.signatures import explained
from .scene import Isosurface
from .scene.public import public

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, DTypeLike, NDArray

    from .base.results import Hits
    from .base.types import HitOutput, Progress
    from .io import VolumeData
    from .scene import Volume

__all__ = ["HopStatistics", "VoxelHopper", "isosurface"]


@explained
def isosurface(
    volume: Volume | VolumeData | NDArray[Any],
    level: float,
    *,
    method: Literal["exact", "reference", "bracket"] = "exact",
    prune_depth: int = 2,
    prune_border: bool = True,
    **options: Any,
) -> Isosurface:
    """Make an isosurface with another root finder, or another pruning of its shell.

    Parameters
    ----------
    volume, level
        As in `Isosurface`.
    method : {"exact", "reference", "bracket"}
        How rays find the surface in a cell. "exact" misses no root. "reference" is the same in float64 throughout, and
        slow. "bracket" is the paper's method: opposite signs at the ends of the cell, then Brent's method.
    prune_depth : int
        Levels of subdivision by which the shell is pruned, 0 (no pruning) to 6.
    prune_border : bool
        If False, cells on the border of the volume are not pruned, as in the paper.
    **options
        Options of `Isosurface`.

    Returns
    -------
    Isosurface

    Raises
    ------
    ValueError
        For another method, a `prune_depth` out of range, and as `Isosurface` does.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.torus()
    >>> paper = isospline.research.isosurface(field.volume(24), field.level, method="bracket", prune_border=False)
    >>> paper
    <Isosurface(level=0, inside="above", method="bracket")>
    """
    return Isosurface(volume, level, **options)._for_research(method, prune_depth, prune_border)


@public
class VoxelHopper(_core.VoxelHopper):
    r"""Plain voxel hopping, as in the paper [1]_: the baseline for a `Scene`.

    A ray hops from voxel to voxel through a dense binary array. In voxels of the shell, the surface's own method
    intersects it. The hits are the same as in a scene of this surface.

    Parameters
    ----------
    surface : Isosurface
        A change of its level takes effect at the next query.
    strides : bool
        Whether empty bricks of 8 x 8 x 8 voxels are crossed in one step, as the octree that the paper suggests does.

    Raises
    ------
    ValueError
        For a surface that is capped or closed.

    Notes
    -----
    The paper observes that the average hop is "about 0.653" of a voxel's edge long, and leaves the exact value to the
    reader. Over lines that are uniform and isotropic it is the mean chord of a unit cube, by Cauchy's formula

    .. math:: \frac{4 V}{S} = \frac{4 \cdot 1}{6} = \frac{2}{3}.

    Parallel lines of direction d have the mean chord V / (area of the shadow) = :math:`1 / (|d_x| + |d_y| + |d_z|)`,
    between 0.577 along a diagonal and 1 along an axis. A picture looks along few directions, so its average differs.

    References
    ----------
    .. [1] P. Thévenaz, M. Unser, "High-quality isosurface rendering with exact gradient", ICIP 2001, sections 3 and 4.

    Examples
    --------
    >>> import numpy as np
    >>> import isospline
    >>> z, y, x = np.mgrid[-8:9, -8:9, -8:9]
    >>> volume = isospline.Volume(np.sqrt(x**2 + y**2 + z**2), origin=(-8, -8, -8))
    >>> hopper = isospline.research.VoxelHopper(isospline.Isosurface(volume, 5.0, inside="below"))
    >>> bool(abs(hopper.cast_rays([(-20, 0, 0, 1, 0, 0)])["t_hit"][0] - 15.0) < 0.01)
    True
    >>> round(hopper.statistics["mean_hop_length"], 6)
    1.0
    """

    __slots__ = ()

    def __init__(self, surface: Isosurface, *, strides: bool = False) -> None:
        super().__init__(surface, strides)

    def cast_rays(
        self,
        rays: ArrayLike,
        *,
        t_near: float = 0.0,
        t_far: float = math.inf,
        outputs: Iterable[HitOutput] = ("t_hit", "geometry_ids", "primitive_ids", "primitive_normals"),
        dtype: DTypeLike | None = None,
        progress: Progress = None,
    ) -> Hits:
        """First crossing of each ray with the surface.

        Parameters
        ----------
        rays : (..., 6) array_like, float32 or float64
            Origin and direction, ox oy oz dx dy dz, in world units. Directions need not have length one.
        t_near, t_far : float
            Only crossings with t in [t_near, t_far] count. t is in units of the direction's length.
        outputs : sequence of str
            Names of the arrays to return, as in `Scene.cast_rays`.
        dtype : dtype, optional
            Type of arrays of real numbers, float64 or float32; by default that of the rays.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        Hits
            As in `Scene.cast_rays`; the geometry id is 0.

        Raises
        ------
        ValueError
            If `rays` has another shape, an origin or direction is not finite, a direction is zero, the limits are NaN,
            an output name is unknown, or `dtype` is another type.
        TypeError
            If `rays` does not hold real numbers.
        """
        return super().cast_rays(rays, t_near, t_far, outputs, dtype, progress)

    @property
    def statistics(self) -> HopStatistics:
        """HopStatistics: of the rays of the last `cast_rays`.

        ``hops``: from one voxel to the next. ``strides``: across empty bricks. ``evaluated_cells``: cells of the shell
        in which the surface was searched. ``mean_hop_length``: of hops and strides, in voxels, or 0 without any. Hops
        end on the faces of voxels, so the part from the last face to the hit does not count.
        """
        return super().statistics

    @property
    def surface(self) -> Isosurface:
        """The surface."""
        return super().surface

    @property
    def strides(self) -> bool:
        """Whether empty bricks are crossed at once."""
        return super().strides

    @property
    def memory(self) -> int:
        """Bytes held by the binary array and its index, at the current level."""
        return super().memory

    def __reduce__(self) -> Any:
        return _hopper, (self.surface, self.strides)


def _hopper(surface, strides):
    return VoxelHopper(surface, strides=strides)
