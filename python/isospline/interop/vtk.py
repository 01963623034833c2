"""Image data and surfaces of VTK."""

from __future__ import annotations

import numpy as np

from ..base.parameters import check_type
from ..io import vtk
from ..io.vtk import numbers_of
from .checks import attributes, errors_name, library_of, to_mesh, to_volume
from .polygons import cut_polygons, cut_strips

# How the names of ids begin that filters of VTK and PyVista add.
_IDS = ("vtk", "pyvistaOriginal")


def volume_from_vtk(cls, image_data, scalars=None, **options):
    """See `Volume.from_vtk`."""
    return volume_of_array(cls, image_data, scalars, None, options)


def volume_of_array(cls, image_data, scalars, of_cells, options):
    """The same; `of_cells` is that of `io.vtk.to_volume_data`."""
    with library_of("Volume.from_vtk"):
        from vtkmodules.vtkCommonDataModel import vtkImageData
    check_type(image_data, "image_data", vtkImageData, "image data of VTK")
    with errors_name("image_data"):
        data = vtk.to_volume_data(image_data, scalars, of_cells)
    return to_volume(cls, data, "image_data", options)


def mesh_from_vtk(cls, mesh, **options):
    """See `Mesh.from_vtk`."""
    with library_of("Mesh.from_vtk"):
        from vtkmodules.vtkCommonDataModel import vtkPolyData, vtkStructuredGrid, vtkUnstructuredGrid
    kinds = (vtkPolyData, vtkUnstructuredGrid, vtkStructuredGrid)
    check_type(mesh, "mesh", kinds, "a surface or a grid of VTK or PyVista")
    with errors_name("mesh"):
        check_connectivity(mesh)
        arrays = triangles(mesh if isinstance(mesh, vtkPolyData) else surface(mesh))
    return to_mesh(cls, arrays, "mesh", options)


def check_connectivity(mesh):
    """Check the vertex indices of all cells: VTK's filters would read memory out of bounds."""
    from vtkmodules.vtkCommonDataModel import vtkPolyData, vtkUnstructuredGrid

    count = mesh.GetPoints().GetNumberOfPoints() if mesh.GetPoints() is not None else 0
    if isinstance(mesh, vtkPolyData):
        for cells in (mesh.GetVerts(), mesh.GetLines(), mesh.GetPolys(), mesh.GetStrips()):
            _check_cells(cells, count)
    elif isinstance(mesh, vtkUnstructuredGrid):
        _check_cell_types(mesh, _check_cells(mesh.GetCells(), count))
        faces = mesh.GetPolyhedronFaces() if hasattr(mesh, "GetPolyhedronFaces") else None  # since VTK 9.4
        locations = mesh.GetPolyhedronFaceLocations() if faces is not None else None
        if faces is not None and locations is not None:
            _check_cells(faces, count)
            _check_cells(locations, faces.GetNumberOfCells())
    else:
        expected = np.prod(np.diff(np.reshape(mesh.GetExtent(), (3, 2))) + 1)
        if expected != count:
            raise ValueError(f"expected {expected} points, got {count}")


def _check_cells(cells, count):
    """Check the offsets and indices of an array of cells; returns the number of indices of each cell."""
    if cells is None or cells.GetNumberOfCells() == 0:
        return np.zeros(0, int)
    indices, offsets = numbers_of(cells.GetConnectivityArray()), numbers_of(cells.GetOffsetsArray())
    # Compare, because differences of arbitrary numbers can overflow.
    if offsets[0] != 0 or offsets[-1] != len(indices) or (offsets[1:] < offsets[:-1]).any():
        raise ValueError("expected offsets of cells that ascend from 0 to the number of indices, got others")
    check_indices(indices, count)
    return np.diff(offsets)


def check_indices(indices, count):
    """Check that indices are below the number of vertices."""
    if indices.size and not (indices.min() >= 0 and indices.max() < count):
        wrong = indices[(indices < 0) | (indices >= count)].flat[0]
        raise ValueError(f"expected vertex indices from 0 to {count} - 1, got {wrong}")


def _check_cell_types(grid, sizes):
    """Check that cells have the number of indices that their type needs."""
    from vtkmodules.vtkCommonDataModel import vtkGenericCell

    if len(sizes) == 0:
        return
    try:
        types = numbers_of(grid.GetCellTypes())
    except TypeError:  # before VTK 9.6
        types = numbers_of(grid.GetCellTypesArray())
    for cell_type in np.unique(types):
        cell = vtkGenericCell.InstantiateCell(int(cell_type))
        if cell is None:
            raise ValueError(f"expected a type of cell, got {cell_type}")
        least = sizes[types == cell_type].min()
        if least < cell.GetNumberOfPoints():
            raise ValueError(f"expected {cell.GetNumberOfPoints()} indices of a {cell.GetClassName()}, got {least}")


