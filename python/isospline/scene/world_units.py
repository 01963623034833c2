"""The unit of length of a scene's world: that of the volumes of its isosurfaces."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import Isosurface, Scene
from ..base.units import ratio_of_units

# A transform that scales lengths by this factor or more, or by its inverse or less, converts them to another unit: any
# two units differ by more, and objects in one unit that are registered to each other by less.
_CONVERSION = 1.5


def converts(transform: NDArray[np.float64]) -> bool:
    """Whether a (4, 4) transform scales so much that its lengths are no longer in the unit of the object."""
    scale = np.cbrt(abs(np.linalg.det(transform[:3, :3])))
    return not 1 / _CONVERSION < scale < _CONVERSION


def unit_when_placed(item: Any, transform: NDArray[np.float64]) -> str:
    """The unit of an object of a scene; empty if it has none, or if its transform converts it to another one."""
    return item.volume.unit if isinstance(item, Isosurface) and not converts(transform) else ""


def world_unit(scene: Scene) -> str:
    """The unit that all objects of a scene with a unit have; empty if none has one, or if they differ."""
    return common_unit(units_in(scene))


def units_in(scene: Scene) -> list[str]:
    """The units of the objects of a scene that have one."""
    placed = [(item, transform) for _, item, transform, *_ in scene._placed_objects()]
    return [unit for each in placed if (unit := unit_when_placed(*each))]


def common_unit(units: list[str]) -> str:
    """The unit that all are, by any of its names; empty if they differ, or if one is."""
    return units[0] if units and all(each and ratio_of_units(each, units[0]) == 1 for each in units) else ""


def check_unit(unit: str, others: str, parameter: str, holder: str, what: str = "an isosurface") -> None:
    """Raise an error if a unit is another one than that of `holder`; an empty one is the same as any."""
    ratio = ratio_of_units(unit, others)
    if ratio == 1:
        return
    scale = "scale it" if ratio is None else f"scale it by {ratio:g}"
    raise ValueError(
        f"{parameter}: expected {what} in {others}, as {holder}, got one in {unit}: {scale}, in a Scene by its "
        f"transform, or by the spacing, the origin and the unit of its volume"
    )
