"""Rules that depend on objects: on others, on the values of a mesh, or on the solid of a surface."""

from __future__ import annotations

import math
from copy import deepcopy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..base.parameters import check_type, flag, number, optional, text
from ..base.signatures import explained_methods
from ..base.values import parts
from ..scene import Isosurface
from ..scene.conversions import as_target
from .rule import _IndexedRule, _MeasuredRule, transform_of, two_numbers

if TYPE_CHECKING:
    from ..base.types import ColorMap, Placeable
    from ..scene import Scene


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class ColorByDistance(_IndexedRule):
    """The colour of a surface by its distance.

    The distance is that of `Scene.closest_points`, from each point to the nearest one of the other objects, in world
    units, to a millionth of a cell; it takes some microseconds for each ray of a pixel.

    Parameters
    ----------
    other : Isosurface, Mesh, Scene, a mesh of another library, or (N, 3) array_like
        The objects as they are now, in the world of the scene that is rendered; or points.
    cmap : str, matplotlib Colormap or (N, 3) array_like
        The name of a matplotlib map, a map object, or two or more colours at equal steps, sRGB from 0 to 1 or named.
        Between them, colours are interpolated in linear light.
    limits : (float, float), optional
        Distances of the first and of the last colour, world units. By default those of 98% of 500 points of the
        coloured objects: from 0, or as far below 0 if they are signed.
    signed : bool
        Whether distances are negative inside of the other objects, of which meshes must be closed, as in
        `Scene.signed_distance`.
    label : str
        The title of the colour bar; by default "distance" or "signed distance", with the unit.

    Raises
    ------
    ValueError
        For limits that are equal or not finite, an unknown map, objects without points, and signed distances of points.
        When the picture is made, for objects in another unit of length than that of the scene.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.sphere(0.7)
    >>> scan = isospline.Isosurface(field.volume(32), field.level)
    >>> corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    >>> part = isospline.Mesh(corners, [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    >>> deviation = isospline.ColorByDistance(part, limits=(-0.5, 0.5))
    >>> isospline.render(scan, color=deviation, size=(32, 24))
    Image(32 x 24, 45% covered)
    """

    #: Scene: a copy of the objects from which the distance is measured.
    other: Scene
    #: (N, 3) float64 array: colours, sRGB, at equal steps from the first limit to the second.
    cmap: NDArray[np.float64]
    limits: tuple[float, float] | None
    #: bool: whether distances are negative inside of the other objects.
    signed: bool
    #: str: the title of the colour bar; empty if it was not given.
    label: str

    def __init__(
        self,
        other: Placeable | Scene | ArrayLike,
        cmap: ColorMap = "coolwarm",
        *,
        limits: tuple[float, float] | None = None,
        signed: bool = True,
        label: str = "",
    ) -> None:
        between = optional(two_numbers, limits, "limits")
        is_signed = flag(signed, "signed")
        target = as_target(other, is_signed)
        self._keep(cmap=cmap, limits=between, signed=is_signed, label=text(label, "label"))
        largest = math.inf if between is None else max(map(abs, between))
        object.__setattr__(self, "_index", _core._DistanceIndex(_as_it_is(target), is_signed, largest))

    def __getattr__(self, name: str) -> Any:
        if name == "other":  # a new copy each time: the index is that of the objects as they were
            return _as_it_is(self._index.scene)
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    def _distances(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """The distances of points (N, 3) from the other objects."""
        return self._index.scene.closest_points(points)["distances"]

    def _within(self, limits: tuple[float, float]) -> ColorByDistance:
        """The same rule with other limits."""
        given = parts(self)
        del given["other"]
        index = _core._DistanceIndex(self._index.scene, self.signed, max(map(abs, limits)))
        return self._with(index, **given | {"limits": limits})


def _as_it_is(scene: Scene) -> Scene:
    """A copy whose surfaces keep their levels, with what the scene has built."""
    copied = deepcopy(scene)
    copied._share_built_objects(scene)
    return copied


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class ColorByValue(_MeasuredRule):
    """The colour of a mesh by the values at its vertices.

    Inside of a triangle with the values v and barycentric coordinates b, the value is

    .. math:: b_0 v_0 + b_1 v_1 + b_2 v_2

    A mesh with different values, but without a colour and colours of its vertices, has this colour by default.

    Parameters
    ----------
    cmap : str, matplotlib Colormap or (N, 3) array_like
        The name of a matplotlib map, a map object, or two or more colours at equal steps, sRGB from 0 to 1 or named.
        Between them, colours are interpolated in linear light.
    limits : (float, float), optional
        Values of the first and of the last colour; by default the smallest and the largest value of all meshes with
        this rule whose values have the same name.
    label : str
        The title of the colour bar: what the values are, with their unit, such as ``"temperature in K"``. By default
        `Mesh.values_name`.

    Raises
    ------
    ValueError
        For limits that are equal or not finite, an unknown map.

    Notes
    -----
    Where a corner's value is NaN, a triangle is grey, as are meshes without values, and isosurfaces. Other values that
    are not finite do not count for the default limits. If all values are the same, their colour is the middle one.

    Examples
    --------
    >>> import isospline
    >>> corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    >>> mesh = isospline.Mesh(corners, [(0, 1, 2)], values=[20, 30, 40], values_name="temperature in K")
    >>> isospline.render(mesh, size=(32, 24), annotate=True)
    Image(32 x 24, 4% covered)
    >>> hot = isospline.Mesh(mesh, color=isospline.ColorByValue("magma", limits=(0, 100)))
    """

    #: (N, 3) float64 array: colours, sRGB, at equal steps from the first limit to the second.
    cmap: NDArray[np.float64]
    limits: tuple[float, float] | None
    #: str: the title of the colour bar; empty if it was not given.
    label: str

    def __init__(
        self, cmap: ColorMap = "viridis", *, limits: tuple[float, float] | None = None, label: str = ""
    ) -> None:
        self._keep(cmap=cmap, limits=optional(two_numbers, limits, "limits"), label=text(label, "label"))


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class ColorByThickness(_IndexedRule):
    """The colour of a surface by the thickness of its solid.

    The thickness is that of `Isosurface.thickness`, in world units of the scene. It is that of the solid when the
    picture is made, of each surface that has this colour.

    Parameters
    ----------
    cmap : str, matplotlib Colormap or (N, 3) array_like
        The name of a matplotlib map, a map object, or two or more colours at equal steps, sRGB from 0 to 1 or named.
        Between them, colours are interpolated in linear light.
    limits : (float, float), optional
        Thicknesses of the first and of the last colour, world units; by default from 0 to what 98% of the area are
        below, of 500 random points of each surface that has this colour.
    method : {"ray", "max_sphere"}
        As in `Isosurface.thickness`, of which the other one is the default: "ray" takes some microseconds for each ray
        of a pixel, "max_sphere" milliseconds.
    ripple : float, optional
        For "max_sphere", as in `Isosurface.thickness`, in world units of the surface.
    surface : Isosurface, optional
        The surface as it is now, whose solid is measured; by default that which has this colour. Points that are not on
        it have the thickness at its nearest point. Meshes need one.
    transform : (4, 4) array_like, optional
        Maps the world space of `surface` to the scene's, as in `Scene.add`: a rotation, a translation and a uniform
        scale. By default they are the same.
    label : str
        The title of the colour bar; by default "thickness", with the unit.

    Raises
    ------
    ValueError
        For limits that are equal or not finite, an unknown map or method, a ripple below 0, and another transform. When
        the picture is made, for a mesh without `surface`, an object whose transform is not such a one, and a `surface`
        in another unit of length than that of the scene.

    Notes
    -----
    The last colour is that of all larger thicknesses, also of infinite ones, where the solid is open.

    A mesh with values shows the thickness by "max_sphere" at its vertices, which is faster than at each pixel:
    ``Mesh(mesh, values=surface.thickness(mesh.vertices), values_name="thickness")``.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.torus(0.6, 0.25)
    >>> torus = isospline.Isosurface(field.volume(32), field.level)
    >>> isospline.render(torus, color=isospline.ColorByThickness(), annotate=True, size=(32, 24))
    Image(32 x 24, 11% covered)
    """

    #: (N, 3) float64 array: colours, sRGB, at equal steps from the first limit to the second.
    cmap: NDArray[np.float64]
    limits: tuple[float, float] | None
    method: Literal["max_sphere", "ray"]
    ripple: float | None
    #: Isosurface or None: a copy of the surface whose solid is measured.
    surface: Isosurface | None
    #: (4, 4) float64 array: from the world space of `surface` to the scene's.
    transform: NDArray[np.float64]
    #: str: the title of the colour bar; empty if it was not given.
    label: str

    def __init__(
        self,
        cmap: ColorMap = "viridis",
        *,
        limits: tuple[float, float] | None = None,
        method: Literal["max_sphere", "ray"] = "ray",
        ripple: float | None = None,
        surface: Isosurface | None = None,
        transform: ArrayLike | None = None,
        label: str = "",
    ) -> None:
        check_type(surface, "surface", (Isosurface, type(None)), "an Isosurface")
        self._keep(
            cmap=cmap,
            limits=optional(two_numbers, limits, "limits"),
            method=text(method, "method"),
            ripple=optional(number, ripple, "ripple"),
            transform=transform_of(transform),
            label=text(label, "label"),
        )
        given: Any = surface
        object.__setattr__(self, "_index", _core._ThicknessIndex(self.method, self.ripple, given, self.transform))

    def __getattr__(self, name: str) -> Any:
        if name == "surface":  # a new copy each time: the index is that of the surface as it was
            return self._index.surface
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
