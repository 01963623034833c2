"""Legends in pictures: the names of objects beside their colours."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..base.values import part
from ..scene import Scene
from .annotations import (
    BORDER,
    Box,
    Covered,
    Drawing,
    best_box,
    blend,
    draw_panel,
    font_for,
    line_height,
    shown_looks,
    text_width,
)
from .image import Image

#: A name, its linear colour, and its opacity.
Row = tuple[str, NDArray[np.float64], float]


def legend_rows(scene: Scene, look: Any) -> list[Row]:
    """The rows of the legend of a scene whose light is resolved: visible objects with a name, each name once."""
    rows: dict[str, Row] = {}
    for id, each in shown_looks(scene, look).items():
        if name := scene.object(id).name:
            rows.setdefault(name, (name, *_color_of(look, each)))
    if not rows:
        raise ValueError('legend: expected objects with names, such as Isosurface(..., name="bone"), got none')
    return list(rows.values())


def _color_of(look: Any, each: Any) -> tuple[NDArray[np.float64], float]:
    """The colour of an object with a look of its own in a light, and its opacity."""
    color = None if each is None else part(each, each._surface_parameter)
    if color is None:
        color = 0.8 if isinstance(look, _core.PathTracer) else 1.0
    if not isinstance(color, (np.ndarray, float)):  # a rule: the middle of its map
        map = part(color, "cmap") if hasattr(color, "cmap") else np.full((1, 3), 0.5)
        color = map[len(map) // 2]
    return np.broadcast_to(np.asarray(color, dtype=float), (3,)), getattr(each, "opacity", 1.0)


class Legend:
    """Names beside their colours, in a corner of a picture; empty without rows."""

    def __init__(self, size: tuple[int, int], rows: list[Row]):
        self._size, self._rows = size, rows
        self.width = 0.0
        if not rows:  # most pictures: no font is loaded
            return
        font = font_for(size)
        self._border, self._line = round(BORDER * min(size)), line_height(font)
        self._side = max(4, round(0.6 * self._line))
        names = max(text_width(font, name) for name, *_ in rows)
        #: Of the swatches and names, in pixels, with a border.
        self.width = self._border + 1.5 * self._side + names

    def draw(self, image: Image, taken: Iterable[Box] = (), covered: Covered | None = None) -> list[Box]:
        """Draw it into the upper left corner, or where it hides least, and return its rectangle, if it has rows.

        `taken` is where other marks are.
        """
        if not self._rows:
            return []
        width, height = self._size
        high = round((len(self._rows) - 1) * self._line) + self._side
        left, top = self._border, self._border
        if covered is not None:
            corners = [
                (x, y)
                for y in (top, height - high - self._border)
                for x in (left, round(width - self.width))
                if x >= left and y >= top
            ]
            boxes = [(*corner, round(self.width), high) for corner in corners or [(left, top)]]
            left, top, *_ = best_box(boxes, taken, covered)
        box = left - 4, top - 4, round(self.width - self._border + 8), high + 8
        draw_panel(image, box, covered)
        drawn = Drawing(image)
        swatches = []
        for number, (name, color, opacity) in enumerate(self._rows):
            row = top + round(number * self._line)
            drawn.bar(left - 1, left + self._side + 1, row - 1, row + self._side + 1)
            drawn.text(left + 1.5 * self._side, row + self._side / 2, name, "lm")
            swatches.append((np.s_[row : row + self._side, left : left + self._side], color, opacity))
        drawn.finish()
        for place, color, opacity in swatches:
            # Over white: the frame below the swatch is opaque.
            over = opacity * color + (1 - opacity)
            blend(image, place, np.ones((height, width))[place], over)
        return [box]
