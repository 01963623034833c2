"""Stores: volumes larger than memory, as chunks of spline coefficients on disk.

`prefilter_to` writes a store, `open_volume` opens its volume, and `read_metadata` reads its description.
"""

from .convert import prefilter_to
from .detail import level_of_detail_for
from .layout import read_ranges
from .metadata import LevelMetadata, StoreMetadata, read_metadata
from .series import time_steps
from .volume import open_volume

__all__ = [
    "LevelMetadata",
    "StoreMetadata",
    "level_of_detail_for",
    "open_volume",
    "prefilter_to",
    "read_metadata",
    "read_ranges",
    "time_steps",
]
