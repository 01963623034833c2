"""Messages and pictures as bytes: JPEG during movement, PNG for lossless pictures."""

from __future__ import annotations

import json

import numpy as np

from ..picture.pixels import encoded


def packed(about, content):
    """A binary message: the length of its JSON header, the header, padding to a multiple of 4, the content."""
    header = json.dumps(about).encode()
    header += b" " * (-len(header) % 4)
    return len(header).to_bytes(4, "little") + header + content


def encode_jpeg(pixels, quality=85):
    """A JPEG file of opaque (height, width, 4) pixels, written by libjpeg-turbo if simplejpeg is installed."""
    try:
        import simplejpeg
    except ImportError:
        return encoded("jpeg", np.ascontiguousarray(pixels[..., :3]), quality=quality)
    return simplejpeg.encode_jpeg(np.ascontiguousarray(pixels), quality=quality, colorspace="RGBA")


def encode_png(pixels):
    """A PNG file of opaque (height, width, 4) pixels, with the fastest compression."""
    return encoded("png", np.ascontiguousarray(pixels[..., :3]), compress_level=1)
