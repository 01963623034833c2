"""Meshes of meshio, whose surfaces VTK makes."""

from __future__ import annotations

import numpy as np

from ..base.parameters import check_type
from .checks import errors_name, is_one_number_each, library_of, names_of_values
from .vtk import check_indices, mesh_from_vtk


def mesh_from_meshio(cls, mesh, **options):
    """See `Mesh.from_meshio`."""
    with library_of("Mesh.from_meshio"):
        import meshio
        import pyvista
    check_type(mesh, "mesh", meshio.Mesh, "a meshio.Mesh")
    with errors_name("mesh"):
        blocks = [block for block in mesh.cells if block.dim >= 2]
        for block in blocks:
            for indices in _index_arrays(block):
                check_indices(indices, len(mesh.points))
        # PyVista would also write cell sets into the original mesh.
        given = meshio.Mesh(mesh.points, [(block.type, _in_order(block)) for block in blocks])
        try:
            grid = pyvista.from_meshio(given)
        except KeyError as error:
            raise ValueError(f"expected cells of a type that VTK has, got {error.args[0]}") from None
        normals, colors = (_point_data(mesh, *names) for names in _ATTRIBUTES)
        if normals is not None:
            grid.point_data.active_normals = normals
        if colors is not None:
            grid.point_data["colors"] = colors
        name = _name_of_values(mesh.point_data)
        if name is not None:
            grid.point_data["values"] = np.ravel(mesh.point_data[name])  # its own name may be that of the colours
            options = {"values_name": name, **options}
    return mesh_from_vtk(cls, grid, **options)


def _in_order(block):
    """The cells of a block in VTK's order. PyVista leaves wedges in that of meshio and Gmsh, which is mirrored."""
    return np.asarray(block.data)[:, [0, 2, 1, 3, 5, 4]] if block.type == "wedge" else block.data


# Names of the arrays of normals and colours, and of their components in PLY.
_ATTRIBUTES = ("normals", "nx", "ny", "nz"), ("colors", "red", "green", "blue")


def _point_data(mesh, name, *components):
    """An array (N, 3) of numbers at the points, in the machine's byte order; None if there is none."""
    found = mesh.point_data.get(name)
    if np.ndim(found) != 2 or np.shape(found)[1] not in (3, 4):
        if not all(np.ndim(mesh.point_data.get(component)) == 1 for component in components):
            return None
        found = np.stack([mesh.point_data[component] for component in components], axis=1)
    found = np.asarray(found)
    return found.astype(found.dtype.newbyteorder("="), copy=False)


def _name_of_values(point_data):
    """The name of the first array with one number a point that is no part of a normal, colour or the like, or None."""
    arrays = {name: np.asarray(point_data[name]) for name in names_of_values(list(point_data))}
    return next((name for name, data in arrays.items() if is_one_number_each(data)), None)


def _index_arrays(block):
    """The vertex indices of a block of cells. Polyhedra have lists of faces."""
    if block.type.startswith("polyhedron"):
        return [np.asarray(face) for cell in block.data for face in cell]
    return [np.asarray(block.data)]
