"""Meshes from files."""

from __future__ import annotations

import contextlib
import io
import os
import re
from pathlib import Path
from typing import Any

from ..base.parameters import check_path, printable
from ..base.signatures import explained
from ..colors import linear_to_srgb
from ..interop import three_mf
from ..interop.checks import library_of
from ..interop.mesh_topology import equal_rows
from ..interop.meshio import mesh_from_meshio
from ..interop.single_precision import offset_in_header
from ..interop.trimesh import mesh_of_file
from ..interop.vtk import mesh_from_vtk
from ..io import isolated
from ..io.checks import check_file, utf8
from ..io.confinement import check_within
from ..io.vtk import LIBRARIES, check_end, check_messages, messages
from .gltf_parts import take_marked_parts, with_marked_parts
from .mesh import Mesh
from .mesh_references import check_entities, check_references, resolver_within
from .obj_files import read_obj
from .off_files import read_off
from .ply_files import read_ply
from .three_mf_files import read_3mf

# Bytes of a header or trailer that are checked before a library reads a file.
_GUARDED = 1 << 16


@explained
def read_mesh(path: str | os.PathLike[str], *, within: str | os.PathLike[str] | None = None, **options: Any) -> Mesh:
    """Read a triangle mesh from a file.

    ==========================================================  =======================================  =========
    suffix                                                      format                                   read by
    ==========================================================  =======================================  =========
    ``.ply``, ``.obj``, ``.off``, ``.3mf``                      PLY, Wavefront, OFF, 3MF                 isospline
    ``.stl``, ``.glb``, ``.gltf``, ``.dae``                     STL, glTF, COLLADA                       trimesh
    ``.vtk``, ``.vtp``, ``.vtu``                                VTK surfaces and grids                   VTK
    ``.msh``, ``.inp``, ``.med``, ``.xdmf``, ``.mesh`` ...      formats of meshers and finite elements   meshio
    ==========================================================  =======================================  =========

    Normals and colours of vertices are kept. One array with one number a vertex is kept as `Mesh.values`, with its
    name: the active scalars of VTK's formats, or the first such array of others. Faces keep the order of the file.
    Faces of more than three corners are cut into triangles; they need not be convex. In STL, corners with equal
    positions become one vertex; in other formats, vertices are not merged. If a file has solid cells and no faces,
    their surface is used. Coordinates are those of the file, plus the offset that `Mesh.write` notes in the header of
    an STL file far from the origin. Materials and textures of OBJ, PLY and 3MF are not read. A process of its own reads
    the file, with limits on memory and time.

    Parameters
    ----------
    path : str or path-like
        A file; its suffix determines the format.
    within : str or path-like, optional
        A folder. The path, and every file that is read with it, such as buffers of glTF, must be in this folder after
        symbolic links are resolved. Set it for files from others, which may name any file of yours. Formats based on
        HDF5 and formats of several files are then refused. By default, a file may refer to any file.
    **options
        Options of `Mesh`.

    Returns
    -------
    Mesh

    Raises
    ------
    OSError
        If the file is missing or cannot be read.
    ValueError
        If the file has none of these formats, is broken, or has no faces. Also if a file is not `within` the folder.
        The message names the path.
    MemoryError
        If the process that reads the file would need too much memory.
    ImportError
        If the library for the format is not installed. ``pip install isospline[interop]`` installs all except the one
        for COLLADA, which trimesh names.

    Examples
    --------
    >>> import tempfile, isospline
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with open(f"{folder}/triangle.off", "w") as file:
    ...         _ = file.write("OFF 3 1 0  0 0 0  1 0 0  0 1 0  3 0 1 2".replace("  ", chr(10)))
    ...     isospline.read_mesh(f"{folder}/triangle.off").bounds
    array([[0., 0., 0.],
           [1., 1., 0.]])
    """
    check_path(path)
    path = Path(path)
    check_within(path, within, "a path")
    check_file(path)
    name = path.name.lower()
    reader, libraries = next((found for suffix, found in _READERS.items() if name.endswith(suffix)), _MESHIO)
    folder = None if within is None else os.path.abspath(within)
    try:
        with library_of(f"{printable(path)}: read_mesh"):
            function = f"isospline.scene.mesh_files:{reader}"
            arrays = isolated.call(function, path, libraries, readable=isolated.referenced(within), within=folder)
        return Mesh(**{**arrays, **options})
    except ImportError:
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.filename is not None:
            raise
        if isinstance(error, MemoryError):
            raise MemoryError(f"{printable(path)}: {error}") from error
        # Libraries raise many kinds of exceptions for a broken file.
        reason = str(error).strip().removeprefix("mesh: ") or type(error).__name__
        raise ValueError(f"{printable(path)}: cannot be read as a mesh: {reason}") from error


def unit_of_mesh(path):
    """The unit of length of a file of a mesh; empty if its format has none."""
    path = Path(path)
    return isolated.call(f"{three_mf.__name__}:unit_in_file", path) if path.suffix.lower() == ".3mf" else ""


# What follows runs in a process of its own.


def load_trimesh(path, within):
    """Read a file by trimesh."""
    import trimesh
    from trimesh.resolvers import FilePathResolver

    path = Path(path)
    file_type = path.suffix[1:].lower()
    is_gltf = file_type in ("glb", "gltf")
    if file_type == "stl":
        _check_stl(path)
    check_entities(path, within)
    resolver: Any = FilePathResolver(str(path)) if within is None else resolver_within(path, within)
    with open(path, "rb") as file:
        source = io.BytesIO(with_marked_parts(file.read())) if is_gltf else file
        try:
            # Without processing, in which trimesh drops vertices that are not finite and merges close ones.
            scene = trimesh.load_scene(source, file_type=file_type, resolver=resolver, process=False)
        finally:
            if within is not None and resolver.refused is not None:
                raise resolver.refused
    if is_gltf:
        take_marked_parts(scene)
    return _arrays_of_trimesh(path, scene)


