"""Scenes of anything that can be shown."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from .. import _core
from ..base.mistakes import sentence
from ..interop.conversions import as_volume
from ..io.volume_data import VolumeData
from ..suggest.presentation import suggested_surface


def as_scene(shown: Any, level: float | None = None) -> _core.Scene:
    """A scene of isosurfaces and meshes, of one of them, or of the isosurface of a volume.

    Parameters
    ----------
    shown : Scene, Isosurface, Mesh, Volume, VolumeData, (nz, ny, nx) array, or sequence of isosurfaces and meshes
    level : float, optional
        Of a volume; by default the level and the pieces that the command `isospline render` chooses.
    """
    is_array = isinstance(shown, np.ndarray)
    if isinstance(shown, (_core.Volume, VolumeData)) or (is_array and shown.ndim in (3, 4)):
        volume = as_volume(shown, "scene")
        return _core.Scene([suggested_surface(volume) if level is None else closed_surface(volume, level)])
    if level is not None:
        raise ValueError(
            f"level: cannot be combined with a {type(shown).__name__}, which has one; "
            "did you mean surface.level = ... or render(volume, level=...)?"
        )
    if isinstance(shown, _core.Scene):
        return shown
    if shown is None or is_array or isinstance(shown, (str, os.PathLike, Mapping)):
        raise TypeError(sentence("scene", SHOWN, shown))
    try:
        return _core.Scene(shown)
    except TypeError as error:
        message = str(error).replace("objects: expected isosurfaces and meshes", f"scene: expected {SHOWN}")
        raise TypeError(message.replace("objects: ", "scene: ")) from None


def closed_surface(volume: _core.Volume, level: float) -> _core.Isosurface:
    """The isosurface at a level, closed at the border of the volume."""
    return _core.Isosurface(volume, level, closed=True)


#: What can be shown.
SHOWN = "a Scene, an Isosurface, a Mesh, a list of them, a Volume or an array"
