"""Meshes of meshio, whose surfaces VTK makes."""

from __future__ import annotations

import numpy as np

from ..base.parameters import check_type
from .checks import PLY_NAMES, errors_name, library_of
from .vtk import check_indices, mesh_from_vtk


def mesh_from_meshio(cls, mesh, **options):
    """See `Mesh.from_meshio`."""
    with library_of("Mesh.from_meshio"):
        import meshio
        import pyvista
    check_type(mesh, "mesh", meshio.Mesh, "a meshio.Mesh")
    with errors_name("mesh"):
        for block in mesh.cells:
            for indices in _index_arrays(block):
                check_indices(indices, len(mesh.points))
        # PyVista would also write cell sets into the original mesh.
        grid = pyvista.from_meshio(meshio.Mesh(mesh.points, [(block.type, block.data) for block in mesh.cells]))
        normals, colors = (_point_data(mesh, *names) for names in _ATTRIBUTES)
        if normals is not None:
            grid.point_data.active_normals = normals
        if colors is not None:
            grid.point_data["colors"] = colors
        others = [(name, data) for name, data in mesh.point_data.items() if name not in _NOT_VALUES]
        for name, data in [pair for pair in others if np.ndim(pair[1]) == 1][:1]:
            grid.point_data[name] = data
    return mesh_from_vtk(cls, grid, **options)


# Names of the arrays of normals and colours, and of their components in PLY.
_ATTRIBUTES = ("normals", "nx", "ny", "nz"), ("colors", "red", "green", "blue")


#: Names of arrays that are not values.
_NOT_VALUES = {*PLY_NAMES, *_ATTRIBUTES[0], *_ATTRIBUTES[1], "gmsh:dim_tags"}


def _point_data(mesh, name, *components):
    """An array (N, 3) of numbers at the points; None if there is none."""
    found = mesh.point_data.get(name)
    if found is None and all(component in mesh.point_data for component in components):
        found = np.stack([mesh.point_data[component] for component in components], axis=1)
    return found if found is not None and np.ndim(found) == 2 and np.shape(found)[1] in (3, 4) else None


def _index_arrays(block):
    """The vertex indices of a block of cells. Polyhedra have lists of faces."""
    if block.type.startswith("polyhedron"):
        return [np.asarray(face) for cell in block.data for face in cell]
    return [np.asarray(block.data)]
