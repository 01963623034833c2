"""Colours: transfer curves, colour maps by name, ready-made colourings."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .base.color_tables import table
from .base.handed import handed
from .base.mistakes import sentence
from .base.parameters import check_plain

#: Kinds of curvature by which surfaces are coloured, by their names in the viewer and on the command line.
CURVATURES: dict[str, Any] = {f"{kind}-curvature": kind for kind in ("mean", "gaussian", "maximum", "minimum")}

#: Colours of surfaces and meshes in the order in which they are added.
COLORS = ("#d9c7a8", "#c8553d", "#588b8b", "#93b7be", "#8d6a9f", "#e0a458", "#5b7553", "#7d8597")
#: The background.
BACKGROUND = "#e8ebef"


def linear_to_srgb(linear: ArrayLike) -> NDArray[np.float64]:
    """The transfer curve of sRGB (IEC 61966-2-1), for values that are clipped to [0, 1]."""
    linear = np.minimum(np.maximum(linear, 0.0), 1.0)  # np.clip takes longer for one colour
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def srgb_to_linear(srgb: ArrayLike) -> NDArray[np.float64]:
    """The inverse of `linear_to_srgb`, on [0, 1]."""
    srgb = np.asarray(srgb, dtype=float)
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


class Linear(np.ndarray[Any, np.dtype[np.float64]]):
    """Linear numbers of colours; see `linear`."""


@handed
def linear(color: ArrayLike) -> NDArray[np.float64]:
    """Mark numbers of colours as linear, in proportion to light. All others are sRGB, as on displays.

    Examples
    --------
    >>> import isospline
    >>> isospline.Phong(color=isospline.colors.linear((0.5, 0.5, 0.5))).color.round(3)
    array([0.735, 0.735, 0.735])
    """
    return np.asarray(color, dtype=float).view(Linear)


@handed
def encoded(color: ArrayLike) -> NDArray[np.float64]:
    """The numbers in sRGB of linear ones, without the rounding of the curve and its inverse."""
    return linear_to_srgb(np.asarray(color, dtype=float)).round(12).view(np.ndarray)


@handed
def decoded(color: Any) -> Any:
    """Linear numbers of one colour, from sRGB and, if there are four, an opacity; what is no colour as it is."""
    if isinstance(color, (str, Linear)) or np.ma.is_masked(color):  # which the caller refuses
        return color
    try:
        numbers = np.asarray(color, dtype=float)
    except (TypeError, ValueError, RuntimeError):
        return color
    is_color = numbers.shape in ((), (1,), (3,), (4,)) and ((numbers >= 0) & (numbers <= 1)).all()
    if not is_color or np.asarray(color).dtype.kind not in "iuf":
        return color
    return srgb_to_linear(numbers) if numbers.ndim == 0 else np.append(srgb_to_linear(numbers[:3]), numbers[3:])


# Names of matplotlib that differ from those of CSS, which Pillow knows.
_MATPLOTLIB = {
    "b": "#0000ff",
    "g": "#008000",
    "r": "#ff0000",
    "c": "#00bfbf",
    "m": "#bf00bf",
    "y": "#bfbf00",
    "k": "#000000",
    "w": "#ffffff",
    "tab:blue": "#1f77b4",
    "tab:orange": "#ff7f0e",
    "tab:green": "#2ca02c",
    "tab:red": "#d62728",
    "tab:purple": "#9467bd",
    "tab:brown": "#8c564b",
    "tab:pink": "#e377c2",
    "tab:gray": "#7f7f7f",
    "tab:grey": "#7f7f7f",
    "tab:olive": "#bcbd22",
    "tab:cyan": "#17becf",
}


@handed
def named_color(name: str, parameter: str = "color", takes_opacity: bool = False) -> NDArray[np.float64]:
    """Linear red, green and blue of a name, and its opacity if it has one and `takes_opacity` allows it.

    Names are those of CSS, such as "white" and "rebeccapurple", "#rgb" and "#rrggbb", the letters "rgbcmykw" and
    "tab:blue" of matplotlib and, if that is installed, all its other names: "xkcd:sky blue", "C3", "0.5".

    Raises
    ------
    ValueError
        For an unknown name, and for one with an opacity that is not allowed.

    Examples
    --------
    >>> from isospline.colors import named_color
    >>> named_color("white")
    array([1., 1., 1.])
    >>> named_color("tab:orange").round(2)
    array([1.  , 0.21, 0.  ])
    """
    srgb = _srgb_of(_MATPLOTLIB.get(name.lower(), name))
    if srgb is None:
        expected = 'numbers from 0 to 1 or the name of a colour, such as "white" or "#ff8000"'
        raise ValueError(sentence(parameter, expected, name))
    color, opacity = srgb_to_linear(srgb[:3]), srgb[3:]
    if takes_opacity:
        return np.append(color, opacity)
    if len(opacity) and opacity[0] != 1:
        raise ValueError(sentence(parameter, "the name of a colour without an opacity", name))
    return color


def _srgb_of(name: str) -> NDArray[np.float64] | None:
    """Red, green, blue and, if given, the opacity, from 0 to 1."""
    from PIL import ImageColor

    try:
        parts = np.array(ImageColor.getrgb(name)) / 255
        return parts if (parts <= 1).all() else None  # of rgb(300, 0, 0)
    except ValueError:
        pass
    try:
        from matplotlib.colors import to_rgba
    except ImportError:
        return None
    try:
        return np.array(to_rgba(name))
    except ValueError:
        return None


def color_of(place: int) -> str:
    """The colour of the object with this index, from 0 on."""
    return COLORS[place % len(COLORS)]


def hex_of(linear: ArrayLike) -> str:
    """``"#rrggbb"`` of a linear colour, in sRGB."""
    return "#" + "".join(f"{round(255 * float(part)):02x}" for part in linear_to_srgb(linear))


@handed
def vertex_colors(colors: Any, count: int) -> Any:
    """The colours of `count` vertices, from one name for all, one name each, or numbers."""
    if isinstance(colors, str):
        return linear(np.broadcast_to(named_color(colors, "colors"), (count, 3)))
    if isinstance(colors, np.ndarray) and colors.shape != (count, 3):
        return colors  # the caller refuses them, before memory is spent on them
    return _without_names(colors, "colors")


def _without_names(colors: Any, parameter: str) -> Any:
    """Linear colours, from names and numbers in sRGB; what are no colours stay as they are."""
    if isinstance(colors, (list, tuple)) and any(isinstance(color, str) for color in colors):
        return [named_color(color, parameter) if isinstance(color, str) else decoded(color) for color in colors]
    if isinstance(colors, Linear) or np.ma.is_masked(colors):
        return colors
    try:
        numbers = np.asarray(colors)
    except (TypeError, ValueError, RuntimeError):
        return colors
    is_color = numbers.ndim == 2 and numbers.shape[1] == 3 and numbers.dtype.kind in "iuf"
    if not is_color or numbers.dtype == np.uint8 or not ((numbers >= 0) & (numbers <= 1)).all():
        return colors
    return linear(srgb_to_linear(numbers))


def one_color(color: Any, parameter: str) -> NDArray[np.float64]:
    """Linear red, green and blue of a number, three numbers or a name."""
    check_plain(color, parameter)
    given = decoded(color)
    parts = named_color(given, parameter) if isinstance(given, str) else np.asarray(given, dtype=float)
    if parts.shape not in ((), (1,), (3,)):
        raise ValueError(f"{parameter}: expected one number, three (red, green, blue) or a name, got {color!r}")
    if not (np.isfinite(parts).all() and (parts >= 0).all() and (parts <= 1).all()):
        raise ValueError(above_one(parameter, color))
    return np.array(np.broadcast_to(parts, 3))


def look_color(value: Any, parameter: str) -> Any:
    """The colour of a look: linear numbers, marked as such, from a name or numbers in sRGB; a rule as it is."""
    return _core._look_color(value, parameter)


@handed
def above_one(parameter: str, color: ArrayLike) -> str:
    """A hint for a colour outside of 0 to 1: perhaps it has 8 bits."""
    parts = np.broadcast_to(np.asarray(color, dtype=float).ravel()[:3], 3)
    of_eight_bits = (parts >= 0).all() and (parts <= 255).all() and (parts % 1 == 0).all() and parts.max() > 1
    meaning = f'"#{"".join(f"{int(part):02x}" for part in parts)}"' if of_eight_bits else None
    shown = color if isinstance(color, (int, float)) else tuple(np.asarray(color, dtype=float).ravel().tolist())
    return sentence(parameter, "numbers from 0 to 1 for red, green and blue", shown, meaning)


def color_map(cmap: Any) -> NDArray[np.float64]:
    """Linear colours at equal steps of a colour map.

    Parameters
    ----------
    cmap : str, matplotlib Colormap or (N, 3) array_like
        The name of a colour map of matplotlib, such as ``"viridis"``, its object, or two or more colours, sRGB or
        named.

    Returns
    -------
    (N, 3) float64 array
        Linear. For a map of matplotlib, 256 colours that look like it after encoding in sRGB.

    Raises
    ------
    ValueError
        For an unknown name, for an array of another shape, and for colours outside of 0 to 1.
    TypeError
        For what is neither a name, nor a map, nor an array of colours.
    ImportError
        For a name other than "viridis" and "coolwarm" if matplotlib is not installed.

    Examples
    --------
    >>> from isospline.colors import color_map
    >>> color_map([(0, 0, 0), (1, 0.5, 0)]).round(3)
    array([[0.   , 0.   , 0.   ],
           [1.   , 0.214, 0.   ]])
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
        return srgb_to_linear(_checked(colors[:, :3]))
    check_plain(cmap, "cmap")
    numbers = _without_names(cmap, "cmap")
    try:
        colors = np.asarray(numbers, dtype=float)
    except (TypeError, ValueError):
        raise TypeError(f"cmap: expected a name or an (N, 3) array of colours, got {type(cmap).__name__}") from None
    if colors.ndim != 2 or colors.shape[1] != 3:
        raise ValueError(f"cmap: expected a name or an (N, 3) array of colours, got shape {colors.shape}")
    return _checked(colors)


def _checked(colors: NDArray[Any]) -> NDArray[Any]:
    """The colours of a map, if all their numbers are from 0 to 1."""
    is_wrong = ~((colors >= 0) & (colors <= 1)).all(axis=1)
    if is_wrong.any():
        raise ValueError(above_one("cmap", [float(f"{part:.6g}") for part in colors[is_wrong][0]]))
    return colors
