"""Meshes that may be larger than memory, in parts, and STL files of them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..base.parameters import printable
from ..base.progress import as_callable
from ..base.system import whole_file
from .single_precision import STL_HEADER_SIZE, offset_for_box, stl_header, warn_of_stl_offset

if TYPE_CHECKING:
    from ..scene.mesh import Mesh

#: A triangle in a binary STL file.
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_MOST_TRIANGLES = 2**32 - 1


def parts_of(surface: Any, cells: int, progress: Any) -> Iterator[Mesh]:
    """See `Isosurface.mesh_parts`."""
    return _nonempty(_core.MeshParts(surface, cells), as_callable(progress))


def _nonempty(parts: _core.MeshParts, report: Callable[[float], object] | None) -> Iterator[Mesh]:
    done = 0.0

    def report_all(fraction: float) -> object:
        nonlocal done
        done = max(done, fraction)  # each call begins with 0
        return report is None or report(done)

    while (part := parts.next(None if report is None else report_all)) is not None:
        if len(part.faces):
            yield part


def is_written_in_parts(surface, path, tolerance, faces):
    """Whether the mesh of a surface is written to a file part by part: without a tolerance, of a store, as STL."""
    is_stl = os.path.splitext(os.fspath(path))[1].lower() == ".stl"
    return is_stl and tolerance is None and faces is None and surface.volume.paging is not None


def write_stl_in_parts(surface, path, progress):
    """Write the mesh of a surface without a tolerance, part by part; returns the number of triangles."""
    volume = surface.volume
    try:
        lowest, highest = volume.bounds
        offset = offset_for_box(lowest, highest, 0.005 * np.min(volume.spacing))
    except ValueError as error:
        raise ValueError(f"{printable(path)}: {error} keeps them") from None
    count = 0
    with whole_file(path) as temporary, open(temporary, "wb") as file:
        file.write(stl_header(offset) + bytes(4))  # the number of triangles, once it is known
        for part in surface.mesh_parts(progress=progress):
            count += len(part.faces)
            if count > _MOST_TRIANGLES:
                raise ValueError(f"{printable(path)}: expected at most {_MOST_TRIANGLES} triangles, which STL can hold")
            file.write(stl_triangles(part, offset).tobytes())
        if count == 0:
            raise ValueError(f"{printable(path)}: expected a mesh with faces, got none")
        file.seek(STL_HEADER_SIZE)
        file.write(np.uint32(count).astype("<u4").tobytes())
    if offset.any():
        warn_of_stl_offset(path, offset)
    return count


def stl_triangles(mesh, offset):
    """The triangles of a mesh as a binary STL file has them, relative to an offset."""
    corners = mesh.vertices[mesh.faces] - offset
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    triangles = np.zeros(len(corners), _TRIANGLE)
    triangles["normal"] = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
    triangles["corners"] = corners
    return triangles
