"""PyVista's ImageData and PolyData, which are VTK's with more to say."""

from __future__ import annotations

from . import vtk


def volume_from_pyvista(cls, image_data, scalars=None, **options):
    """Model an array of PyVista's ImageData, where its ``points``, or for cells ``cell_centers()``, put the samples.

    Parameters
    ----------
    image_data : pyvista.ImageData
        With any offset, spacing, origin and direction matrix.
    scalars : str, optional
        Name of the array; by default ``image_data.active_scalars_name``.
    **options
        Of `Volume`, but for the place: ``degree=3``.

    Returns
    -------
    Volume

    Raises
    ------
    TypeError, ValueError, ImportError
        As `Volume.from_vtk`.

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


def mesh_from_pyvista(cls, mesh, **options):
    """Take over a surface of PyVista.

    VTK cuts polygons and strips into triangles, in the order of the cells; triangles are taken over as they are. Lines
    and single points are left out.

    Parameters
    ----------
    mesh : pyvista.PolyData, UnstructuredGrid or StructuredGrid
        Of grids, their faces are taken, or where they have none, the surface of their solid cells.
    **options
        Of `Mesh`.

    Returns
    -------
    Mesh

    Raises
    ------
    TypeError, ValueError, ImportError
        As `Mesh.from_vtk`.

    Examples
    --------
    >>> import pyvista, isospline
    >>> isospline.Mesh.from_pyvista(pyvista.Cube()).faces.shape
    (12, 3)
    """
    return vtk.mesh_from_vtk(cls, mesh, **options)
