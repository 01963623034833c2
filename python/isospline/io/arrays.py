"""Files that hold an array and nothing else: .npy and headerless raw."""

from __future__ import annotations

import math
import os

import numpy as np

from .checks import check_samples, size_text
from .volume_data import VolumeData


def read_npy(path):
    """Map a .npy file, indexed [z, y, x]."""
    data = np.load(path, mmap_mode="r", allow_pickle=False)
    check_samples(data.shape, data.dtype, mapped=True)
    return VolumeData(data)


def read_raw(path, shape, dtype, offset):
    """Map a raw file of exactly the given samples after `offset` bytes."""
    if shape is None or dtype is None:
        missing = "shape" if shape is None else "dtype"
        raise ValueError(f"expected the shape and the type of the samples, which the file does not tell: {missing}=")
    shape, dtype = tuple(int(count) for count in shape), np.dtype(dtype)
    check_samples(shape, dtype, mapped=True)
    expected, size = offset + math.prod(shape) * dtype.itemsize, os.path.getsize(path)
    if size != expected:
        header = f" after {offset} bytes" if offset else ""
        raise ValueError(
            f"expected {expected} bytes, {size_text(shape)} samples of {dtype}{header}, got {size} bytes"
        )
    return VolumeData(np.memmap(path, dtype, mode="r", offset=offset, shape=shape))
