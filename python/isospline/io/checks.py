"""What the header of a file must say before its samples are read."""

from __future__ import annotations

import math

import numpy as np


def check_samples(shape, dtype, *, mapped=False):
    """Check that samples of this shape, [z, y, x], and type make a volume, and fit into memory unless mapped."""
    dtype = np.dtype(dtype)
    if len(shape) != 3:
        times = " (a time series, or several channels?)" if len(shape) > 3 else ""
        raise ValueError(f"expected three dimensions, got {len(shape)}: {size_text(shape)}{times}")
    if min(shape) < 1:
        raise ValueError(f"expected at least one sample along each axis, got {size_text(shape)}")
    if dtype.kind not in "biuf":
        raise ValueError(f"expected real numbers, got {dtype}")
    needed, available = math.prod(shape) * dtype.itemsize, available_memory()
    if not mapped and needed > available:
        raise MemoryError(
            f"{size_text(shape)} samples of {dtype} need {needed / 2**30:.1f} GiB, "
            f"and {available / 2**30:.1f} GiB of memory are available"
        )


def check_components(count):
    """Check that a sample is one number."""
    if count != 1:
        raise ValueError(f"expected one number a sample, got {count} (colours or vectors?)")


def size_text(shape):
    """`64 x 48 x 32`, x first, of a shape [z, y, x]."""
    return " x ".join(str(count) for count in reversed(shape))


def available_memory():
    """Bytes that may be allocated without swapping; infinite where the system does not say."""
    try:
        with open("/proc/meminfo") as file:
            return next(int(line.split()[1]) * 1024 for line in file if line.startswith("MemAvailable:"))
    except (OSError, StopIteration):
        return math.inf
