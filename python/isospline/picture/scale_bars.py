"""Scale bars in pictures: a length of 1, 2 or 5 times a power of ten, in a corner that is free of objects."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cameras import ProjectionPlaneCamera
from .annotations import (
    BORDER,
    Box,
    Covered,
    Drawing,
    best_box,
    draw_panel,
    font_for,
    line_height,
    round_down,
    text_width,
)
from .cameras import Extent
from .image import Image

# The largest length of a scale bar, and the largest height that is left free for it, as parts of the picture.
_LONGEST, _HIGHEST = 0.25, 1 / 3
# Lines through the inner corner of a scale bar that may separate it from the objects.
_LINES = 8


def scale_bar(camera: Any, size: tuple[int, int], extent: Extent) -> tuple[float, float]:
    """The length of a scale bar in world units, 1, 2 or 5 times a power of ten, and in pixels.

    Equal lengths have equal numbers of pixels at one depth. It is that of the target, or of the middle of the objects
    for a camera without a target, as its projection plane may be anywhere.
    """
    target = _middle(camera, extent) if isinstance(camera, ProjectionPlaneCamera) else camera.target
    ndc = camera.world_to_ndc(size)
    pixels_per_unit = size[0] * (ndc[0, :3] @ camera.world_to_camera[0, :3]) / (ndc[3] @ [*target, 1])
    length = round_down(_LONGEST * size[0] / pixels_per_unit)
    return length, length * pixels_per_unit


def _middle(camera: ProjectionPlaneCamera, extent: Extent) -> NDArray[np.float64]:
    """A point in the middle of the depths of all objects in front of the eye, or in the plane if there are none."""
    forward, offset = camera.world_to_camera[2, :3], camera.world_to_camera[2, 3]
    near, far = extent(forward[None])[0] + offset
    if far <= 0:
        return camera.corner
    return camera.eye + (max(near, 0.0) + far) / 2 * forward


class ScaleBar:
    """A scale bar with its length above, in the lower left corner of a picture unless it would hide an object there."""

    def __init__(self, size: tuple[int, int], camera: Any, extent: Extent, unit: str):
        self._size = size
        length, self._pixels = scale_bar(camera, size, extent)
        self._text = f"{length:g} {unit}".strip()
        font = font_for(size)
        text = text_width(font, self._text)
        self._border, self._thickness = round(BORDER * min(size)), max(2, round(size[1] / 160))
        #: Free pixels around it.
        self._gap = max(2, self._border // 2)
        # The text may be longer than the bar.
        self._indent = math.ceil(max(0.0, text - self._pixels) / 2)
        self._wide = math.ceil(max(self._pixels, text))
        self._high = math.ceil(1.8 * self._thickness + line_height(font) / 1.4)

    def part(self) -> float:
        """The part of the picture's height that is left free below the objects for it; 0 in a tiny picture."""
        part = (self._border + self._high + self._gap) / self._size[1]
        return part if part <= _HIGHEST else 0.0

    def is_free(self, camera: Any, extent: Extent) -> bool:
        """Whether a line separates its lower left corner from all objects, whose extent in directions is given."""
        width, height = self._size
        column = (self._border + self._wide + self._gap) / width
        row = 1 - (self._border + self._high + self._gap) / height
        angles = np.linspace(0, math.pi / 2, _LINES)
        right, above = np.cos(angles) / height, np.sin(angles) / width
        # A point is on the objects' side if right * (x - column) + above * (row - y) is positive, where x = X / W and
        # y = Y / W are its place in the picture; times W, it is linear in the point.
        x, y, _, w = camera.world_to_ndc(self._size)
        planes = np.outer(right, x) - np.outer(above, y) + np.outer(above * row - right * column, w)
        return bool((extent(planes[:, :3])[:, 0] + planes[:, 3] > 0).any())

    def draw(self, image: Image, taken: Iterable[Box] = (), covered: Covered | None = None) -> None:
        """Draw it into the lower left corner, or the one where it hides least; `taken` is where other marks are."""
        width, height = self._size
        left, top = self._border, height - self._border - self._high
        if covered is not None:
            corners = [(x, y) for y in (top, self._border) for x in (left, width - self._border - self._wide)]
            boxes = [(x, y, self._wide, self._high) for x, y in corners if x >= left and y >= self._border]
            left, top, *_ = best_box(boxes, taken, covered) if boxes else (left, top)
            draw_panel(image, (left - 4, top - 4, self._wide + 8, self._high + 8), covered)
        bottom, left = top + self._high, left + self._indent
        drawn = Drawing(image)
        drawn.text(left + self._pixels / 2, bottom - 1.8 * self._thickness, self._text, "ms")
        drawn.bar(left, left + self._pixels, bottom - self._thickness, bottom)
        drawn.finish()
