"""Meshes for other libraries, and to files."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from ..base.parameters import check_path, printable
from ..base.system import whole_file
from .checks import PLY_NAMES, library_of


def to_trimesh(self):
    """Convert to a mesh of trimesh, with the same vertices and faces.

    Returns
    -------
    trimesh.Trimesh
        With vertex normals and colours if the mesh has them, and its values among the ``vertex_attributes``. It is not
        processed: no vertices are merged.

    Raises
    ------
    ImportError
        If trimesh is not installed: ``pip install isospline[interop]``.

    Examples
    --------
    >>> import isospline
    >>> mesh = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]).to_trimesh()
    >>> print(mesh.area)
    0.5
    """
    with library_of("Mesh.to_trimesh"):
        import trimesh
    return trimesh.Trimesh(
        np.array(self.vertices),  # copies, which can be written to: Open3D and others refuse arrays that cannot
        self.faces.astype(np.int64),
        vertex_normals=self.normals,
        vertex_colors=_srgb_colors(self),
        vertex_attributes=_named_values(self),
        process=False,
    )


def to_pyvista(self):
    """Convert to a surface of PyVista, and so of VTK.

    Returns
    -------
    pyvista.PolyData
        With the point data "Normals", active, and "colors", sRGB from 0 to 255, if the mesh has them. Its values, by
        their name, are the active scalars.

    Raises
    ------
    ImportError
        If PyVista is not installed: ``pip install isospline[interop]``.

    Examples
    --------
    >>> import isospline
    >>> isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]).to_pyvista().n_cells
    1
    """
    with library_of("Mesh.to_pyvista"):
        import pyvista
    surface = pyvista.PolyData()
    if len(self.vertices):
        surface = pyvista.PolyData.from_regular_faces(np.array(self.vertices), self.faces.astype(np.int64))
    if self.normals is not None:
        surface.point_data.active_normals = np.array(self.normals)
    if self.colors is not None:
        surface.point_data["colors"] = _srgb_colors(self)
    for name, values in _named_values(self).items():
        surface.point_data.set_array(values, name)
        surface.point_data.active_scalars_name = name
    return surface


def to_meshio(self):
    """Convert to a mesh of meshio.

    Returns
    -------
    meshio.Mesh
        One block of triangles, with the point data "normals" and "colors", sRGB from 0 to 1, and the values, by their
        name, if the mesh has them.

    Raises
    ------
    ImportError
        If meshio is not installed: ``pip install isospline[interop]``.

    Examples
    --------
    >>> import isospline
    >>> isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]).to_meshio().cells_dict["triangle"].tolist()
    [[0, 1, 2]]
    """
    with library_of("Mesh.to_meshio"):
        import meshio
    data = {"normals": self.normals, "colors": self.colors, **_named_values(self)}
    return meshio.Mesh(
        np.array(self.vertices),
        [("triangle", self.faces.astype(np.int64))],
        point_data={name: np.array(values) for name, values in data.items() if values is not None},
    )


def surface_to_trimesh(self, tolerance=None):
    """Convert its mesh to trimesh: ``surface.to_mesh(tolerance).to_trimesh()``.

    Parameters
    ----------
    tolerance : float, optional
        As in `to_mesh`.

    Returns
    -------
    trimesh.Trimesh
    """
    return self.to_mesh(tolerance).to_trimesh()


def surface_to_pyvista(self, tolerance=None):
    """Convert its mesh to PyVista: ``surface.to_mesh(tolerance).to_pyvista()``.

    Parameters
    ----------
    tolerance : float, optional
        As in `to_mesh`.

    Returns
    -------
    pyvista.PolyData
    """
    return self.to_mesh(tolerance).to_pyvista()


def write_mesh(self, path):
    """Write the mesh to a file, completely or not at all.

    ========  ====================================================================  =========
    suffix    contents                                                              by
    ========  ====================================================================  =========
    ``.stl``  binary; the corners of each face in float32, nothing else             trimesh
    ``.ply``  binary; vertices, faces, normals, colours and values, in float64      meshio
    ``.obj``  text; vertices, faces, normals and colours, 15 decimal places         trimesh
    ``.glb``  binary glTF; vertices, faces, normals and linear colours of 8 bits    trimesh
    ========  ====================================================================  =========

    Parameters
    ----------
    path : str or path-like

    Raises
    ------
    ValueError
        For another suffix, and if the mesh has no faces.
    OSError
        If the file cannot be written.
    ImportError
        If the library is not installed: ``pip install isospline[interop]``.

    Examples
    --------
    >>> import tempfile, isospline
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]).write(f"{folder}/triangle.stl")
    ...     isospline.read_mesh(f"{folder}/triangle.stl")
    Mesh(3 vertices, 1 faces)
    """
    write = writer_of(path)
    if len(self.faces) == 0:
        raise ValueError(f"{printable(path)}: expected a mesh with faces, got none")
    with library_of(f"{printable(path)}: Mesh.write"), whole_file(path) as temporary:
        write(self, temporary)


def write_surface(self, path, tolerance=None, *, progress=None):
    """Write the mesh of the surface to a file: ``surface.to_mesh(tolerance).write(path)``.

    Parameters
    ----------
    path : str or path-like
        Ends in ``.stl``, ``.ply``, ``.obj`` or ``.glb``; see `Mesh.write`.
    tolerance : float, optional
        The largest distance between surface and mesh, world units; see `to_mesh`.
    progress : callable, optional
        Called with the finished fraction; cancels if it returns a false value other than None.

    Raises
    ------
    ValueError, OSError, ImportError
        As in `to_mesh` and `Mesh.write`.

    Examples
    --------
    >>> import tempfile, isospline
    >>> field = isospline.volumes.sphere(0.7)
    >>> ball = isospline.Isosurface(field.volume(32), field.level)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ball.write(f"{folder}/ball.ply", tolerance=0.05)
    """
    writer_of(path)
    self.to_mesh(tolerance, progress=progress).write(path)


def writer_of(path):
    """The function that writes the format of a path."""
    check_path(path)
    writer = _WRITERS.get(os.path.splitext(os.fspath(path))[1].lower())
    if writer is None:
        raise ValueError(f"path: expected a name that ends in {', '.join(_WRITERS)}, got {printable(path)!r}")
    return writer


def _write_trimesh(file_type, **options):
    def write(mesh, path):
        converted = mesh.to_trimesh()
        converted.vertex_attributes.clear()  # glTF has no NaN, and its names begin with an underscore
        if file_type == "glb" and mesh.colors is not None:
            converted.visual.vertex_colors = _bytes_of(mesh._colors())  # the standard's COLOR_0 is linear
        content = converted.export(file_type=file_type, **options)
        with open(path, "wb") as file:
            file.write(content.encode() if isinstance(content, str) else content)

    return write


def _write_ply(mesh, path):
    import meshio

    output = mesh.to_meshio()
    output.cells[0].data = output.cells[0].data.astype(
        np.int32
    )  # PLY has no 64-bit integers, and meshio warns about them
    data: dict[str, Any] = {}
    if mesh.normals is not None:
        data |= dict(zip(("nx", "ny", "nz"), np.ascontiguousarray(mesh.normals.T)))
    if mesh.colors is not None:
        data |= dict(zip(("red", "green", "blue"), np.ascontiguousarray(_srgb_colors(mesh).T)))
    for name, values in _named_values(mesh).items():
        name = "_".join(name.split())  # names in PLY have no spaces
        data[f"{name}_values" if name in PLY_NAMES else name] = values
    output.point_data = data
    meshio.write(path, output, file_format="ply")


def _named_values(mesh):
    """The values of a mesh by their name, if it has any."""
    return {} if mesh.values is None else {mesh.values_name: np.array(mesh.values)}


def _srgb_colors(mesh):
    """(V, 3) uint8 colours for files, or None."""
    if mesh.colors is None:
        return None
    return _bytes_of(mesh.colors)


def _bytes_of(colors):
    return np.rint(255 * np.clip(np.asarray(colors), 0, 1)).astype(np.uint8)


_WRITERS = {
    ".stl": _write_trimesh("stl"),
    ".ply": _write_ply,
    ".obj": _write_trimesh("obj", include_normals=True, digits=15),
    ".glb": _write_trimesh("glb", include_normals=True),
}

#: Suffixes of mesh files that can be written.
MESHES = tuple(_WRITERS)
