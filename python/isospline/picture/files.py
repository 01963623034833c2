"""What is shown of a file if nothing is said."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

from ..base.parameters import check_path
from ..io import VolumeData, read_volume
from ..io.label_map import count_of_labels
from ..labels.labels import Labels
from ..levels import suggest_levels
from ..scene import Isosurface, Scene, Volume
from ..scene.conversions import as_volume
from ..scene.mesh_files import MESH_SUFFIXES, read_mesh
from ..store.detail import Scales, is_store
from ..suggest.presentation import present, suggested_surface


def scene_of_file(path: str | os.PathLike[str], level: float | None) -> Scene:
    """The scene of a mesh, a label map, a volume or the overview of a store, by default at the suggested level."""
    check_path(path)
    if os.fspath(path).lower().endswith(MESH_SUFFIXES):
        if level is not None:
            raise ValueError(f"level: expected none with the file of a mesh, got {level:g}")
        return Scene([read_mesh(path)])
    if is_store(path):
        scales = Scales(path)
        return Scene([surface_of(scales.volume(scales.overview), level)])
    data = read_volume(path)
    if level is None and count_of_labels(data.data) is not None:
        return Labels.read(path).scene(closed=True)
    return Scene([surface_of(data, level)])


def surface_of(shown: Any, level: float | None) -> Isosurface:
    """The isosurface of a Volume, VolumeData or array at a level, closed at the border; by default a suggested one."""
    volume = as_volume(shown, "scene")
    if level is not None:
        return Isosurface(volume, level, closed=True)
    if not isinstance(shown, Volume):  # the values of the volume are those of the samples but for rounding
        samples = shown.data if isinstance(shown, VolumeData) else shown
        if levels := suggest_levels(samples):
            present(volume, levels, float(samples.min()))
    return suggested_surface(volume)


def in_detail(scene: Scene, path: Any, cameras: Iterable[Any], size: tuple[int, int]) -> Scene:
    """The scene of a file with the scale of a store that pictures need; other scenes as they are."""
    if not isinstance(path, (str, os.PathLike)) or not is_store(path):
        return scene
    scales = Scales(path)
    scale = scales.choose(cameras, size)
    if scale == scales.overview:
        return scene
    (level,) = (item.level for item in map(scene.object, scene.ids) if isinstance(item, Isosurface))
    return Scene([surface_of(scales.volume(scale), level)])
