"""Rules that say the colour of each point of a surface by itself."""

from __future__ import annotations

import math
import numbers
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.parameters import check_type, optional, text
from ..base.signatures import explained, explained_methods
from ..colors import linear, one_color
from ..scene.conversions import as_volume
from .rule import _ColorRule, transform_of, two_numbers

if TYPE_CHECKING:
    from ..base.types import ColorMap
    from ..io import VolumeData
    from ..scene import Volume


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class ColorByVolume(_ColorRule):
    """The colour of a surface by the value of a volume's model there.

    Parameters
    ----------
    volume : Volume, VolumeData or (nz, ny, nx) array
        Any volume of any degree; it need not be the volume of the surface. Outside of its domain, it continues by its
        boundary rule.
    cmap : str, matplotlib Colormap or (N, 3) array_like
        The name of a matplotlib map, a map object, or two or more colours at equal steps, sRGB from 0 to 1 or named.
        Between them, colours are interpolated in linear light.
    limits : (float, float), optional
        Values of the first and of the last colour; by default the smallest and the largest sample.
    transform : (4, 4) array_like, optional
        Maps the volume's world space to the scene's, as in `Scene.add`; by default they are the same.
    label : str
        The title of the colour bar: what the values are, with their unit, such as ``"temperature in K"``.

    Raises
    ------
    ValueError
        For limits that are equal or not finite, an unknown map, a transform that is singular or not affine. Also if all
        samples are the same and there are no limits. When the picture is made, for a volume in another unit of length
        than that of the scene, unless the transform converts it.

    Examples
    --------
    >>> import numpy as np
    >>> import isospline
    >>> temperature = isospline.Volume(np.random.default_rng(1).random((8, 8, 8)))
    >>> by_temperature = isospline.Phong(color=isospline.ColorByVolume(temperature, limits=(0, 1)))
    """

    volume: Volume
    #: (N, 3) float64 array: colours, sRGB, at equal steps from the first limit to the second.
    cmap: NDArray[np.float64]
    limits: tuple[float, float]
    #: (4, 4) float64 array: maps the volume's world space to the scene's.
    transform: NDArray[np.float64]
    #: str: the title of the colour bar; empty if it was not given.
    label: str

    def __init__(
        self,
        volume: Volume | VolumeData | NDArray[Any],
        cmap: ColorMap = "viridis",
        *,
        limits: tuple[float, float] | None = None,
        transform: ArrayLike | None = None,
        label: str = "",
    ) -> None:
        model = as_volume(volume, "volume", " whose values give the colours")
        if limits is None and not model.minimum < model.maximum:
            raise ValueError("limits: expected two numbers, since all samples of the volume are the same, got None")
        self._keep(
            volume=model,
            cmap=cmap,
            limits=two_numbers((model.minimum, model.maximum) if limits is None else limits, "limits"),
            transform=transform_of(transform),
            label=text(label, "label"),
        )


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class ColorByCurvature(_ColorRule):
    r"""The colour of a surface by its curvature.

    The curvature is that of the model, from its exact gradient g and Hessian H in world space,

    .. math:: k_{mean} = \pm \frac{|g|^2 \mathrm{tr} H - g^T H g}{2 |g|^3}, \quad
              k_{Gauss} = \frac{g^T \mathrm{adj}(H) g}{|g|^4}

    with the sign that makes a solid ball's mean curvature positive: ridges are positive, valleys negative. Models of
    degree 3 have a continuous Hessian; at degree 2 it jumps between cells. Second derivatives amplify the noise of
    measured samples; `Volume(..., filter="smoothing")` reduces it. The curvature of meshes is zero.

    Parameters
    ----------
    kind : {"mean", "gaussian", "maximum", "minimum"}
        Mean or Gaussian curvature, or a principal one.
    cmap : str, matplotlib Colormap or (N, 3) array_like
        The name of a matplotlib map, a map object, or two or more colours at equal steps, sRGB from 0 to 1 or named.
        Between them, colours are interpolated in linear light.
    limits : (float, float)
        Curvatures of the first and of the last colour, in 1 / world unit; for Gaussian curvature, in 1 / world unit^2.

    Raises
    ------
    ValueError
        For limits that are equal or not finite, an unknown kind or map.

    References
    ----------
    R. Goldman, "Curvature formulas for implicit curves and surfaces", Computer Aided Geometric Design 22, 2005.

    Examples
    --------
    >>> import isospline
    >>> bends = isospline.Phong(color=isospline.ColorByCurvature("mean", "coolwarm", limits=(-0.5, 0.5)))
    """

    kind: Literal["mean", "gaussian", "maximum", "minimum"]
    #: (N, 3) float64 array: colours, sRGB, at equal steps from the first limit to the second.
    cmap: NDArray[np.float64]
    limits: tuple[float, float]

    def __init__(
        self,
        kind: Literal["mean", "gaussian", "maximum", "minimum"] = "mean",
        cmap: ColorMap = "coolwarm",
        *,
        limits: tuple[float, float],
    ) -> None:
        self._keep(kind=text(kind, "kind"), cmap=cmap, limits=two_numbers(limits, "limits"))


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class ColorByNormal(_ColorRule):
    """The colour of a surface by its normal.

    Red, green and blue, linear, are (N + 1) / 2 of the unit outward normal N in world space.
    """

    def __init__(self) -> None:
        self._keep()


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class ColorByDepth(_ColorRule):
    """The colour of a surface by its depth in the image.

    Parameters
    ----------
    cmap : str, matplotlib Colormap or (N, 3) array_like
        The name of a matplotlib map, a map object, or two or more colours at equal steps, sRGB from 0 to 1 or named.
        Between them, colours are interpolated in linear light.
    limits : (float, float), optional
        Depths of the first and of the last colour, world units, as in `Image.depth`; by default the smallest and the
        largest depth of the scene's box, 0 with the eye inside.

    Raises
    ------
    ValueError
        For limits that are equal or not finite, an unknown map.
    """

    #: (N, 3) float64 array: colours, sRGB, at equal steps from the first limit to the second.
    cmap: NDArray[np.float64]
    limits: tuple[float, float] | None

    def __init__(self, cmap: ColorMap = "viridis", *, limits: tuple[float, float] | None = None) -> None:
        self._keep(cmap=cmap, limits=optional(two_numbers, limits, "limits"))


