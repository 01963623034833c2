"""Colours: transfer curves, colour maps by name, ready-made colourings."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .color_tables import table
from .mistakes import sentence
from .signatures import explained


def linear_to_srgb(linear: ArrayLike) -> NDArray[np.float64]:
    """The transfer curve of sRGB (IEC 61966-2-1), for values that are clipped to [0, 1]."""
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def srgb_to_linear(srgb: ArrayLike) -> NDArray[np.float64]:
    """The inverse of `linear_to_srgb`, on [0, 1]."""
    srgb = np.asarray(srgb, dtype=float)
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def named_color(name: str, parameter: str = "color") -> NDArray[np.float64]:
    """Linear red, green and blue of a colour of CSS, such as ``"white"`` or ``"#ff8000"``.

    Examples
    --------
    >>> from isospline.colors import named_color
    >>> named_color("white")
    array([1., 1., 1.])
    """
    from PIL import ImageColor

    try:
        srgb = ImageColor.getrgb(name)
    except ValueError:
        expected = 'linear numbers or the name of a colour, such as "white" or "#ff8000"'
        raise ValueError(f"{parameter}: expected {expected}, got {name!r}") from None
    return srgb_to_linear(np.array(srgb[:3]) / 255)


def above_one(parameter: str, color: ArrayLike) -> str:
    """What to say of the colour of a surface that is far above 1: perhaps it is of 8 bits."""
    parts = np.broadcast_to(np.asarray(color, dtype=float), 3)
    of_eight_bits = (parts >= 0).all() and (parts <= 255).all() and (parts % 1 == 0).all()
    meaning = f'"#{"".join(f"{int(part):02x}" for part in parts)}"' if of_eight_bits else None
    return sentence(parameter, "linear numbers from 0 to 1", color, meaning)


def color_map(cmap: Any) -> NDArray[np.float64]:
    """Linear colours at equal steps of a colour map.

    Parameters
    ----------
    cmap : str, matplotlib Colormap or (N, 3) array_like
        The name of a map of matplotlib, such as ``"viridis"``, a map of its, or two or more linear colours.

    Returns
    -------
    (N, 3) float64 array
        For a map of matplotlib, 256 colours that look as it does once they are encoded in sRGB.

    Raises
    ------
    ValueError
        For an unknown name and for an array of another shape.
    ImportError
        For a name other than "viridis" and "coolwarm" where there is no matplotlib.

    Examples
    --------
    >>> from isospline.colors import color_map
    >>> color_map([(0, 0, 0), (1, 0.5, 0)])
    array([[0. , 0. , 0. ],
           [1. , 0.5, 0. ]])
    """
    if isinstance(cmap, str):
        shipped = table(cmap)
        if shipped is not None:
            return srgb_to_linear(shipped)
        try:
            import matplotlib
        except ImportError:
            message = f"the colour map {cmap!r} needs the package matplotlib: pip install isospline[color]"
            raise ImportError(message) from None
        if cmap not in matplotlib.colormaps:
            raise ValueError(f"cmap: expected the name of a colour map of matplotlib, got {cmap!r}")
        cmap = matplotlib.colormaps[cmap]
    if callable(cmap):
        colors = np.asarray(cmap(np.linspace(0, 1, 256)))
        if colors.ndim != 2 or colors.shape[1] not in (3, 4) or colors.dtype.kind not in "iuf":
            raise TypeError(f"cmap: expected a map that makes colours of numbers, got {type(cmap).__name__}")
        return srgb_to_linear(colors[:, :3])
    try:
        colors = np.asarray(cmap, dtype=float)
    except (TypeError, ValueError):
        raise TypeError(f"cmap: expected a name or an (N, 3) array of colours, got {type(cmap).__name__}") from None
    if colors.ndim != 2 or colors.shape[1] != 3:
        raise ValueError(f"cmap: expected a name or an (N, 3) array of colours, got shape {colors.shape}")
    return colors


@explained
def ridges_and_valleys(
    curvature: float, *, color: ArrayLike = 0.5, ridge: ArrayLike = 1.0, valley: ArrayLike = 0.0
) -> _core.ColorByCurvature:
    """Colour a surface so that its ridges and its valleys stand out.

    The colour goes from that of valleys, where the mean curvature is ``-curvature`` and beyond, through that of the
    surface, where it is zero, to that of ridges.

    Parameters
    ----------
    curvature : float
        Mean curvature at which the full colour is reached, 1 / world unit: half the inverse of the radius of an edge.
    color, ridge, valley : float or (3,) float
        Linear colours.

    Returns
    -------
    ColorByCurvature

    Examples
    --------
    >>> import isospline
    >>> engraved = isospline.Phong(color=isospline.ridges_and_valleys(0.4, valley=(0.2, 0.05, 0)))
    """
    colors = np.stack([np.broadcast_to(np.asarray(each, dtype=float), 3) for each in (valley, color, ridge)])
    return _core.ColorByCurvature("mean", limits=(-curvature, curvature), cmap=colors)
