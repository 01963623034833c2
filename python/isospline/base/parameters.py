"""Checks of parameters that several functions have."""

from __future__ import annotations

import errno
import numbers
import os
import sys
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .mistakes import sentence

T = TypeVar("T")

# The largest count in the core.
COUNT_LIMIT = 2**31 - 1


def check_count(count: Any, parameter: str = "count", largest: int = COUNT_LIMIT, least: int = 1) -> None:
    """Check that a parameter is a whole number of at least `least`; 3.0 is allowed."""
    if not isinstance(count, numbers.Real):
        raise TypeError(sentence(parameter, "a whole number", count))
    number: Any = count
    if not (least <= number <= largest and number % 1 == 0):
        most = f", and {largest} at most" if number > largest else ""
        raise ValueError(f"{parameter}: expected a whole number of at least {least}{most}, got {count!r}")


def check_integer(value: Any, parameter: str) -> None:
    """Check that a parameter is an integer, and no bool."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise TypeError(sentence(parameter, "a whole number", value))


def check_seed(seed: Any) -> None:
    """Check the seed of random numbers."""
    check_integer(seed, "seed")
    if not 0 <= seed < 1 << 32:
        raise ValueError(f"seed: expected 0 to {(1 << 32) - 1}, got {seed}")


def check_type(value: Any, parameter: str, types: type | tuple[type, ...], expected: str) -> None:
    """Check that a parameter is an instance of the types; `expected` describes them."""
    if not isinstance(value, types):
        raise TypeError(sentence(parameter, expected, value))


def number(value: Any, parameter: str) -> float:
    """A number, also of another library."""
    if hasattr(type(value), "__float__") or hasattr(type(value), "__index__"):
        try:
            return float(value)
        except (TypeError, ValueError, OverflowError):
            pass
    raise TypeError(sentence(parameter, "a number", value))


def whole_number(value: Any, parameter: str) -> int:
    """A whole number of 32 bits, also of another library."""
    expected = "a whole number"
    is_whole = hasattr(type(value), "__int__") or hasattr(type(value), "__index__")
    if isinstance(value, (str, bytes, float, np.floating)) or not is_whole:
        raise TypeError(sentence(parameter, expected, value))
    try:
        whole = int(value)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(sentence(parameter, expected, value)) from None
    if not -(2**31) <= whole < 2**31:
        raise ValueError(f"{parameter}: expected {expected} of 32 bits, got {value!r}")
    return whole


def flag(value: Any, parameter: str) -> bool:
    """True or False, also as a number or None."""
    if value is None or hasattr(type(value), "__bool__"):
        try:
            return bool(value)
        except (TypeError, ValueError):
            pass
    raise TypeError(sentence(parameter, "True or False", value))


def text(value: Any, parameter: str) -> str:
    """A str."""
    check_type(value, parameter, str, "a str")
    kept: str = value
    return kept


def optional(convert: Callable[[Any, str], T], value: Any, parameter: str) -> T | None:
    """None, or what a function makes of another value of the parameter."""
    return None if value is None else convert(value, parameter)


def vector(value: ArrayLike, parameter: str) -> NDArray[np.float64]:
    """Three numbers as a new array."""
    return _core._doubles(value, parameter, (3,))


def vector_text(value: NDArray[np.float64]) -> str:
    """A vector as a tuple, in few digits."""
    return f"({', '.join(f'{each:.12g}' for each in value)})"


def check_point(value: NDArray[np.float64], parameter: str) -> None:
    """Check that a vector is finite."""
    if not np.isfinite(value).all():
        raise ValueError(f"{parameter}: expected three finite numbers, got {vector_text(value)}")


def check_direction(value: NDArray[np.float64], parameter: str) -> None:
    """Check that an array is a finite vector and not zero."""
    if value.shape != (3,) or not np.isfinite(value).all() or not value.any():
        raise ValueError(f"{parameter}: expected three finite numbers, not all of them zero, got {value.tolist()}")


def unit_vector(value: ArrayLike, parameter: str) -> NDArray[np.float64]:
    """A direction of length one, from three numbers of any length."""
    check_plain(value, parameter)
    given = np.asarray(value, dtype=float)
    check_direction(given, parameter)
    unit: NDArray[np.float64] = given / np.linalg.norm(given)
    return unit


def check_plain(value: Any, parameter: str) -> None:
    """Refuse arrays with more than numbers: values under a mask would be data, and coordinates would be ignored."""
    xarray = sys.modules.get("xarray")
    if xarray is not None and isinstance(value, xarray.DataArray):
        placed = [dim for dim in value.dims if not np.array_equal(value[dim], np.arange(value.sizes[dim]))]
        if placed:
            raise ValueError(
                f"{parameter}: expected an array without coordinates, got some along {', '.join(map(str, placed))}; "
                "Volume.from_xarray(array) keeps them, and array.data leaves them out"
            )
    count = np.ma.count_masked(value) if isinstance(value, np.ma.MaskedArray) else 0
    if count:
        raise ValueError(
            f"{parameter}: expected an array without masked values: fill them, array.filled(value), got {count} masked"
        )


def check_path(path: Any, parameter: str = "path") -> None:
    """Check the type of a path that a user gives, and that it is not empty."""
    if not isinstance(path, (str, os.PathLike)) or not isinstance(os.fspath(path), str):
        raise TypeError(sentence(parameter, "a str or path-like", path))
    if not os.fspath(path):  # which pathlib takes for the current folder
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), "")
    if "\0" in os.fspath(path):
        raise ValueError(f"{parameter}: expected a name without null characters, got {printable(path)!r}")


def printable(path: str | os.PathLike[str]) -> str:
    """The path as text for messages; bytes that are not UTF-8 are escaped."""
    return os.fspath(path).encode(errors="backslashreplace").decode()


def describe_not_finite(data: NDArray[Any]) -> str:
    """How many samples of an array are NaN or infinite, and where the first one is; empty if all are finite."""
    if data.dtype.kind != "f":
        return ""
    # Slice by slice, so that no temporary array is as large as the volume.
    places = [np.flatnonzero(~np.isfinite(part)) for part in np.atleast_2d(data)]
    count = sum(map(len, places))
    if count == 0:
        return ""
    slice_ = next(number for number, each in enumerate(places) if len(each))
    within = np.unravel_index(int(places[slice_][0]), np.atleast_2d(data).shape[1:])
    first = ", ".join(map(str, (slice_, *within) if data.ndim > 1 else within))
    return f"{count} of {data.size} that are NaN or infinite, the first one at [{first}]"
