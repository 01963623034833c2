"""Materials: the looks of objects in all lights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..base.parameters import number, optional, text
from ..base.signatures import explained_methods
from ..colors import look_color
from .shadings import _Look

if TYPE_CHECKING:
    from ..base.types import Color, GivenColor


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class Material(_Look):
    r"""The look of a surface: its colour, its opacity, and how it scatters light.

    For path tracing, it is a diffuse base under a rough dielectric coat, or a rough metal:

    .. math:: f = (1 - m) \frac{c}{\pi} (1 - F_d(i)) (1 - F_d(o))
                  + \frac{F(h) D(h) G(i, o)}{4 \langle n, i \rangle \langle n, o \rangle}

    with the half vector h of the directions i to the light and o to the viewer, the colour c, the metallic part m, the
    distribution D of Trowbridge and Reitz (GGX) of width roughness^2, Smith's masking G and Schlick's Fresnel term

    .. math:: F(h) = F_0 + (F_{90} - F_0) (1 - \langle h, o \rangle)^5.

    A dielectric has F0 = 0.08 `specular` and F90 = min(50 F0, 1); F90 is 1 for F0 >= 0.02, which is water or
    ``specular=0.25``. A metal has F0 = c and F90 = 1. Between them, both are interpolated by m. Fd is the F of the
    dielectric, at the normal. With ``specular=0`` and ``metallic=0`` this is Lambert's law.

    Parameters
    ----------
    color : str, float, (3,) float, or a rule such as ColorByVolume, optional
        A name, sRGB from 0 to 1, or a rule. The colours of a mesh's vertices are multiplied by it. By default,
        the light decides: a `PathTracer` uses 0.8, and a shading its own colour.
    metallic, roughness, specular : float
        0 to 1; a roughness below 0.03 counts as 0.03. A `PathTracer` uses them, and a `Studio` uses `specular`.
    cap_color : as color, optional
        Colour of caps (`Isosurface(..., capped=True)` or ``closed=True``); by default `color`. A rule, such as
        ``ColorByVolume(volume, "gray")``, is not lit: its colours are those of its colour bar.
    opacity : float
        0 to 1. Path tracers draw all surfaces opaque.
    silhouette_opacity : float, optional
        As in `Phong`.
    silhouette_exponent : float
        As in `Phong`.
    name : str
        What legends call objects of this material.

    Raises
    ------
    ValueError
        For numbers outside of these ranges, and unknown names of colours.

    Notes
    -----
    An object's material is, in this order: the one that ``PathTracer(materials=)`` has for it; its own, from
    ``Mesh(..., material=)`` or ``Isosurface(..., material=)``; or ``PathTracer(material=)``.

    References
    ----------
    S. Lagarde, C. de Rousiers, "Moving Frostbite to physically based rendering", SIGGRAPH 2014 course (F90);
    B. Walter et al., "Microfacet models for refraction through rough surfaces", EGSR 2007; E. Heitz, "Understanding the
    masking-shadowing function in microfacet-based BRDFs", JCGT 3(2), 2014.

    Examples
    --------
    >>> import isospline
    >>> bone = isospline.Material((0.9, 0.85, 0.7), roughness=0.6)
    >>> gold = isospline.Material((1.0, 0.77, 0.34), metallic=1, roughness=0.25)
    """

    color: GivenColor | None
    metallic: float
    roughness: float
    specular: float
    cap_color: GivenColor | None
    opacity: float
    silhouette_opacity: float | None
    silhouette_exponent: float
    name: str

    def __init__(
        self,
        color: Color | None = None,
        *,
        metallic: float = 0.0,
        roughness: float = 0.5,
        specular: float = 0.5,
        cap_color: Color | None = None,
        opacity: float = 1.0,
        silhouette_opacity: float | None = None,
        silhouette_exponent: float = 3.0,
        name: str = "",
    ) -> None:
        self._keep_look(
            color=optional(look_color, color, "color"),
            metallic=number(metallic, "metallic"),
            roughness=number(roughness, "roughness"),
            specular=number(specular, "specular"),
            cap_color=cap_color,
            opacity=opacity,
            silhouette_opacity=silhouette_opacity,
            silhouette_exponent=silhouette_exponent,
            name=text(name, "name"),
        )

    def evaluate(self, to_viewer: ArrayLike, to_light: ArrayLike) -> NDArray[np.float64]:
        """The scattering function f, for unit directions away from a surface whose normal is (0, 0, 1).

        Parameters
        ----------
        to_viewer, to_light : (..., 3) array_like
            Both of the same shape.

        Returns
        -------
        (..., 3) float64 array
            For red, green and blue, per steradian; zero if a direction is below the surface.

        Raises
        ------
        ValueError
            If the colour is a rule, because it then depends on the point, and for different shapes.
        """
        return _core._evaluate_material(self, to_viewer, to_light)
