"""Pixels of images: over black, in bands of rows, and without noise."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..colors import linear_to_srgb, srgb_to_linear


def over_black(image: Any) -> NDArray[np.uint8]:
    """Red, green and blue of an image, of 8 bits over black, (height, width, 3)."""
    srgb = image.to_srgb()
    color, alpha = srgb[..., :3], srgb[..., 3:]
    if alpha.min() == 255:
        return np.ascontiguousarray(color)
    over = np.empty(color.shape, np.uint8)
    for rows in row_bands(srgb):
        linear = srgb_to_linear(color[rows] / 255) * (alpha[rows] / 255)
        over[rows] = np.rint(255 * linear_to_srgb(linear))
    return over


def row_bands(array: NDArray[Any]) -> Iterator[slice]:
    """Slices of several rows that cover an image, so that Ctrl-C can stop the work between them."""
    return (slice(first, first + 64) for first in range(0, len(array), 64))


def denoiser() -> Callable[..., NDArray[np.float32]]:
    """The function that removes noise from colours."""
    try:
        from pyoidn import denoise  # type: ignore[import-not-found, unused-ignore]
    except ImportError as error:
        raise ImportError("Image.denoise needs Open Image Denoise: pip install pyoidn") from error
    return denoise
