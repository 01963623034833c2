"""The paper's baseline, and settings of experiments that no picture needs.

References
----------
P. Thévenaz, M. Unser, "High-quality isosurface rendering with exact gradient", ICIP 2001.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from ._core import Isosurface, VoxelHopper
from .base.results import HopStatistics
from .base.signatures import explained

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ._core import Volume
    from .io import VolumeData

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
