"""Legends in pictures: the names of objects beside their colours."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..base.values import part
from .annotations import BORDER, Drawing, blend
from .image import Image

#: A name, its linear colour, and its opacity.
Row = tuple[str, NDArray[np.float64], float]


def legend_rows(scene: _core.Scene, look: Any) -> list[Row]:
    """The rows of the legend of a scene whose light is resolved: visible objects with a name, each name once."""
    rows: dict[str, Row] = {}
    for id, item, _, visibility in scene._placed_objects():
        if item.name and visibility["visible"]:
            rows.setdefault(item.name, (item.name, *_color_of(look, id)))
    if not rows:
        raise ValueError('legend: expected objects with names, such as Isosurface(..., name="bone"), got none')
    return list(rows.values())


def _color_of(look: Any, id: int) -> tuple[NDArray[np.float64], float]:
    """The colour of an object, and its opacity."""
    if hasattr(look, "materials"):  # of path tracers and studios
        each = look.materials.get(id, look.material)
    else:
        each = look.get(id, _core.Phong()) if isinstance(look, Mapping) else look
    color = None if each is None else part(each, "surface_color" if isinstance(each, _core.Outline) else "color")
    if color is None:
        color = 0.8 if isinstance(look, _core.PathTracer) else 1.0
    if not isinstance(color, (np.ndarray, float)):  # a rule: the middle of its map
        map = color._cmap() if hasattr(color, "_cmap") else np.full((1, 3), 0.5)
        color = map[len(map) // 2]
    return np.broadcast_to(np.asarray(color, dtype=float), (3,)), getattr(each, "opacity", 1.0)


def draw_legend(image: Image, rows: list[Row]) -> None:
    """Draw a legend into the upper left corner of a picture, in place."""
    if not rows:
        return
    width, height = image.size
    drawn = Drawing(image)
    border, line = round(BORDER * min(width, height)), drawn.line_height
    side = max(4, round(0.6 * line))
    swatches = []
    for number, (name, color, opacity) in enumerate(rows):
        top = border + round(number * line)
        drawn.bar(border - 1, border + side + 1, top - 1, top + side + 1)
        drawn.text(border + 1.5 * side, top + side / 2, name, "lm")
        swatches.append((np.s_[top : top + side, border : border + side], color, opacity))
    drawn.finish()
    for area, color, opacity in swatches:
        # Over white: the frame below the swatch is opaque.
        over = opacity * color + (1 - opacity)
        blend(image, area, np.ones((height, width))[area], over)
