"""Pixels of images: of arrays, over black, in bands of rows, in files, and without noise."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.parameters import printable
from ..base.system import whole_file
from ..colors import linear_to_srgb, srgb_to_linear


class Pixels:
    """An array of pixels, (height, width, 3 or 4) uint8 sRGB, with the methods of an `Image` that videos need."""

    def __init__(self, srgb: NDArray[np.uint8]):
        opaque = np.full((*srgb.shape[:2], 4 - srgb.shape[2]), 255, np.uint8)
        self._srgb = np.concatenate([srgb, opaque], axis=-1)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self._srgb.shape[1], self._srgb.shape[0]

    def to_srgb(self) -> NDArray[np.uint8]:
        """The pixels with alpha."""
        return self._srgb

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write a PNG file, completely or not at all."""
        if not os.fspath(path).lower().endswith(".png"):
            raise ValueError(f"path: expected a name that ends in .png for arrays, got {printable(path)!r}")
        write_bytes(path, encoded("png", self._srgb))


def encoded(format: str, pixels: NDArray[np.uint8], **options: Any) -> bytes:
    """The bytes of a file of pixels, by Pillow."""
    import PIL.Image

    file = io.BytesIO()
    PIL.Image.fromarray(pixels).save(file, format, **options)
    return file.getvalue()


def write_bytes(path: str | os.PathLike[str], content: bytes) -> None:
    """Write a file, completely or not at all."""
    with whole_file(path) as temporary, open(temporary, "wb") as file:
        file.write(content)


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
