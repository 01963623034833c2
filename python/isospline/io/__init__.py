"""Volumes from files: each format by its own module, all of them behind `read_volume`."""

from .read import read_volume
from .volume_data import VolumeData

__all__ = ["VolumeData", "read_volume"]
