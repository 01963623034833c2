"""Scenes of anything that can be shown."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..base.mistakes import sentence
from ..io.volume_data import VolumeData
from ..scene import Scene, Volume
from .files import scene_of_file, surface_of


def as_scene(shown: Any, level: float | None = None) -> Scene:
    """A scene of isosurfaces and meshes, of one of them, of the isosurface of a volume, or of a file.

    Parameters
    ----------
    shown : Scene, Isosurface, Mesh, Volume, VolumeData, (nz, ny, nx) array, path, or sequence of isosurfaces and meshes
    level : float, optional
        Of a volume; by default the level and the pieces that the command `isospline render` chooses.
    """
    if isinstance(shown, (str, os.PathLike)):
        return scene_of_file(shown, level)
    is_array = isinstance(shown, np.ndarray)
    if isinstance(shown, (Volume, VolumeData)) or (is_array and shown.ndim in (3, 4)):
        return Scene([surface_of(shown, level)])
    if level is not None:
        raise ValueError(
            f"level: cannot be combined with a {type(shown).__name__}, which has one; "
            "did you mean surface.level = ... or render(volume, level=...)?"
        )
    if isinstance(shown, Scene):
        return shown
    if shown is None or is_array or isinstance(shown, Mapping):
        raise TypeError(sentence("scene", SHOWN, shown))
    try:
        return Scene(shown)
    except TypeError as error:
        message = str(error).replace("objects: expected isosurfaces and meshes", f"scene: expected {SHOWN}")
        raise TypeError(message.replace("objects: ", "scene: ")) from None


#: What can be shown.
SHOWN = "a Scene, an Isosurface, a Mesh, a list of them, a Volume, an array or a file"
