"""Windows of pictures: splitting and joining."""

from __future__ import annotations

import itertools
import operator
from typing import Any

import numpy as np

from .. import _core
from ..base.mistakes import sentence
from ..picture.image import Image

Window = tuple[int, int, int, int]


def checked_window(crop: Any, size: Any) -> Window:
    """The window of a crop, or of the whole picture."""
    width, height = _whole_numbers(size, "size", 2)
    if min(width, height) < 1:
        raise ValueError(f"size: expected at least 1 x 1 pixels, got {width} x {height}")
    if crop is None:
        return 0, 0, width, height
    x, y, columns, rows = _whole_numbers(crop, "crop", 4)
    if min(x, y) < 0 or min(columns, rows) < 1 or x + columns > width or y + rows > height:
        raise ValueError(
            f"crop: expected columns and rows within {width} x {height} pixels, got {columns} x {rows} from {x}, {y}"
        )
    return x, y, columns, rows


def _whole_numbers(values, parameter, count):
    try:
        found = tuple(map(operator.index, values))
    except TypeError:
        found = ()
    if len(found) != count:
        raise TypeError(sentence(parameter, f"{count} whole numbers", values))
    return found


def split(window: Window, tile_size: Any) -> list[Window]:
    """Split a window into windows of at most `tile_size`, row by row."""
    step_x, step_y = _whole_numbers(tile_size, "tile_size", 2)
    if min(step_x, step_y) < 1:
        raise ValueError(f"tile_size: expected at least 1 x 1 pixels, got {step_x} x {step_y}")
    first_x, first_y, width, height = window
    return [
        (first_x + x, first_y + y, min(step_x, width - x), min(step_y, height - y))
        for y, x in itertools.product(range(0, height, step_y), range(0, width, step_x))
    ]


class Canvas:
    """The image of a window, joined from images of smaller windows."""

    def __init__(self, window: Window) -> None:
        self._window = window
        self.layers: dict[str, Any] = {}
        self.covered = 0
        self._state: dict[str, Any] = {}

    def paste(self, image: Image) -> None:
        """Copy an image to its place."""
        state = image._arrays.__getstate__()
        x, y, width, height = image.crop
        left, top = x - self._window[0], y - self._window[1]
        for name, layer in state["layers"].items():
            pixels = layer.reshape(height, width, -1)
            if name not in self.layers:
                self.layers[name] = np.empty((self._window[3], self._window[2], pixels.shape[2]), np.uint8)
            self.layers[name][top : top + height, left : left + width] = pixels
        self.covered += state["covered_count"]
        self._state = state

    def image(self) -> Image:
        """The whole image."""
        x, y, width, height = self._window
        state = self._state | {"first": (x, y), "size": (width, height), "covered_count": self.covered}
        return image_of(state, {name: layer.ravel() for name, layer in self.layers.items()})


def image_of(state: dict[str, Any], layers: dict[str, Any]) -> Image:
    """An image with the bytes of these layers; `state` has its other attributes."""
    arrays = _core.Image.__new__(_core.Image)
    arrays.__setstate__(state | {"layers": layers})
    return Image(arrays)
