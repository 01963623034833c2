"""The marks of the pictures of a scene: a legend, a scale bar and colour bars."""

from __future__ import annotations

from typing import Any

from ..scene import Isosurface, Scene
from ..scene.world_units import common_unit, converts
from .annotations import BORDER, Box, Covered, color_bars
from .cameras import camera_beside, camera_for, cameras_around, extent_of
from .image import Image
from .legends import Legend, legend_rows
from .scale_bars import ScaleBar

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
        scene: Scene,
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

    def camera(self, **framing: Any) -> Any:
        """The camera of `camera_for` that shows the scene beside its marks."""
        return self._beside(lambda space: [camera_beside(space, self._scene, **framing)], steps=4)[0]

    def cameras(self, count: int, **framing: Any) -> list[Any]:
        """The cameras of `turntable_cameras` that show the scene beside its marks."""
        return self._beside(lambda space: cameras_around(space, self._scene, count, **framing), steps=1)

    def _beside(self, made, steps):
        """The cameras that `made` returns for a space, below the scene no more than the scale bar needs, in steps."""
        space = self._space()
        cameras = made((*space, 0.0))
        if "scale_bar" not in self._names:
            return cameras
        extent = extent_of(self._scene)
        for step in range(1, steps + 1):
            bars = [ScaleBar(self._size, camera, extent, self._unit) for camera in cameras]
            if all(bar.is_free(camera, extent) for bar, camera in zip(bars, cameras)):
                break
            cameras = made((*space, bars[0].part() * step / steps))
        return cameras

    def _space(self) -> tuple[float, float]:
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
        """The image with its marks, where they hide least; beside the objects if the camera was made for them."""
        covered = None if is_fitted else Covered(self._scene, camera, image.size)
        taken = self._draw_color_bars(image, camera, covered) if "colorbar" in self._names else []
        taken += Legend(image.size, self._rows).draw(image, taken, covered)
        if "scale_bar" in self._names:
            ScaleBar(image.size, camera, self._scene.extent, self._unit).draw(image, taken, covered)
        return image

    def _draw_color_bars(self, image: Image, camera: Any, covered: Covered | None) -> list[Box]:
        """Draw the colour bars on the right, or on the left if they hide less there; returns their rectangles."""
        bars = color_bars(image.size, self._look, self._scene, camera, self._unit)
        width, height = image.size
        wide = sum(bar.width for bar in bars)
        left = width * (1 - BORDER) - wide
        if covered is not None and (other := width * BORDER) < left:
            left = min(left, other, key=lambda place: covered.count((int(place), 0, int(wide), height)))
        boxes = []
        for bar in bars:
            boxes.append(bar.draw(image, left, covered))
            left += bar.width
        return boxes


def unit_of(scene: Scene) -> str:
    """The unit of world coordinates: that of the volumes of a scene; empty if they differ, or do not tell it."""
    placed = [(item, place) for _, item, place, _ in scene._placed_objects() if isinstance(item, Isosurface)]
    return common_unit([item.volume.unit for item, place in placed if not converts(place)])
