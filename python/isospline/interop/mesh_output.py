"""Meshes for other libraries, and to files."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from ..base.parameters import check_path, printable
from ..base.system import warn, whole_file
from . import three_mf
from .checks import PLY_NAMES, library_of
from .mesh_parts import is_written_in_parts, stl_triangles, write_stl_in_parts
from .single_precision import blurred_faces, offset_for, stl_header, warn_of_stl_offset


def to_trimesh(self):
    """See `Mesh.to_trimesh`."""
    with library_of("Mesh.to_trimesh"):
        return _trimesh_from(self, 0.0)


def _trimesh_from(mesh, offset):
    """A mesh of trimesh, with vertices relative to an offset."""
    import trimesh

    return trimesh.Trimesh(
        mesh.vertices - offset,  # a copy, which can be written to: Open3D and others refuse arrays that cannot
        mesh.faces.astype(np.int64),
        vertex_normals=mesh.normals,
        vertex_colors=_srgb_colors(mesh),
        vertex_attributes=_named_values(mesh),
        process=False,
    )


def to_pyvista(self):
    """See `Mesh.to_pyvista`."""
    with library_of("Mesh.to_pyvista"):
        import pyvista
    surface = pyvista.PolyData()
    if len(self.vertices):
        surface = pyvista.PolyData.from_regular_faces(np.array(self.vertices), self.faces.astype(np.int64))
    if self.normals is not None:
        surface.point_data.active_normals = np.array(self.normals)
    if self.colors is not None:
        surface.point_data["colors"] = _srgb_colors(self)
    for name, values in _named_values(self, surface.point_data).items():
        surface.point_data.set_array(values, name)
        surface.point_data.active_scalars_name = name
    return surface


def to_meshio(self):
    """See `Mesh.to_meshio`."""
    with library_of("Mesh.to_meshio"):
        import meshio
    data = {"normals": self.normals, "colors": self.colors}
    data = {name: np.array(part) for name, part in data.items() if part is not None}
    return meshio.Mesh(
        np.array(self.vertices),
        [("triangle", self.faces.astype(np.int64))],
        point_data={**data, **_named_values(self, data)},
    )


def mesh_of(surface, tolerance, faces, for_print, progress=None):
    """The mesh, and what was done if it is for a printer."""
    if for_print:
        return surface.to_print_mesh(tolerance, faces=faces, progress=progress)
    return surface.to_mesh(tolerance, faces=faces, progress=progress), None


def write_mesh(self, path, *, unit=None):
    """See `Mesh.write`."""
    write = writer_of(path)
    if len(self.faces) == 0:
        raise ValueError(f"{printable(path)}: expected a mesh with faces, got none")
    three_mf.check_unit(unit)
    _warn_of_lost(self, path, write)
    with library_of(f"{printable(path)}: Mesh.write"), whole_file(path) as temporary:
        if write in (_write_stl, _write_glb):
            write(self, temporary, _checked_offset(self, path))
        elif write is _write_3mf:
            write(self, temporary, unit)
        else:
            write(self, temporary)


def write_surface(self, path, tolerance=None, *, faces=None, for_print=False, progress=None):
    """See `Isosurface.write`."""
    writer_of(path)
    if not for_print and is_written_in_parts(self, path, tolerance, faces):
        write_stl_in_parts(self, path, progress)
        return None
    mesh, report = mesh_of(self, tolerance, faces, for_print, progress)
    mesh.write(path, unit=three_mf.unit_for(path, self.volume))
    return report


def writer_of(path):
    """The function that writes the format of a path."""
    check_path(path)
    writer = _WRITERS.get(os.path.splitext(os.fspath(path))[1].lower())
    if writer is None:
        raise ValueError(f"path: expected a name that ends in {', '.join(_WRITERS)}, got {printable(path)!r}")
    return writer


def _warn_of_lost(mesh, path, write):
    """Warn about numbers and colours of vertices that the format of a path does not have."""
    parts = {"values": (mesh.values, (_write_ply,)), "colors": (mesh.colors, (_write_ply, _write_obj, _write_glb))}
    lost = [name for name, (part, keeping) in parts.items() if part is not None and write not in keeping]
    if lost:
        warn(f"{printable(path)}: the format has no {' and '.join(lost)} of vertices: they are left out; .ply has them")


def _checked_offset(mesh, path):
    """The offset of the vertices in a file in single precision, after warnings about what the file does not have."""
    try:
        offset = offset_for(mesh.vertices, mesh.faces)
    except ValueError as error:
        raise ValueError(f"{printable(path)}: {error} keeps them") from None
    if offset.any() and writer_of(path) is _write_stl:
        warn_of_stl_offset(path, offset)
    if count := blurred_faces(mesh.vertices, mesh.faces, offset):
        warn(
            f"{printable(path)}: rounding to single precision moves corners of {count} of {len(mesh.faces)} faces by "
            f"more than a quarter of their shortest edges; .ply and .obj keep them"
        )
    return offset


def _write_stl(mesh, path, offset):
    with open(path, "wb") as file:
        file.write(stl_header(offset) + len(mesh.faces).to_bytes(4, "little"))
        file.write(stl_triangles(mesh, offset).tobytes())


def _write_glb(mesh, path, offset):
    import trimesh

    converted = _trimesh_from(mesh, offset)
    converted.vertex_attributes.clear()  # glTF has no NaN, and its names begin with an underscore
    converted.visual = trimesh.visual.ColorVisuals()  # of which it writes 8 bits
    if mesh.colors is not None:
        converted.vertex_attributes[_GLTF_COLORS] = np.clip(mesh._colors(), 0, 1).astype(np.float32)
    place = np.eye(4)
    place[:3, 3] = offset
    scene = trimesh.Scene()
    scene.add_geometry(converted, transform=place)
    with open(path, "wb") as file:
        has_normals = mesh.normals is not None  # trimesh would make some up, and the faces would look round
        if has_normals:
            converted.vertex_normals = _unit(mesh.normals)  # trimesh makes short ones 0
        file.write(scene.export(file_type="glb", include_normals=has_normals, tree_postprocessor=_name_colors))


def _name_colors(tree):
    """Give the colours the standard's name: they are linear, and dark ones need more than 8 bits."""
    for shape in tree["meshes"]:
        for part in shape["primitives"]:
            if _GLTF_COLORS in part["attributes"]:
                part["attributes"]["COLOR_0"] = part["attributes"].pop(_GLTF_COLORS)


