"""Image data and surfaces of VTK."""

from __future__ import annotations

import numpy as np

from ..io import vtk
from .checks import check_type, errors_name, library_of, to_mesh, to_volume


def volume_from_vtk(cls, image_data, scalars=None, **options):
    """Model an array of VTK's image data, where ``GetPoint`` puts its samples.

    Parameters
    ----------
    image_data : vtkImageData
        With any extent, spacing, origin and direction matrix.
    scalars : str, optional
        Name of the array, of points or else of cells, whose samples lie in the middle; by default the active scalars,
        else the only array.
    **options
        Of `Volume`, but for the place: ``degree=3``.

    Returns
    -------
    Volume

    Raises
    ------
    TypeError
        Where `image_data` is something else.
    ValueError
        Where it has no such array, or one of vectors or of numbers that are not finite.
    ImportError
        Where VTK is not installed: ``pip install isospline[io]``.

    Examples
    --------
    >>> import isospline
    >>> from vtkmodules.vtkCommonDataModel import vtkImageData
    >>> image = vtkImageData()
    >>> image.SetDimensions(5, 4, 3)
    >>> image.AllocateScalars(10, 1)
    >>> image.GetPointData().GetScalars().Fill(0)
    >>> isospline.Volume.from_vtk(image).shape
    (3, 4, 5)
    """
    with library_of("Volume.from_vtk"):
        from vtkmodules.vtkCommonDataModel import vtkImageData
    check_type(image_data, "image_data", vtkImageData, "image data of VTK")
    with errors_name("image_data"):
        data = vtk.to_volume_data(image_data, scalars)
    return to_volume(cls, data, "image_data", options)


def mesh_from_vtk(cls, mesh, **options):
    """Take over a surface of VTK.

    VTK cuts polygons and strips into triangles, in the order of the cells; triangles are taken over as they are. Lines
    and single points are left out.

    Parameters
    ----------
    mesh : vtkPolyData, vtkUnstructuredGrid or vtkStructuredGrid
        Of grids, their faces are taken, or where they have none, the surface of their solid cells.
    **options
        Of `Mesh`.

    Returns
    -------
    Mesh

    Raises
    ------
    TypeError
        Where `mesh` is something else.
    ValueError
        Where it has no faces, or a vertex that is not finite.
    ImportError
        Where VTK is not installed: ``pip install isospline[io]``.

    Examples
    --------
    >>> import isospline
    >>> from vtkmodules.vtkFiltersSources import vtkCubeSource
    >>> cube = vtkCubeSource()
    >>> _ = cube.Update()
    >>> isospline.Mesh.from_vtk(cube.GetOutput()).faces.shape
    (12, 3)
    """
    with library_of("Mesh.from_vtk"):
        from vtkmodules.vtkCommonDataModel import vtkPolyData, vtkStructuredGrid, vtkUnstructuredGrid
    kinds = (vtkPolyData, vtkUnstructuredGrid, vtkStructuredGrid)
    check_type(mesh, "mesh", kinds, "a surface or a grid of VTK or PyVista")
    with errors_name("mesh"):
        vertices, faces = triangles(mesh if isinstance(mesh, vtkPolyData) else surface(mesh))
    return to_mesh(cls, vertices, faces, "mesh", options)


def surface(grid):
    """The faces of a grid, or where it has none, the surface of its solid cells."""
    from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid
    from vtkmodules.vtkFiltersExtraction import vtkExtractCellsByType
    from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter

    # A solid that comes with its boundary, as meshers write it, would have every face twice.
    if isinstance(grid, vtkUnstructuredGrid):
        faces = vtkExtractCellsByType()
        for cell_type in flat_cell_types():
            faces.AddCellType(cell_type)
        faces.SetInputData(grid)
        faces.Update()
        grid = faces.GetOutput() if faces.GetOutput().GetNumberOfCells() else grid
    surface = vtkDataSetSurfaceFilter()
    surface.SetInputData(grid)
    surface.Update()
    return surface.GetOutput()


def triangles(poly_data):
    """(V, 3) vertices and (F, 3) faces of a surface."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter

    if poly_data.GetNumberOfPoints() == 0:
        return np.empty((0, 3)), np.empty((0, 3), int)
    cut = vtkTriangleFilter()
    cut.PassVertsOff()
    cut.PassLinesOff()
    cut.SetInputData(poly_data)
    cut.Update()
    faces = vtk_to_numpy(cut.GetOutput().GetPolys().GetConnectivityArray())
    return vtk_to_numpy(cut.GetOutput().GetPoints().GetData()), faces.reshape(-1, 3)


def flat_cell_types():
    """VTK's types of cells that are faces: triangles, polygons, curved ones."""
    from vtkmodules.vtkCommonDataModel import VTK_NUMBER_OF_CELL_TYPES, vtkGenericCell

    cells = ((cell_type, vtkGenericCell.InstantiateCell(cell_type)) for cell_type in range(VTK_NUMBER_OF_CELL_TYPES))
    return [cell_type for cell_type, cell in cells if cell is not None and cell.GetCellDimension() == 2]
