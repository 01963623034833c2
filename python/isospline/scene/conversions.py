"""Conversion of other types to volumes, meshes and objects of scenes."""

from __future__ import annotations

import numpy as np

from .._core import Isosurface, Mesh, Scene, Volume, _as_array
from ..base.handed import handed, known
from ..base.mistakes import sentence
from ..interop.meshio import mesh_from_meshio
from ..interop.trimesh import mesh_from_trimesh
from ..interop.vtk import mesh_from_vtk
from ..io.volume_data import VolumeData

# What converts a library's mesh, by the package of its type.
_MESHES = {
    "trimesh": mesh_from_trimesh,
    "pyvista": mesh_from_vtk,
    "meshio": mesh_from_meshio,
    "vtkmodules": mesh_from_vtk,
}


def as_volume(value, parameter, purpose=""):
    """A volume; also from a `VolumeData` or an array indexed [z, y, x]. `purpose` says in errors what it is for."""
    if isinstance(value, Volume):
        return value
    if isinstance(value, VolumeData):
        return value.to_volume()
    if isinstance(value, np.ndarray) and value.ndim in (3, 4):
        return VolumeData(value).to_volume()
    raise TypeError(sentence(parameter, f"a Volume, a VolumeData or a three-dimensional array{purpose}", value))


def _converter_of(value):
    """What converts a mesh of another library, also of a class that is derived from its classes; None for others."""
    packages = (kind.__module__.partition(".")[0] for kind in type(value).__mro__)
    return next((_MESHES[package] for package in packages if package in _MESHES), None)


def as_mesh(value, parameter):
    """A mesh; also from meshes of other libraries."""
    if isinstance(value, Mesh):
        return value
    if convert := _converter_of(value):
        return convert(known("Mesh"), value)
    expected = "an Isosurface, a Mesh, or a mesh of trimesh, PyVista, VTK or meshio"
    raise TypeError(sentence(parameter, expected, value))


def as_object(value, parameter):
    """An isosurface or a mesh; also from meshes of other libraries."""
    return value if isinstance(value, Isosurface) else as_mesh(value, parameter)


def mesh_without_faces(value):
    """The mesh that is given in place of vertices and faces."""
    if not isinstance(value, Mesh) and _converter_of(value) is None:
        if np.ndim(value) == 2:
            raise TypeError("faces: expected a value for this parameter of Mesh, got none")
        raise TypeError(
            sentence(
                "vertices", "an array of vertices, with faces, or a mesh of trimesh, PyVista, VTK or meshio", value
            )
        )
    return as_mesh(value, "vertices")


@handed
def joined_rays(origins, directions):
    """(..., 6) rays from their origins and directions, of shapes that broadcast."""
    pair = []
    for name, value in (("rays", origins), ("directions", directions)):
        array = _as_array(value, name)
        if array.ndim < 1 or array.shape[-1] != 3:
            hint = "; did you mean rays without directions?" if name == "rays" and array.shape[-1:] == (6,) else ""
            raise ValueError(
                f"{name}: expected shape (..., 3) with origins and directions apart, got {array.shape}{hint}"
            )
        pair.append(array)
    try:
        return np.concatenate(np.broadcast_arrays(*pair), axis=-1)
    except ValueError:
        raise ValueError(
            f"directions: expected one for each of the origins, of shape {pair[0].shape}, got shape {pair[1].shape}"
        ) from None


def as_target(other, is_signed):
    """The scene from which distances are measured: of objects, or of points as triangles without area."""
    if isinstance(other, Scene):
        scene = other
    elif isinstance(other, (Isosurface, Mesh)) or _converter_of(other):
        scene = known("Scene")([other])
    else:
        try:
            points = _as_array(other, "other")
        except TypeError:
            expected = "an Isosurface, a Mesh, a Scene or points of shape (N, 3)"
            raise TypeError(sentence("other", expected, other)) from None
        if points.ndim != 2 or points.shape[1] != 3:
            raise ValueError(
                f"other: expected an Isosurface, a Mesh, a Scene or points of shape (N, 3), got shape {points.shape}"
            )
        if is_signed:
            raise ValueError("signed: expected False for distances from points, which have no inside, got True")
        scene = known("Scene")([known("Mesh")(points, np.arange(len(points))[:, None].repeat(3, axis=1))])
    if not np.isfinite(scene.extent(np.eye(3))).all():
        raise ValueError("other: expected objects with points, got some without")
    return scene


def as_placed_objects(objects, *more):
    """Pairs of an object and its transform or None, from one or several objects with or without transforms."""
    if more:
        objects = [objects, *more]
    if isinstance(objects, Scene):
        raise TypeError(sentence("objects", "isosurfaces and meshes", objects))
    if isinstance(objects, (Isosurface, Mesh)) or _converter_of(objects):
        objects = [objects]
    try:
        items = list(objects)
    except TypeError:
        raise TypeError(sentence("objects", "isosurfaces and meshes", objects)) from None
    is_pair = [isinstance(item, (tuple, list)) and len(item) == 2 for item in items]
    pairs = [item if pair else (item, None) for item, pair in zip(items, is_pair)]
    return [(as_object(item, "objects"), place) for item, place in pairs]