def _write_3mf(mesh, path, unit):
    three_mf.write(_trimesh_from(mesh, 0.0), path, unit)


def _write_obj(mesh, path):
    # trimesh writes a number of decimal places, which lose small numbers; repr has the digits that keep each.
    points = mesh.vertices if mesh.colors is None else np.hstack([mesh.vertices, mesh.colors])
    normals = np.empty((0, 3)) if mesh.normals is None else mesh.normals
    corner = ("{0}" if mesh.normals is None else "{0}//{0}").format
    with open(path, "w", encoding="ascii") as file:
        for word, rows in (("v", points), ("vn", normals)):
            file.writelines(f"{word} {' '.join(map(repr, row))}\n" for row in rows.tolist())
        file.writelines(f"f {' '.join(map(corner, row))}\n" for row in (mesh.faces.astype(np.int64) + 1).tolist())


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
        word = "_".join(name.split()) or "values"  # names in PLY have no spaces
        data[_free_name(word, PLY_NAMES)] = values
    output.point_data = data
    meshio.write(path, output, file_format="ply")


def _named_values(mesh, taken=()):
    """The values of a mesh by their name, if it has any."""
    return {} if mesh.values is None else {_free_name(mesh.values_name, taken): np.array(mesh.values)}


def _free_name(name, taken):
    """A name of values, longer if it is taken."""
    return f"{name}_values" if name in taken else name


def _srgb_colors(mesh):
    """(V, 3) uint8 colours for files, or None."""
    if mesh.colors is None:
        return None
    return np.rint(255 * np.clip(np.asarray(mesh.colors), 0, 1)).astype(np.uint8)


def _unit(vectors):
    """Vectors of any length in the length 1, which glTF expects; zero stays zero."""
    largest = np.abs(vectors).max(axis=1, keepdims=True)
    vectors = vectors / np.where(largest > 0, largest, 1)  # whose squares neither overflow nor vanish
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1)


# The standard's attributes are written in its types alone; those of applications, with a line before, in any type.
_GLTF_COLORS = "_COLORS"

_WRITERS = {
    ".stl": _write_stl,
    ".ply": _write_ply,
    ".obj": _write_obj,
    ".glb": _write_glb,
    ".3mf": _write_3mf,
}

#: Suffixes of mesh files that can be written.
MESHES = tuple(_WRITERS)
