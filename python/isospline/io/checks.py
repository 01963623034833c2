"""Checks of a file before it is read, and of its header before its samples are read."""

from __future__ import annotations

import contextlib
import errno
import math
import os
import re
import stat

import numpy as np

from ..base.parameters import printable

_KINDS = (
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def check_file(path):
    """Check that a path is a regular file that can be opened, and return its size."""
    status = os.stat(path)
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
    kind = next((name for is_kind, name in _KINDS if is_kind(status.st_mode)), None)
    if kind is not None:
        raise ValueError(f"{printable(path)}: expected a file, got {kind}")
    with open(path, "rb"):
        return status.st_size


def utf8(path):
    """The path as text for libraries. They abort, or look for another file, if it is not UTF-8."""
    text = os.fspath(path)
    try:
        text.encode()
    except UnicodeEncodeError:
        raise ValueError("expected a path in UTF-8, which the library that reads the format needs") from None
    return text


@contextlib.contextmanager
def errors_name_slice(file):
    """Put the name of a broken file, one of a folder, in front of the error message."""
    try:
        yield
    except (MemoryError, ModuleNotFoundError):
        raise
    except Exception as error:  # libraries raise many kinds for a broken file
        if isinstance(error, OSError) and error.filename is not None:
            raise
        reason = (str(error).strip().splitlines() or [type(error).__name__])[-1].strip()
        raise ValueError(f"{os.path.basename(file)}: {reason}") from error


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
    if not mapped:
        check_memory(math.prod(shape) * dtype.itemsize, f"{size_text(shape)} samples of {dtype}")


def without_series(shape):
    """The shape, x first, without further axes of length one: a single volume may be stored as a series of one."""
    return shape[:3] if all(count == 1 for count in shape[3:]) else shape


def check_memory(needed, what):
    """Check that this number of bytes fits into memory."""
    available = available_memory()
    if needed > available:
        raise MemoryError(
            f"{what} need {needed / 2**30:.1f} GiB, and {available / 2**30:.1f} GiB of memory are available"
        )


def check_components(count):
    """Check that a sample is one number."""
    if count != 1:
        raise ValueError(f"expected one number a sample, got {count} (colours or vectors?)")


def integer_of(fields, name, default=None):
    """The whole number in a field of a header that is text."""
    word = fields.get(name, str(default))
    if not re.fullmatch(r"[+-]?\d{1,18}", word):
        raise ValueError(f"expected {name} to be a whole number, got {word}")
    return int(word)


def one_unit(units):
    """The unit of all axes, of a list with that of each; empty if none tells one."""
    if len(set(units)) > 1:
        raise ValueError(f"expected one unit along all axes, got {', '.join(str(unit or 'none') for unit in units)}")
    return next(iter(units), "")


def size_text(shape):
    """`64 x 48 x 32`, x first, of a shape [z, y, x]."""
    return " x ".join(str(count) for count in reversed(shape))


def available_memory():
    """Bytes that may be allocated without swapping."""
    import psutil  # only if it is needed: it is slow to import

    return psutil.virtual_memory().available
