"""Stores: volumes larger than memory, as chunks of spline coefficients on disk.

`convert` writes a store, `open_volume` opens its volume, and `read_metadata` reads its description.
"""

from .converting import convert
from .detail import scale_for
from .layout import read_ranges
from .metadata import ScaleMetadata, StoreMetadata, read_metadata
from .series import time_steps
from .volume import open_volume

__all__ = [
    "ScaleMetadata",
    "StoreMetadata",
    "convert",
    "open_volume",
    "read_metadata",
    "read_ranges",
    "scale_for",
    "time_steps",
]