def _arrays_of_trimesh(path, scene):
    mesh = mesh_of_file(Mesh, scene)
    arrays, suffix = _arrays(mesh), path.suffix.lower()
    if suffix == ".stl":
        first, places = equal_rows(mesh.vertices)
        with open(path, "rb") as file:
            offset = offset_in_header(file.read(80))
        arrays["vertices"], arrays["faces"] = mesh.vertices[first] + offset, places[mesh.faces]
        arrays = {name: arrays[name] for name in ("vertices", "faces")}  # STL has nothing else
    if suffix in (".glb", ".gltf") and mesh.colors is not None:
        arrays["colors"] = linear_to_srgb(mesh.colors)  # those of glTF are linear
    return arrays


def load_polygons(path, within):
    """Read a file of polygons; what it refers to, such as materials, is not read."""
    path = Path(path)
    check_entities(path, within)
    readers = {".3mf": read_3mf, ".obj": read_obj, ".off": read_off, ".ply": read_ply}
    return _arrays(readers[path.suffix.lower()](path))


def load_vtk(path, within):
    """Read a file by VTK. Its formats refer to no other files."""
    from vtkmodules.vtkIOLegacy import vtkDataSetReader
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLUnstructuredGridReader

    del within
    path = Path(path)
    readers: dict[str, Any] = {
        ".vtk": vtkDataSetReader,
        ".vtp": vtkXMLPolyDataReader,
        ".vtu": vtkXMLUnstructuredGridReader,
    }
    reader = readers[path.suffix.lower()]()
    if path.suffix.lower() != ".vtk":
        check_end(path)
    with messages() as text:
        reader.SetFileName(utf8(path))
        reader.Update()
        check_messages(text())
    return _arrays(mesh_from_vtk(Mesh, reader.GetOutput()))


def load_meshio(path, within):
    """Read a file by meshio."""
    import meshio

    path = Path(path)
    suffixes = sorted({*_READERS, *meshio.extension_to_filetypes})
    if not path.name.lower().endswith(tuple(suffixes)):
        raise ValueError(f"expected a name that ends in {', '.join(suffixes)}")
    check_references(path, within)
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            mesh = _read_msh(path) if path.suffix.lower() == ".msh" else meshio.read(utf8(path))
    except SystemExit:
        # If no reader succeeds, meshio prints the reasons and exits.
        raise ValueError(" ".join(said.getvalue().split()) or f"meshio has no reader for {os.fspath(path)}") from None
    return _arrays(mesh_from_meshio(Mesh, mesh))


def _read_msh(path):
    """Read a file of Gmsh or Ansys; both have the same suffix."""
    import meshio

    with open(path, "rb") as file:
        if file.read(1) == b"$":
            _check_gmsh(path)
            return meshio.gmsh.read(utf8(path))
    return meshio.ansys.read(utf8(path))


def _arrays(mesh):
    """The arrays of a mesh, by the names of its parameters."""
    names = ("vertices", "faces", "normals", "colors", "values", "values_name")
    arrays = {name: getattr(mesh, name) for name in names}
    return {name: array for name, array in arrays.items() if array is not None}


#: Suffixes of files that hold meshes where others hold volumes.
MESH_SUFFIXES = (".stl", ".ply", ".obj", ".off", ".glb", ".gltf", ".vtp", ".vtu", ".msh", ".inp", ".3mf")
#: The functions of formats by their suffix, and the packages that they need.
_READERS = {
    **dict.fromkeys((".3mf", ".obj", ".off", ".ply"), ("load_polygons", "")),
    **dict.fromkeys((".dae", ".glb", ".gltf", ".stl"), ("load_trimesh", "trimesh")),
    **dict.fromkeys((".vtk", ".vtp", ".vtu"), ("load_vtk", f"{LIBRARIES} vtkmodules.vtkFiltersGeometry")),
}
_MESHIO = ("load_meshio", "meshio pyvista")


# Libraries would accept truncated files of these formats.


def _check_stl(path):
    """Check that a file is complete."""
    size = os.path.getsize(path)
    with open(path, "rb") as file:
        beginning = file.read(84)
        count = int.from_bytes(beginning[80:], "little")
        if size >= 84 and size == 84 + 50 * count:
            return
        if b"solid" not in beginning.lower():
            expected = f"{84 + 50 * count} bytes of {count} triangles" if size >= 84 else "at least 84 bytes"
            raise ValueError(f"expected {expected}, got {size}: the file is truncated or damaged")
        file.seek(-min(size, _GUARDED), os.SEEK_END)
        last = file.read().strip().rpartition(b"\n")[2].strip().lower()
    if not last.startswith(b"endsolid"):
        raise ValueError("expected endsolid in the last line: the file is truncated")


def _check_gmsh(path):
    """Check that each section of a file has its end."""
    with open(path, "rb") as file:
        begun = None
        for line in iter(lambda: file.readline(_GUARDED), b""):
            match = re.fullmatch(rb"\$([A-Za-z]+)\s*", line)
            if match and match[1].startswith(b"End"):
                begun = None
            elif match and begun is None:
                begun = match[1]
    if begun is not None:
        raise ValueError(f"expected $End{begun.decode()}: the file is truncated")
