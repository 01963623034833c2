"""The marks of the pictures of a scene: a legend, a scale bar and colour bars."""

from __future__ import annotations

from typing import Any

from .. import _core
from .annotations import BORDER, annotated, color_bars, covered_pixels
from .cameras import camera_for
from .image import Image
from .legends import Legend, legend_rows

# The largest part of a picture's width for marks.
_MOST = 0.6


class Marks:
    """What is drawn into the pictures of a scene.

    Parameters
    ----------
    scene : Scene
    look : as `resolve` returns it
    size : (int, int)
        Width and height of the pictures.
    names : tuple of str
        The scale bar and the colour bars, as `check_annotations` returns them.
    legend : bool
        Whether there is a legend.
    unit : str, optional
        Of world coordinates; by default that of the scene.
    """

    def __init__(
        self,
        scene: _core.Scene,
        look: Any,
        size: tuple[int, int],
        names: tuple[str, ...],
        legend: bool,
        unit: str | None = None,
    ):
        self._scene, self._look, self._size, self._names = scene, look, size, names
        self._unit = unit_of(scene) if unit is None else unit
        self._rows = legend_rows(scene, look) if legend else []
        # The legend and colour bars are as large as objects, and may hide them.
        self._is_wide = bool(self._rows) or "colorbar" in names

    def __bool__(self) -> bool:
        return bool(self._names or self._rows)

    def space(self) -> tuple[float, float]:
        """The parts of a picture's width that a camera is to leave free on the left and on the right."""
        if not self._is_wide:
            return 0.0, 0.0
        bars = []
        if "colorbar" in self._names:
            camera = camera_for(self._scene, size=self._size)
            bars = color_bars(self._size, self._look, self._scene, camera, self._unit)
        right = sum(bar.width for bar in bars) / self._size[0] + BORDER if bars else 0.0
        left = Legend(self._size, self._rows).width / self._size[0]
        scale = min(1.0, _MOST / max(left + right, 1e-9))
        return left * scale, right * scale

    def draw(self, image: Image, camera: Any, *, is_fitted: bool) -> Image:
        """The image with its marks, where they hide least; beside the objects if the camera leaves `space` for them."""
        covered = covered_pixels(self._scene, camera, image.size) if self._is_wide and not is_fitted else None
        Legend(image.size, self._rows).draw(image, covered)
        return annotated(image, self._names, camera, self._scene, self._look, self._unit, covered)


def unit_of(scene: _core.Scene) -> str:
    """The unit of world coordinates: that of the volumes of a scene; empty if they differ, or do not tell it."""
    units = {item.volume.unit for _, item, *_ in scene._placed_objects() if isinstance(item, _core.Isosurface)}
    return units.pop() if len(units) == 1 else ""
