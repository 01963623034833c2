"""PyVista's ImageData and PolyData, which extend VTK's."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from . import vtk
from .checks import library_of


def volume_from_pyvista(cls, image_data, scalars=None, **options):
    """Model an array of PyVista's ImageData, at the positions ``points``, or ``cell_centers()`` for cell data.

    Parameters
    ----------
    image_data : pyvista.ImageData
        With any offset, spacing, origin and direction matrix.
    scalars : str, optional
        Name of the array; by default ``image_data.active_scalars_name``.
    **options
        Options of `Volume`, except the place: ``degree=3``.

    Returns
    -------
    Volume

    Raises
    ------
    TypeError, ValueError, ImportError
        As in `Volume.from_vtk`.

    Examples
    --------
    >>> import pyvista, isospline
    >>> image = pyvista.ImageData(dimensions=(5, 4, 3), spacing=(0.5, 0.5, 2))
    >>> image["density"] = range(60)
    >>> float(isospline.Volume.from_pyvista(image).sample([0.5, 0, 2]).round(3))
    21.0
    """
    if scalars is None:
        scalars = getattr(image_data, "active_scalars_name", None)
    return vtk.volume_from_vtk(cls, image_data, scalars, **options)


def volume_to_pyvista(self):
    """Convert to PyVista's ImageData: the values at the samples, as the point data "values".

    Of a `Volume`, these are the values of its model. They equal the samples if it interpolates them.

    Returns
    -------
    pyvista.ImageData

    Raises
    ------
    ImportError
        If PyVista is not installed: ``pip install isospline[interop]``.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.torus()
    >>> grid = field.volume(8).to_pyvista()
    >>> grid.dimensions, round(grid.spacing[0], 3)
    ((8, 8, 8), 0.25)
    """
    with library_of(f"{type(self).__name__}.to_pyvista"):
        import pyvista
    samples = _samples(self)
    grid = pyvista.ImageData(
        dimensions=samples.shape[::-1],
        spacing=tuple(map(float, self.spacing)),
        origin=tuple(map(float, self.origin)),
        direction_matrix=np.array(self.direction),
    )
    grid.point_data["values"] = samples.ravel()
    return grid


def _samples(volume):
    """The values of a volume at its samples, [z, y, x]."""
    if not isinstance(volume, _core.Volume):
        return np.asarray(volume)
    shape = volume.shape[::-1] if volume.axes == "zyx" else volume.shape
    values = np.empty(shape[::-1])
    x, y = np.meshgrid(np.arange(shape[0]), np.arange(shape[1]))
    for z, slice_ in enumerate(values):
        index = np.stack([x, y, np.full(x.shape, z)], axis=-1)
        slice_[...] = volume.sample(index @ volume.affine[:3, :3].T + volume.affine[:3, 3])
    return values


class _FromMesh:
    """The type that PyVista's `wrap` finds for a mesh or a surface of isospline."""

    def __new__(cls, mesh):
        return mesh.to_pyvista()


def class_name(self):
    """The name by which `pyvista.wrap` finds the conversion, so that ``plotter.add_mesh`` accepts the object."""
    import pyvista

    name = f"isospline.{type(self).__name__}"
    known: Any = pyvista._wrappers
    known.setdefault(name, _FromMesh)
    return name


def mesh_from_pyvista(cls, mesh, **options):
    """Convert a surface of PyVista.

    VTK cuts polygons and strips into triangles, in the order of the cells; triangles are not changed. Lines and single
    points are left out. Normals, colours and values of points are kept, as in `Mesh.from_vtk`.

    Parameters
    ----------
    mesh : pyvista.PolyData, UnstructuredGrid or StructuredGrid
        For grids, their faces are used or, if they have none, the surface of their solid cells.
    **options
        Options of `Mesh`.

    Returns
    -------
    Mesh

    Raises
    ------
    TypeError, ValueError, ImportError
        As in `Mesh.from_vtk`.

    Examples
    --------
    >>> import pyvista, isospline
    >>> isospline.Mesh.from_pyvista(pyvista.Cube()).faces.shape
    (12, 3)
    """
    return vtk.mesh_from_vtk(cls, mesh, **options)
