"""Lights at a place or in a direction: points, discs at infinity, parallelograms and balls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .base.mistakes import sentence
from .base.parameters import number, vector
from .base.signatures import explained_methods
from .base.values import Value
from .base.views import light_from


class _Light(Value):
    """A light whose parameters the compiled module checks."""

    def _check(self) -> None:
        _core._check_light(self)


class _PointLight(_Light):
    """A light that has a place or a direction alone."""


def point_lights(value: Any, parameter: str) -> tuple[_PointLight, ...]:
    """The lights of a Phong shading, from a sequence of them."""
    expected = "a sequence of PositionalLight or DirectionalLight"
    is_sequence = hasattr(type(value), "__len__") and hasattr(type(value), "__iter__")
    if not is_sequence or not all(isinstance(each, _PointLight) for each in value):
        meaning = f"[{type(value).__name__}(...)]" if isinstance(value, _PointLight) else None
        raise TypeError(sentence(parameter, expected, value, meaning))
    return tuple(value)


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class PositionalLight(_PointLight):
    """A light at a point, without attenuation by distance.

    Parameters
    ----------
    position : (3,) float
        World units.
    intensity : float or (3,) float
        Linear red, green and blue, or one number for all three; at least 0.

    Raises
    ------
    ValueError
        For numbers that are not finite, and a negative intensity.
    """

    position: NDArray[np.float64]
    intensity: NDArray[np.float64]

    def __init__(self, position: ArrayLike, *, intensity: float | tuple[float, float, float] | ArrayLike = 1.0) -> None:
        self._keep(position=vector(position, "position"), intensity=_core._color(intensity, "intensity"))


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class DirectionalLight(_PointLight):
    """A light that is infinitely far away, like the sun.

    Parameters
    ----------
    direction : (3,) float or str
        The direction in which the light travels; any length except zero. Or the side that it comes from: a name, as in
        `camera_for`, such as "left".
    intensity : float or (3,) float
        Linear red, green and blue, or one number for all three; at least 0.
    angle : float
        The diameter of its disc as seen from the scene, in degrees, from 0 to 180; that of the sun is 0.53. Above 0,
        shadows have soft edges: each shadow ray goes to another point of the disc. Surfaces are shaded by the disc's
        centre, but in path tracing by its points. The irradiance of a surface that faces it is the same for any angle.

    Raises
    ------
    ValueError
        For numbers that are not finite, a direction of zero, an unknown side, a negative intensity, and an angle out of
        range.
    """

    direction: NDArray[np.float64]
    intensity: NDArray[np.float64]
    angle: float

    def __init__(
        self,
        direction: ArrayLike | str,
        *,
        intensity: float | tuple[float, float, float] | ArrayLike = 1.0,
        angle: float = 0.0,
    ) -> None:
        along = light_from(direction) if isinstance(direction, str) else direction
        self._keep(
            direction=vector(along, "direction"),
            intensity=_core._color(intensity, "intensity"),
            angle=number(angle, "angle"),
        )


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class RectangleLight(_Light):
    """A parallelogram that emits light on one side, for a `PathTracer`.

    It may lie in a surface, as a panel in a ceiling.

    Parameters
    ----------
    corner : (3,) float
        World units.
    edge_u, edge_v : (3,) float
        The two edges at the corner. Light is emitted on the side that edge_u x edge_v points to. On the other side, the
        parallelogram has no effect.
    radiance : float or (3,) float
        Linear red, green and blue, the same in every direction.

    Raises
    ------
    ValueError
        For numbers that are not finite, parallel edges, and a negative radiance.

    Examples
    --------
    >>> import isospline
    >>> isospline.RectangleLight((-1, -1, 5), (0, 2, 0), (2, 0, 0), radiance=3)
    RectangleLight(corner=(-1, -1, 5), edge_u=(0, 2, 0), edge_v=(2, 0, 0), radiance=(3, 3, 3))
    """

    corner: NDArray[np.float64]
    edge_u: NDArray[np.float64]
    edge_v: NDArray[np.float64]
    radiance: NDArray[np.float64]

    def __init__(
        self,
        corner: ArrayLike,
        edge_u: ArrayLike,
        edge_v: ArrayLike,
        *,
        radiance: float | tuple[float, float, float] | ArrayLike = 1.0,
    ) -> None:
        self._keep(
            corner=vector(corner, "corner"),
            edge_u=vector(edge_u, "edge_u"),
            edge_v=vector(edge_v, "edge_v"),
            radiance=_core._color(radiance, "radiance"),
        )


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class SphereLight(_Light):
    """A ball that emits light, for a `PathTracer`.

    Parameters
    ----------
    center : (3,) float
        World units.
    radius : float
        World units, above 0.
    radiance : float or (3,) float
        Linear red, green and blue, the same in every direction.

    Raises
    ------
    ValueError
        For numbers that are not finite, a radius that is not positive, and a negative radiance.

    Examples
    --------
    >>> import isospline
    >>> isospline.SphereLight((0, 0, 5), 0.5, radiance=20)
    SphereLight(center=(0, 0, 5), radius=0.5, radiance=(20, 20, 20))
    """

    center: NDArray[np.float64]
    radius: float
    radiance: NDArray[np.float64]

    def __init__(
        self, center: ArrayLike, radius: float, *, radiance: float | tuple[float, float, float] | ArrayLike = 1.0
    ) -> None:
        self._keep(
            center=vector(center, "center"),
            radius=number(radius, "radius"),
            radiance=_core._color(radiance, "radiance"),
        )
