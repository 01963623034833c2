"""Checks of parameters that several functions have."""

from __future__ import annotations

import numbers
import os

import numpy as np


# What the core counts with.
COUNT_LIMIT = 2**31 - 1


def check_count(count, parameter="count"):
    """Check that a parameter is a whole number of at least 1; 3.0 is one, too."""
    if not isinstance(count, numbers.Real):
        raise TypeError(f"{parameter}: expected a whole number, got {type(count).__name__}")
    if not (1 <= count <= COUNT_LIMIT and count % 1 == 0):
        most = f", and {COUNT_LIMIT} at most" if count > COUNT_LIMIT else ""
        raise ValueError(f"{parameter}: expected a whole number of at least 1{most}, got {count!r}")


def check_type(value, parameter, types, expected):
    """Check that a parameter is an instance of the types, which `expected` puts into words."""
    if not isinstance(value, types):
        got = "None" if value is None else f"{type(value).__module__}.{type(value).__qualname__}"
        raise TypeError(f"{parameter}: expected {expected}, got {got.removeprefix('builtins.')}")


def refuse_masked(value, parameter):
    """Refuse masked values: NumPy takes what is under the mask for data."""
    count = np.ma.count_masked(value) if isinstance(value, np.ma.MaskedArray) else 0
    if count:
        raise ValueError(
            f"{parameter}: expected an array without masked values: fill them, array.filled(value), got {count} masked"
        )


def check_path(path):
    """Check the type of a path that a user gives."""
    if not isinstance(path, (str, os.PathLike)) or not isinstance(os.fspath(path), str):
        raise TypeError(f"path: expected a str or path-like, got {'None' if path is None else type(path).__name__}")
    if "\0" in os.fspath(path):
        raise ValueError(f"path: expected a name without null characters, got {printable(path)!r}")


def printable(path):
    """The path as text for messages, with escapes in place of what is not UTF-8."""
    return os.fspath(path).encode(errors="backslashreplace").decode()
