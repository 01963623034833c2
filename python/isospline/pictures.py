"""Defaults of pictures, also in the viewer: colours, a background, and closed solids."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import _core

#: Colours of surfaces and meshes in the order in which they are added.
COLORS = ("#d9c7a8", "#c8553d", "#588b8b", "#93b7be", "#8d6a9f", "#e0a458", "#5b7553", "#7d8597")
#: The background.
BACKGROUND = "#e8ebef"


#: If only a file is given, pieces of a solid count as noise if they have fewer inside cells than this fraction of the
#: largest piece's.
SPECK = 0.01

# Hounsfield units: air, with the rounding and the noise of scanners, and water.
_AIR, _WATER = (-1100, -900), 0


def default_levels(suggested: list[float], minimum: float, patient: bool) -> tuple[float, float | None]:
    """The level of a picture for which none was given, and the level of the patient's body, or None.

    The first level is the first of the suggested ones. For a CT of a patient, in which air has -1000 Hounsfield units,
    it is the first one above water, which shows bones. The lowest suggested level then separates the body from air, if
    it is below water.
    """
    is_ct = patient and _AIR[0] <= minimum <= _AIR[1]
    above_water = [level for level in suggested if level > _WATER]
    if not (is_ct and above_water):
        return suggested[0], None
    return above_water[0], min(suggested) if min(suggested) < _WATER else None


def body_mask(volume: _core.Volume, level: float) -> NDArray[np.bool_]:
    """The samples of the largest piece at the level of the body: the patient without the table, which is apart."""
    return _core.Isosurface(volume, level, largest=1).to_mask()


def count_pieces(surface: _core.Isosurface) -> tuple[int, int]:
    """The number of components of the solid that are not specks of noise, and the number of all components.

    Only cells that are completely inside count: a layer of noise has many cells but hardly any inside.
    """
    inside = surface.components().inside_counts
    return int((inside >= SPECK * inside.max(initial=0)).sum()), len(inside)


def color_of(place: int) -> str:
    """The colour of the object with this index, from 0 on."""
    return COLORS[place % len(COLORS)]


def closed_surface(volume: _core.Volume, level: float) -> _core.Isosurface:
    """The isosurface at a level, closed at the border of the volume."""
    return _core.Isosurface(volume, level, closed=True)
