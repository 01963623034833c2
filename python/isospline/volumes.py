"""Volumes made from formulas, for examples, tests and benchmarks.

Each function here returns a `Field`: a scalar field on the cube [-1, 1]^3 with its gradient in closed form and a level
with an interesting isosurface. Sampled on a grid of any size, it becomes an `isospline.Volume` whose world coordinates
are those of the field.

Examples
--------
>>> from isospline import volumes
>>> field = volumes.torus()
>>> volume = field.volume((40, 48, 56), degree=3)
>>> volume.shape, volume.spacing
((40, 48, 56), array([0.03571429, 0.04166667, 0.05      ]))
>>> field.values(32).dtype
dtype('float32')
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypedDict, Union

import numpy as np
from numpy.typing import DTypeLike, NDArray

from .base.parameters import check_count
from .base.signatures import explained, explained_methods
from .base.values import itself
from .scene import Volume

__all__ = ["Field", "blobs", "gyroid", "heart", "marschner_lobb", "sphere", "torus", "waves"]


Shape = Union[int, "tuple[int, int, int]"]


class Grid(TypedDict):
    """The place of a field's values."""

    spacing: tuple[float, float, float]
    origin: tuple[float, float, float]


@explained_methods
@dataclass(frozen=True, eq=False)
class Field:
    """A scalar field on [-1, 1]^3.

    Fields of this module's functions are equal if function and arguments are, and are pickled as these.

    Attributes
    ----------
    value : callable
        Maps (..., 3) points to (...) values.
    gradient : callable
        Maps (..., 3) points to (..., 3) gradients, in closed form; also for complex points, which `hessian` uses.
    level : float
        A level with an interesting isosurface.
    """

    value: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    gradient: Callable[[NDArray[Any]], NDArray[Any]]
    level: float
    _recipe: tuple[str, tuple[Any, ...]] | None = field(default=None, repr=False, init=False)

    __copy__ = itself

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Field) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def __repr__(self) -> str:
        if self._recipe is None:
            return f"Field(value={self.value!r}, gradient={self.gradient!r}, level={self.level!r})"
        name, arguments = self._recipe
        return f"volumes.{name}({', '.join(map(repr, arguments))})"

    def _key(self) -> Any:
        return self._recipe or (self.value, self.gradient, self.level)

    def __reduce__(self) -> Any:
        return (_make, self._recipe) if self._recipe else (Field, (self.value, self.gradient, self.level))

    def hessian(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Second derivatives at (..., 3) real points, (..., 3, 3): complex steps of the gradient, exact to rounding."""
        step = 1e-30
        columns = [self.gradient(points + 1j * step * axis).imag / step for axis in np.eye(3)]
        return np.stack(columns, axis=-1)

    def values(self, shape: Shape, dtype: DTypeLike = np.float32) -> NDArray[Any]:
        """The field at the centres of equal voxels that fill the cube, as data[z, y, x].

        Parameters
        ----------
        shape : int or (int, int, int)
            Values along z, y and x; one number for all three.
        dtype : dtype
            Type of the result; the field is evaluated in float64.

        Returns
        -------
        (nz, ny, nx) array

        Raises
        ------
        ValueError
            For another number of axes, and for counts below 1.
        """
        z, y, x = (-1 + (np.arange(count) + 0.5) * (2 / count) for count in _shape(shape))
        data = np.empty((len(z), len(y), len(x)), dtype)
        points = np.empty((len(y), len(x), 3))
        points[..., 0] = x
        points[..., 1] = y[:, None]
        for slice_, height in zip(data, z):
            points[..., 2] = height
            slice_[...] = self.value(points)
        return data

    def volume(self, shape: Shape, **options: Any) -> Volume:
        """The model of `values(shape)`, in the coordinates of the field.

        Parameters
        ----------
        shape : int or (int, int, int)
            Samples along z, y and x, as in `values`.
        **options
            Options of `isospline.Volume`, such as ``degree=3``. With ``axes="xyz"``, the model is the same.

        Returns
        -------
        Volume
        """
        values = self.values(shape)
        return Volume(values.T if options.get("axes") == "xyz" else values, **{**self.grid(shape), **options})

    def grid(self, shape: Shape) -> Grid:
        """Spacing and origin, (x, y, z), of `values(shape)`: keyword arguments for `isospline.Volume`."""
        z, y, x = (2 / count for count in _shape(shape))
        return {"spacing": (x, y, z), "origin": (-1 + x / 2, -1 + y / 2, -1 + z / 2)}


def _shape(shape: Shape) -> tuple[int, int, int]:
    given: Any = shape
    counts = (given,) * 3 if np.ndim(given) == 0 else tuple(given)
    if len(counts) != 3:
        raise ValueError(f"shape: expected one number of samples or three, got {len(counts)}")
    for count in counts:
        check_count(count, "shape")
    z, y, x = map(int, counts)
    return z, y, x


def _make(name: str, arguments: tuple[Any, ...]) -> Field:
    """The field of a function of this module."""
    made: Field = globals()[name](*arguments)
    return made


def _field(function: Callable[..., Field]) -> Callable[..., Field]:
    """A function whose fields remember its name and its arguments."""
    signature = inspect.signature(function)

    @functools.wraps(function)
    def made(*args: Any, **kwargs: Any) -> Field:
        result = function(*args, **kwargs)
        given = signature.bind(*args, **kwargs)
        given.apply_defaults()
        object.__setattr__(result, "_recipe", (function.__name__, given.args))
        return result

    return made


@_field
@explained
def sphere(radius: float = 0.7) -> Field:
    r"""Ball of the `radius` r: :math:`f = r^2 - |x|^2`, above 0 inside."""

    def value(points):
        return radius**2 - (points**2).sum(-1)

    def gradient(points):
        return -2 * points

    return Field(value, gradient, level=0.0)


@_field
@explained
def torus(major: float = 0.6, minor: float = 0.25) -> Field:
    r"""Torus around z, of the radii R (`major`) and r (`minor`): :math:`f = r^2 - (\sqrt{x^2 + y^2} - R)^2 - z^2`.

    It is above 0 inside. On the axis, it has no derivatives by x and y: both components of the gradient are NaN there,
    and so are their derivatives.
    """

    def value(points):
        x, y, z = np.moveaxis(points, -1, 0)
        return minor**2 - (np.sqrt(x * x + y * y) - major) ** 2 - z * z

    def gradient(points):
        x, y, z = np.moveaxis(points, -1, 0)
        is_on_axis = (np.real(x) == 0) & (np.real(y) == 0)  # also one step of `hessian` away from it
        distance = np.sqrt(np.where(is_on_axis, 1, x * x + y * y))
        radial = np.where(is_on_axis, np.nan, -2 * (1 - major / distance))
        return np.stack([radial * x, radial * y, -2 * z], axis=-1)

    return Field(value, gradient, level=0.0)


@_field
@explained
def gyroid(periods: float = 2.0) -> Field:
    r"""Gyroid: :math:`f = \sin X \cos Y + \sin Y \cos Z + \sin Z \cos X`, :math:`(X, Y, Z) = \pi p (x, y, z)`.

    The surface f = 0 approximates the triply periodic minimal surface of A. Schoen, with `periods` periods p along each
    edge of the cube.
    """
    frequency = np.pi * periods

    def value(points):
        angle = frequency * points
        return (np.sin(angle) * np.cos(np.roll(angle, -1, axis=-1))).sum(-1)

    def gradient(points):
        sine, cosine = np.sin(frequency * points), np.cos(frequency * points)
        return frequency * (cosine * np.roll(cosine, -1, axis=-1) - sine * np.roll(sine, 1, axis=-1))

    return Field(value, gradient, level=0.0)


@_field
@explained
def marschner_lobb(frequency: float = 6.0, alpha: float = 0.25) -> Field:
    r"""The test signal of Marschner and Lobb (Visualization '94), which is difficult for reconstruction filters.

    .. math:: f = \frac{1 - \sin(\pi z / 2) + \alpha (1 + \rho(\sqrt{x^2 + y^2}))}{2 (1 + \alpha)}, \quad
              \rho(r) = \cos(2 \pi f_M \cos(\pi r / 2))

    with :math:`f_M` = `frequency` and :math:`\alpha` = `alpha`. Its published form: :math:`f_M = 6`,
    :math:`\alpha = 1/4`, 40 samples an axis, level 1/2.
    """

    def value(points):
        x, y, z = np.moveaxis(points, -1, 0)
        rho = np.cos(2 * np.pi * frequency * np.cos(np.pi / 2 * np.sqrt(x * x + y * y)))
        return (1 - np.sin(np.pi / 2 * z) + alpha * (1 + rho)) / (2 * (1 + alpha))

    def gradient(points):
        x, y, z = np.moveaxis(points, -1, 0)
        r = np.sqrt(x * x + y * y)
        phase = 2 * np.pi * frequency * np.cos(np.pi / 2 * r)
        slope = alpha * np.sin(phase) * np.pi**3 / 2 * frequency * np.sinc(r / 2)
        return np.stack([slope * x, slope * y, -np.pi / 2 * np.cos(np.pi / 2 * z)], axis=-1) / (2 * (1 + alpha))

    return Field(value, gradient, level=0.5)


@_field
@explained
def blobs(count: int = 24, seed: int = 0, width: float = 0.12) -> Field:
    r"""Random Gaussian blobs: :math:`f = \sum_i \exp(-|x - c_i|^2 / 2 w^2)`, with w = `width`.

    The `count` centres are uniform in [-0.7, 0.7]^3.
    """
    check_count(count)
    centers = np.random.default_rng(seed).uniform(-0.7, 0.7, (count, 3))

    def value(points):
        return sum(np.exp(((points - center) ** 2).sum(-1) / (-2 * width**2)) for center in centers)

    def gradient(points):
        total = np.zeros(points.shape, np.result_type(points, float))
        for center in centers:
            offset = points - center
            total += offset * (np.exp((offset**2).sum(-1) / (-2 * width**2)) / -(width**2))[..., None]
        return total

    return Field(value, gradient, level=0.5)


@_field
@explained
def waves(count: int = 32, seed: int = 0, frequency: float = 20.0) -> Field:
    r"""Random waves, a noise of limited band: :math:`f = \sqrt{2 / m} \sum_i \cos(\langle k_i, x \rangle + \phi_i)`.

    The m = `count` wave vectors are uniform in the ball of radius `frequency`. The mean is 0 and the variance 1.
    """
    check_count(count)
    generator = np.random.default_rng(seed)
    vectors = generator.normal(size=(count, 3))
    vectors *= frequency * (generator.uniform(size=count) ** (1 / 3) / np.linalg.norm(vectors, axis=-1))[:, None]
    phases = generator.uniform(0, 2 * np.pi, count)
    amplitude = np.sqrt(2 / count)

    def value(points):
        return amplitude * sum(np.cos(points @ vector + phase) for vector, phase in zip(vectors, phases))

    def gradient(points):
        return -amplitude * sum(
            np.sin(points @ vector + phase)[..., None] * vector for vector, phase in zip(vectors, phases)
        )

    return Field(value, gradient, level=0.0)


@_field
@explained
def heart(periods: float = 7.0, thickness: float = 0.55, sharpness: float = 25.0) -> Field:
    r"""A heart, massive on its left and dissolving into a gyroid on its right; above 0 inside.

    .. math:: f = -\frac{1}{k} \log(e^{-k h} + e^{-k w}), \quad
              h = 1 - |u|^2 + u_z \sqrt[3]{u_x^2 + u_y^2 / 20 + \epsilon}, \quad
              w = \frac{1}{4} ((\tau (1 + e^{-6 (x + 0.15)}))^2 - g^2)

    with the heart h after Taubin's sextic, :math:`u = (1.18 x, 1.6 y, 1.18 (z + 0.1))`, :math:`\epsilon = 10^{-4}`, the
    gyroid g of `periods` periods, its `thickness` :math:`\tau`, and a soft minimum of `sharpness` k.
    """
    scale, shift, epsilon = np.array([1.18, 1.6, 1.18]), np.array([0.0, 0.0, 0.1]), 1e-4
    lattice = gyroid(periods)

    def parts(points):
        x, y, z = np.moveaxis((points + shift) * scale, -1, 0)
        crease = (x * x + y * y / 20 + epsilon) ** (1 / 3)
        body = 1 - x * x - y * y - z * z + z * crease
        body_gradient = scale * np.stack(
            [-2 * x + z * (2 / 3) * x / crease**2, -2 * y + z * (1 / 30) * y / crease**2, -2 * z + crease], axis=-1
        )
        growth = np.exp(-6 * (points[..., 0] + 0.15))
        return body, body_gradient, growth

    def web(points, growth):
        return ((thickness * (1 + growth)) ** 2 - lattice.value(points) ** 2) / 4

    def value(points):
        body, _, growth = parts(points)
        return -np.logaddexp(-sharpness * body, -sharpness * web(points, growth)) / sharpness

    def gradient(points):
        body, body_gradient, growth = parts(points)
        web_gradient = -lattice.value(points)[..., None] * lattice.gradient(points) / 2
        web_gradient[..., 0] -= 3 * thickness**2 * (1 + growth) * growth
        excess = (sharpness * (body - web(points, growth)))[..., None]
        less = np.exp(np.where(excess.real > 0, -excess, excess))  # its magnitude is at most 1
        share = np.where(excess.real > 0, less, 1) / (1 + less)
        return share * body_gradient + (1 - share) * web_gradient

    return Field(value, gradient, level=0.0)
