"""Volumes from files: each format has its own module, and `read_volume` reads all of them."""

from .read import read_volume
from .volume_data import VolumeData

__all__ = ["VolumeData", "read_volume"]