def surface(grid):
    """The faces of a grid or, if it has none, the surface of its solid cells."""
    from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid
    from vtkmodules.vtkFiltersExtraction import vtkExtractCellsByType
    from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter

    # Meshers write solids together with their boundary; every face would then occur twice.
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
    """The arrays of a surface: vertices, faces, normals, colours and values."""
    if poly_data.GetNumberOfPoints() == 0:
        return {"vertices": np.empty((0, 3)), "faces": np.empty((0, 3), int)}
    vertices = numbers_of(poly_data.GetPoints().GetData()).astype(float)
    visible = _visible_cells(poly_data)
    polygons = cut_polygons(vertices, *_sizes_and_indices(poly_data.GetPolys(), visible))
    strips = cut_strips(*_sizes_and_indices(poly_data.GetStrips(), visible[poly_data.GetNumberOfPolys() :]))
    faces = np.concatenate([polygons, strips])
    data = poly_data.GetPointData()
    normals = data.GetNormals()
    normals = None if normals is None or normals.GetNumberOfComponents() != 3 else numbers_of(normals)
    return {"vertices": vertices, "faces": faces, **attributes(normals, _colors(data), _named(data))}


def _visible_cells(poly_data):
    """Whether polygons, and then strips, are neither hidden nor copies of cells in another part."""
    from vtkmodules.vtkCommonDataModel import vtkDataSetAttributes

    count = poly_data.GetNumberOfPolys() + poly_data.GetNumberOfStrips()
    ghosts = poly_data.GetCellData().GetArray(vtkDataSetAttributes.GhostArrayName())
    if ghosts is None or count == 0:
        return np.ones(count, bool)
    if ghosts.GetNumberOfTuples() != poly_data.GetNumberOfCells():
        expected = f"{poly_data.GetNumberOfCells()} values of {ghosts.GetName()}, one for each cell"
        raise ValueError(f"expected {expected}, got {ghosts.GetNumberOfTuples()}")
    left_out = vtkDataSetAttributes.HIDDENCELL | vtkDataSetAttributes.DUPLICATECELL
    return numbers_of(ghosts)[-count:] & left_out == 0  # behind those of points and lines


def _sizes_and_indices(cells, visible):
    """How many points each visible cell has, and their indices."""
    count = cells.GetNumberOfCells()
    if count == 0:
        return np.zeros(0, int), np.zeros(0, int)
    sizes, visible = np.diff(numbers_of(cells.GetOffsetsArray())), visible[:count]
    return sizes[visible], numbers_of(cells.GetConnectivityArray())[np.repeat(visible, sizes)]


def _colors(data):
    """The colours among the data of points, or None. Active scalars are colours if they are bytes, as in VTK."""
    from vtkmodules.vtkCommonCore import VTK_UNSIGNED_CHAR

    active, named = data.GetScalars(), [data.GetArray(name) for name in ("colors", "Colors", "RGB", "RGBA")]
    is_of_bytes = active is not None and active.GetDataType() == VTK_UNSIGNED_CHAR
    arrays = [active, *named] if is_of_bytes else named
    colors = (numbers_of(array) for array in arrays if array is not None and array.GetNumberOfComponents() in (3, 4))
    return next(colors, None)


def _named(data):
    """The arrays of the data of points, with their names; the active scalars are the first."""
    arrays = [data.GetScalars(), *(data.GetArray(index) for index in range(data.GetNumberOfArrays()))]
    return [
        (array.GetName() or "values", numbers_of(array))
        for array in arrays
        if array is not None and not (array.GetName() or "").startswith(_IDS)
    ]


def flat_cell_types():
    """VTK's cell types that are faces: triangles, polygons and curved faces."""
    from vtkmodules.vtkCommonDataModel import VTK_NUMBER_OF_CELL_TYPES, vtkGenericCell

    cells = ((cell_type, vtkGenericCell.InstantiateCell(cell_type)) for cell_type in range(VTK_NUMBER_OF_CELL_TYPES))
    return [cell_type for cell_type, cell in cells if cell is not None and cell.GetCellDimension() == 2]
