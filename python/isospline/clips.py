"""Cuts through surfaces: half-spaces and boxes, the parts that are kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .base.parameters import check_direction, check_point, vector, vector_text
from .base.signatures import explained_methods
from .base.values import Value


class _Cut(Value):
    """A part of space that is kept."""


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class HalfSpace(_Cut):
    """The side of a plane that is kept: the points x with <normal, x - point> >= 0.

    Parameters
    ----------
    point : (3,) array_like, world units
        Any point of the plane.
    normal : (3,) array_like
        Points to the side that is kept; any length except zero.

    Raises
    ------
    ValueError
        For a normal of zero, and numbers that are not finite.

    Examples
    --------
    >>> import isospline
    >>> isospline.HalfSpace((0, 0, 5), (0, 0, 1))
    HalfSpace(point=(0, 0, 5), normal=(0, 0, 1))
    """

    #: (3,) float64 array, world units: a point of the plane.
    point: NDArray[np.float64]
    #: (3,) float64 array: points to the side that is kept.
    normal: NDArray[np.float64]

    def __init__(self, point: ArrayLike, normal: ArrayLike) -> None:
        self._keep(point=vector(point, "point"), normal=vector(normal, "normal"))

    def _check(self) -> None:
        check_point(self.point, "point")
        check_direction(self.normal, "normal")


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class Box(_Cut):
    """An axis-aligned box.

    Parameters
    ----------
    minimum, maximum : (3,) array_like, world units
        Its corners; the minimum is below the maximum along each axis. Sides may be at infinity.

    Raises
    ------
    ValueError
        For a maximum that is not above the minimum, and for NaN.

    Examples
    --------
    >>> import isospline
    >>> isospline.Box((0, 0, 0), (10, 20, 30))
    Box(minimum=(0, 0, 0), maximum=(10, 20, 30))
    """

    #: (3,) float64 array, world units: the lower corner.
    minimum: NDArray[np.float64]
    #: (3,) float64 array, world units: the upper corner.
    maximum: NDArray[np.float64]

    def __init__(self, minimum: ArrayLike, maximum: ArrayLike) -> None:
        self._keep(minimum=vector(minimum, "minimum"), maximum=vector(maximum, "maximum"))

    def _check(self) -> None:
        if not (self.minimum < self.maximum).all():
            expected = f"numbers above those of the minimum, {vector_text(self.minimum)}"
            raise ValueError(f"maximum: expected {expected}, got {vector_text(self.maximum)}")