@explained
def ridges_and_valleys(
    curvature: float, *, color: ArrayLike = 0.5, ridge: ArrayLike = 1.0, valley: ArrayLike = 0.0
) -> ColorByCurvature:
    """Colour the ridges and the valleys of a surface.

    Points with a mean curvature of ``-curvature`` or less have the colour of valleys, those with zero curvature the
    colour of the surface, and those with ``curvature`` or more the colour of ridges. Colours are interpolated between.

    Parameters
    ----------
    curvature : float
        Mean curvature at which the full colour is reached, in 1 / world unit; above 0. A rounded edge of radius r has
        the mean curvature 1 / (2 r).
    color, ridge, valley : float, (3,) float or str
        Colours, sRGB from 0 to 1, or names.

    Returns
    -------
    ColorByCurvature

    Raises
    ------
    ValueError
        For a curvature that is not above 0 or not finite, and for a colour that is unknown or outside of 0 to 1.

    Examples
    --------
    >>> import isospline
    >>> engraved = isospline.Phong(color=isospline.ridges_and_valleys(0.4, valley=(0.2, 0.05, 0)))
    """
    check_type(curvature, "curvature", numbers.Real, "a number")
    if not 0 < curvature < math.inf:
        raise ValueError(f"curvature: expected a finite number above 0, got {curvature!r}")
    given = {"valley": valley, "color": color, "ridge": ridge}
    colors = np.stack([one_color(each, name) for name, each in given.items()])
    return ColorByCurvature("mean", limits=(-curvature, curvature), cmap=linear(colors))
