"""Triangle meshes."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from .conversions import mesh_without_faces
from .mesh_conversions import MeshConversions
from .public import attributes_of, public, with_attributes
from .scene_object import SceneObject

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Self

    from ..base.types import Color
    from ..looks import Material


@public
class Mesh(SceneObject, MeshConversions):
    """A triangle mesh.

    Parameters
    ----------
    vertices : (V, 3) array_like of numbers, world units
        Positions, kept in double precision. Or, without faces, a mesh of trimesh, PyVista, VTK or meshio.
    faces : (F, 3) array_like of integers, optional
        Rows of `vertices`. Seen from outside, the corners of a face are in counter-clockwise order.
    normals : (V, 3) array_like of numbers, optional
        Outward normals at the vertices, of any length. They are interpolated across each face for shading, and tell its
        outer side there, whatever the order of its corners. Ray queries return the normals of the faces.
    colors : (V, 3) array_like of numbers, str or sequence of str, optional
        Colours at the vertices, interpolated across each face: sRGB from 0 to 1, or from 0 to 255 if the type is uint8;
        or names, one for all vertices or one each. They are multiplied by the colour of a `Phong`, white by
        default, or of a `Material`.
    material : Material, optional
        Its look. A `PathTracer` or a `Studio` may have another material for it, and a dict of lights another look.
    color : str, float, (3,) float, or a rule such as ColorByVolume, optional
        Its colour, in place of `material`; as in `Material`. The colours of the vertices are multiplied by it. By
        default, the light decides.
    opacity : float, optional
        Its opacity from 0 to 1, in place of `material`. Path tracers draw all surfaces opaque.
    name : str, optional
        What legends call it.
    values : (V,) array_like of numbers, optional
        A number at each vertex, such as a temperature; NaN where it is unknown. Files and other libraries keep them.
        Without `colors` and a colour, pictures show them by `ColorByValue`, unless all are the same.
    values_name : str
        What the values are called in files, in other libraries and above the colour bar: ``"temperature in K"``. What
        is called "colors" or the like is called "colors_values" where that name means something else.

    Raises
    ------
    ValueError
        If a vertex is not finite, a face refers to a vertex that does not exist, normals or colours are not finite or
        not one for each vertex, values are not one for each vertex, or a colour is outside of 0 to 1.
    TypeError
        If the faces are not integers, or missing for an array of vertices. Also for a color, opacity or name together
        with a material.

    Examples
    --------
    >>> import isospline
    >>> mesh = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    >>> mesh.faces.shape
    (1, 3)
    """

    __slots__ = ()

    def __init__(
        self,
        vertices: ArrayLike | object,
        faces: ArrayLike | None = None,
        normals: ArrayLike | None = None,
        colors: ArrayLike | None = None,
        material: Material | None = None,
        values: ArrayLike | None = None,
        values_name: str = "values",
        *,
        color: Color | None = None,
        opacity: float | None = None,
        name: str | None = None,
    ) -> None:
        if faces is None:
            vertices = mesh_without_faces(vertices)
        super().__init__(vertices, faces, normals, colors, material, values, values_name, color, opacity, name)

    @property
    def vertices(self) -> NDArray[np.float64]:
        """(V, 3) float64 array, world units; read-only."""
        return super().vertices

    @property
    def faces(self) -> NDArray[np.uint32]:
        """(F, 3) uint32 array of rows of `vertices`; read-only."""
        return super().faces

    @property
    def normals(self) -> NDArray[np.float64] | None:
        """(V, 3) float64 array, as given; read-only. None without normals."""
        return super().normals

    @property
    def colors(self) -> NDArray[np.float64] | None:
        """(V, 3) float64 array, sRGB; a new array. None without colours."""
        return super().colors

    @property
    def values(self) -> NDArray[np.float64] | None:
        """(V,) float64 array, as given; read-only. None without values."""
        return super().values

    @property
    def values_name(self) -> str:
        """What the values are called."""
        return super().values_name

    @property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) float64 array: lower and upper corner of the box of all vertices, world units."""
        return super().bounds

    @property
    def material(self) -> Material | None:
        """Its look, or None."""
        return super().material

    def export(self, path: str | PathLike[str], *arguments: Any, **options: Any) -> None:
        """The same as `save`, by the name that trimesh has."""
        self.save(path, *arguments, **options)

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: Any) -> Self:
        return self

    def __reduce__(self) -> Any:
        vertices = self.normals, self._colors(), self.material, self.values, self.values_name
        return _made, (type(self), (self.vertices, self.faces, *vertices), attributes_of(self))


def _made(kind, parts, attributes):
    """A mesh of a class, from a pickle."""
    made = kind.__new__(kind)
    Mesh.__init__(made, *parts)
    return with_attributes(made, attributes)
