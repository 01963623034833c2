"""Hemisphere lighting."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.parameters import vector
from ..base.signatures import explained_methods
from ..colors import look_color
from .shadings import _Shading

if TYPE_CHECKING:
    from ..base.types import Color, GivenColor


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class Hemisphere(_Shading):
    r"""The light of a sky above and of a black ground below.

    .. math:: I = \frac{1 + \langle N, U \rangle}{2}

    Parameters
    ----------
    color : str, float, (3,) float, or a rule such as ColorByVolume
        Colour of the surface.
    up : (3,) array_like
        U, of any length.
    opacity, silhouette_opacity, silhouette_exponent, cap_color
        As in `Phong`.
    """

    color: GivenColor
    up: NDArray[np.float64]
    opacity: float
    silhouette_opacity: float | None
    silhouette_exponent: float
    cap_color: GivenColor | None

    def __init__(
        self,
        *,
        color: Color = 1.0,
        up: ArrayLike = (0, 0, 1),
        opacity: float = 1.0,
        silhouette_opacity: float | None = None,
        silhouette_exponent: float = 3.0,
        cap_color: Color | None = None,
    ) -> None:
        self._keep_look(
            color=look_color(color, "color"),
            up=vector(up, "up"),
            opacity=opacity,
            silhouette_opacity=silhouette_opacity,
            silhouette_exponent=silhouette_exponent,
            cap_color=cap_color,
        )
