"""Files that contain only an array: .npy and headerless raw files."""

from __future__ import annotations

import math
import os

import numpy as np

from ..base.mistakes import sentence
from ..base.parameters import check_count
from .checks import check_samples, size_text
from .raw_shape import shape_of_name, suggest_raw, warn_of_scrambled_shape
from .volume_data import VolumeData

_MAGIC = np.lib.format.MAGIC_PREFIX


def read_npy(path):
    """Map a .npy file, indexed [z, y, x]."""
    with open(path, "rb") as file:
        beginning = file.read(len(_MAGIC))
    if beginning != _MAGIC:  # which NumPy would take for pickled objects
        raise ValueError("expected the beginning of a .npy file, got another: the file is truncated or damaged")
    data = np.load(path, mmap_mode="r", allow_pickle=False)
    check_samples(data.shape, data.dtype, mapped=True)
    return VolumeData(data)


#: The order of a shape in Python and on the command line.
ORDER = "shape=(nz, ny, nx) in Python, --shape NX,NY,NZ on the command line"


def check_shape(shape):
    """The shape of raw samples, (nz, ny, nx), as whole numbers."""
    if not np.iterable(shape):
        raise TypeError(sentence("shape", "three whole numbers, (nz, ny, nx)", shape))
    counts = tuple(shape)
    for count in counts:
        check_count(count, "shape")
    return tuple(map(int, counts))


def read_raw(path, shape, dtype, offset):
    """Map a raw file of exactly the given samples after `offset` bytes."""
    named = shape_of_name(path)
    format = "raw"
    if named and (shape is None or dtype is None):
        format = f"raw, {' and '.join(['shape'] * (shape is None) + ['type'] * (dtype is None))} by its name"
        shape, dtype = (found if given is None else given for given, found in zip((shape, dtype), named))
    if shape is None or dtype is None:
        missing = "shape" if shape is None else "dtype"
        is_unknown = shape is None and dtype is None and isinstance(offset, int) and offset >= 0
        suggested = suggest_raw(path, offset) if is_unknown else None
        meaning = "; did you mean shape={}, dtype={!r}?".format(*suggested) if suggested else ""
        raise ValueError(
            f"expected the shape and the type of the samples, which the file does not store: {missing}= "
            f"({ORDER}){meaning}"
        )
    dtype = np.dtype(dtype)
    check_samples(shape, dtype, mapped=True)
    if offset < 0:
        raise ValueError(f"expected an offset of at least 0, got {offset}")
    expected, size = offset + math.prod(shape) * dtype.itemsize, os.path.getsize(path)
    if size != expected:
        header = f" after {offset} bytes" if offset else ""
        raise ValueError(
            f"expected {expected} bytes, {size_text(shape)} samples (x, y, z) of {dtype}{header}, got {size} bytes "
            f"({ORDER})"
        )
    data = np.memmap(path, dtype, mode="r", offset=offset, shape=shape)
    warn_of_scrambled_shape(path, data.shape, dtype, offset, ORDER)
    return VolumeData(data, format=format)
