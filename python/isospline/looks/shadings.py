"""Shadings: the illumination models of surfaces.

Numbers are checked by the compiled module, where programs in C++ need the checks, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..base.parameters import flag, number, optional, whole_number
from ..base.signatures import explained_methods
from ..base.values import Value
from ..colors import Linear, encoded, look_color
from ..lights import point_lights

if TYPE_CHECKING:
    from typing import Any

    from typing_extensions import Self

    from ..base.types import Color, GivenColor
    from ..lights import _PointLight


class _Look(Value):
    """A shading or a material. Its attributes have colours in sRGB; `_exact` has them in linear numbers."""

    #: The parameter that is the colour of the surface.
    _surface_parameter: ClassVar[str] = "color"

    def _keep(self, **fields: Any) -> None:
        exact = {name: each for name, each in fields.items() if isinstance(each, Linear)}
        object.__setattr__(self, "_exact", exact)
        super()._keep(**fields | {name: encoded(each) for name, each in exact.items()})

    def _keep_look(
        self,
        *,
        opacity: float,
        silhouette_opacity: float | None,
        silhouette_exponent: float,
        cap_color: Color | None,
        **others: Any,
    ) -> None:
        """Keep the parameters that all looks have, and others, which are in their final form."""
        self._keep(
            **others,
            opacity=number(opacity, "opacity"),
            silhouette_opacity=optional(number, silhouette_opacity, "silhouette_opacity"),
            silhouette_exponent=number(silhouette_exponent, "silhouette_exponent"),
            cap_color=optional(look_color, cap_color, "cap_color"),
        )

    def _check(self) -> None:
        _core._check_look(self)

    def _taking(self, other: _Look, names: Iterable[str]) -> Self:
        """The same look with parameters of another one, which has checked them; "color" is that of the surface."""
        taken, exact = dict(vars(self)), dict(self._exact)
        for name in names:
            own, theirs = (self._surface_parameter, other._surface_parameter) if name == "color" else (name, name)
            taken[own] = getattr(other, theirs)
            exact.pop(own, None)
            if theirs in other._exact:
                exact[own] = other._exact[theirs]
        made = object.__new__(type(self))
        vars(made).update(taken, _exact=exact)
        return made


class _Shading(_Look):
    """An illumination model of surfaces."""


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class Phong(_Shading):
    r"""Phong's illumination model in the paper's form.

    .. math:: I = k_a I_a + \sum_k I_k (k_d \langle N, L_k \rangle + k_s \langle V, R_k \rangle^{n_s}),
              \quad R_k = 2 N \langle N, L_k \rangle - L_k

    with the unit normal N, the unit vectors L_k to the lights and V to the viewer. Negative products count as zero.
    Every intensity has a red, a green and a blue part. The surface's colour multiplies the ambient and the diffuse
    term; highlights have the colour of the light.

    Parameters
    ----------
    color : str, float, (3,) float, or a rule such as ColorByVolume
        Colour of the surface: a name, sRGB from 0 to 1, or a rule. The colours of a mesh's vertices are
        multiplied by it.
    ambient, diffuse, specular : float
        The coefficients k_a, k_d and k_s, at least 0.
    specular_exponent : float
        n_s, at least 0.
    ambient_light : float or (3,) float
        I_a.
    lights : sequence of PositionalLight and DirectionalLight, optional
        By default two directional lights that move with the camera: one over the viewer's left shoulder, and one from
        the right, a quarter as bright. With an empty sequence there is only the ambient term.
    two_sided : bool
        Flips normals with negative <N, V> to face the viewer, so that the inside of an open or cut surface is lit like
        its outside. With False, it is exactly the paper's formula.
    shadows : bool
        Whether isosurfaces and meshes cast shadows. Translucent ones let a part of the light through, by their opacity.
    shadow_samples : int
        Shadow rays per hit to each light with an `angle`, 1 to 65536. The rays of a pixel spread over the light, too.
    opacity : float
        0 to 1; below 1, objects behind show through, see `render`.
    silhouette_opacity : float, optional
        0 to 1: the opacity at the silhouette, for example 1 to keep edges visible. The opacity at a point is
        o + (silhouette_opacity - o) (1 - abs(<N, V>))^silhouette_exponent, where o is `opacity` and V the unit vector
        against the ray. By default it is `opacity` everywhere.
    silhouette_exponent : float
        Above 0; the larger, the thinner the silhouette.
    cap_color : as color, optional
        Colour of caps (`Isosurface(..., capped=True)` or ``closed=True``); by default that of the surface. A rule, such
        as ``ColorByVolume(volume, "gray")``, is not lit: its colours are those of its colour bar.

    Raises
    ------
    ValueError
        For numbers that are negative or not finite, opacities above 1, a silhouette exponent of 0, and a number of
        shadow rays out of range.

    References
    ----------
    P. Thévenaz, M. Unser, "High-quality isosurface rendering with exact gradient", ICIP 2001, section 6;
    D. S. Kay, D. Greenberg, "Transparency for computer synthesized images", SIGGRAPH 1979 (opacity at silhouettes).

    Examples
    --------
    >>> import isospline
    >>> isospline.Phong(color=(1, 0.8, 0.6), lights=[isospline.PositionalLight((10, -20, 30))]).specular_exponent
    30.0
    """

    color: GivenColor
    ambient: float
    diffuse: float
    specular: float
    specular_exponent: float
    ambient_light: NDArray[np.float64]
    lights: tuple[_PointLight, ...] | None
    two_sided: bool
    shadows: bool
    shadow_samples: int
    opacity: float
    silhouette_opacity: float | None
    silhouette_exponent: float
    cap_color: GivenColor | None

    def __init__(
        self,
        *,
        color: Color = 1.0,
        ambient: float = 0.05,
        diffuse: float = 0.7,
        specular: float = 0.2,
        specular_exponent: float = 30.0,
        ambient_light: str | ArrayLike = 1.0,
        lights: Sequence[_PointLight] | None = None,
        two_sided: bool = True,
        shadows: bool = False,
        shadow_samples: int = 1,
        opacity: float = 1.0,
        silhouette_opacity: float | None = None,
        silhouette_exponent: float = 3.0,
        cap_color: Color | None = None,
    ) -> None:
        self._keep_look(
            color=look_color(color, "color"),
            ambient=number(ambient, "ambient"),
            diffuse=number(diffuse, "diffuse"),
            specular=number(specular, "specular"),
            specular_exponent=number(specular_exponent, "specular_exponent"),
            ambient_light=_core._color(ambient_light, "ambient_light"),
            lights=optional(point_lights, lights, "lights"),
            two_sided=flag(two_sided, "two_sided"),
            shadows=flag(shadows, "shadows"),
            shadow_samples=whole_number(shadow_samples, "shadow_samples"),
            opacity=opacity,
            silhouette_opacity=silhouette_opacity,
            silhouette_exponent=silhouette_exponent,
            cap_color=cap_color,
        )


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class Outline(_Shading):
    r"""The paper's outline illumination model.

    .. math:: I = (1 - \langle N, V \rangle^2)^{n_o}

    with the unit normal N and the unit vector V to the viewer: bright where the surface turns away. It needs no light.
    I goes from the surface's colour (0) to the colour of the lines (1).

    Parameters
    ----------
    exponent : float
        n_o, at least 0; the larger, the thinner the lines.
    color : str, float, (3,) float, or a rule such as ColorByVolume
        Colour of the lines: a name, sRGB from 0 to 1, or a rule.
    surface_color : as color
        Colour of the surface between the lines. The colours of a mesh's vertices are multiplied by it.
    opacity : float
        0 to 1; below 1, objects behind show through, see `render`.
    silhouette_opacity : float, optional
        0 to 1: the opacity at the silhouette, for example 1 to keep edges visible. The opacity at a point is
        o + (silhouette_opacity - o) (1 - abs(<N, V>))^silhouette_exponent, where o is `opacity` and V the unit vector
        against the ray. By default it is `opacity` everywhere.
    silhouette_exponent : float
        Above 0; the larger, the thinner the silhouette.
    cap_color : as color, optional
        Colour of caps (`Isosurface(..., capped=True)` or ``closed=True``); by default `surface_color`. A rule, such as
        ``ColorByVolume(volume, "gray")``, is not lit: its colours are those of its colour bar.

    Raises
    ------
    ValueError
        For numbers that are negative or not finite, opacities above 1, and a silhouette exponent of 0.

    References
    ----------
    P. Thévenaz, M. Unser, "High-quality isosurface rendering with exact gradient", ICIP 2001, section 6;
    D. S. Kay, D. Greenberg, "Transparency for computer synthesized images", SIGGRAPH 1979 (opacity at silhouettes).

    Examples
    --------
    >>> import isospline
    >>> ink_on_paper = isospline.Outline(exponent=3, color=0, surface_color=1)
    """

    _surface_parameter = "surface_color"

    exponent: float
    color: GivenColor
    surface_color: GivenColor
    opacity: float
    silhouette_opacity: float | None
    silhouette_exponent: float
    cap_color: GivenColor | None

    def __init__(
        self,
        exponent: float = 2.0,
        *,
        color: Color = 1.0,
        surface_color: Color = 0.0,
        opacity: float = 1.0,
        silhouette_opacity: float | None = None,
        silhouette_exponent: float = 3.0,
        cap_color: Color | None = None,
    ) -> None:
        self._keep_look(
            exponent=number(exponent, "exponent"),
            color=look_color(color, "color"),
            surface_color=look_color(surface_color, "surface_color"),
            opacity=opacity,
            silhouette_opacity=silhouette_opacity,
            silhouette_exponent=silhouette_exponent,
            cap_color=cap_color,
        )


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class AmbientOcclusion(_Shading):
    r"""Ambient occlusion: the light of a uniform sky.

    .. math:: I = \frac{1}{\pi} \int_\Omega V(\omega) \langle N, \omega \rangle d\omega

    over the hemisphere about the normal N, which is flipped to face the viewer. V is the visibility of the sky: 0 if a
    ray meets an opaque surface within `distance`, the transmitted part if it meets translucent surfaces only,
    otherwise 1.

    Parameters
    ----------
    samples : int
        Rays per hit, 1 to 65536.
    distance : float
        World units, above 0; surfaces farther away hide nothing.
    color : str, float, (3,) float, or a rule such as ColorByVolume
        Colour of the surface: a name, sRGB from 0 to 1, or a rule. The colours of a mesh's vertices are
        multiplied by it.
    opacity : float
        0 to 1; below 1, objects behind show through, see `render`.
    silhouette_opacity : float, optional
        0 to 1: the opacity at the silhouette, for example 1 to keep edges visible. The opacity at a point is
        o + (silhouette_opacity - o) (1 - abs(<N, V>))^silhouette_exponent, where o is `opacity` and V the unit vector
        against the ray. By default it is `opacity` everywhere.
    silhouette_exponent : float
        Above 0; the larger, the thinner the silhouette.
    cap_color : as color, optional
        Colour of caps (`Isosurface(..., capped=True)` or ``closed=True``); by default that of the surface. A rule, such
        as ``ColorByVolume(volume, "gray")``, is not lit: its colours are those of its colour bar.

    Raises
    ------
    ValueError
        For numbers outside of these ranges.

    References
    ----------
    D. S. Kay, D. Greenberg, "Transparency for computer synthesized images", SIGGRAPH 1979 (opacity at silhouettes).

    Examples
    --------
    >>> import isospline
    >>> isospline.AmbientOcclusion(64, distance=20.0).color
    array([1., 1., 1.])
    """

    samples: int
    distance: float
    color: GivenColor
    opacity: float
    silhouette_opacity: float | None
    silhouette_exponent: float
    cap_color: GivenColor | None

    def __init__(
        self,
        samples: int = 16,
        *,
        distance: float = math.inf,
        color: Color = 1.0,
        opacity: float = 1.0,
        silhouette_opacity: float | None = None,
        silhouette_exponent: float = 3.0,
        cap_color: Color | None = None,
    ) -> None:
        self._keep_look(
            samples=whole_number(samples, "samples"),
            distance=number(distance, "distance"),
            color=look_color(color, "color"),
            opacity=opacity,
            silhouette_opacity=silhouette_opacity,
            silhouette_exponent=silhouette_exponent,
            cap_color=cap_color,
        )
