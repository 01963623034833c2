"""OBJ files. trimesh loses indented lines and orders faces by their materials, and VTK has single precision."""

from __future__ import annotations

import re
from array import array

import numpy as np

from .polygon_meshes import numbers_of, polygon_mesh


def read_obj(path):
    """The mesh of all faces of a file, without materials and textures."""
    vertices, colors, normals = array("d"), array("d"), array("d")
    corners, normal_corners, faces = array("q"), array("q"), array("q")
    for line in _lines(path):
        kind, *words = line.split()
        if kind == b"v":
            numbers = numbers_of(words, float, "a vertex", 3)
            vertices.extend(numbers[:3])
            colors.extend(numbers[3:6] if len(numbers) >= 6 else ())
        elif kind == b"vn":
            normals.extend(numbers_of(words, float, "a normal", 3)[:3])
        elif kind in (b"f", b"fo"):  # fo is an older word
            of_normals: list[bytes] = []
            if b"/" in line:
                parts = [word.split(b"/") for word in words]
                words = [part[0] for part in parts]
                of_normals = [part[2] for part in parts if len(part) == 3 and part[2]]
                normal_corners.extend(numbers_of(of_normals, int, "a face", 0))
            corners.extend(numbers_of(words, int, "a face"))
            faces.extend((len(words), len(vertices) // 3, len(of_normals), len(normals) // 3))
    return _mesh([np.reshape(each, (-1, 3)) for each in (vertices, colors, normals)], corners, normal_corners, faces)


def _mesh(points, corners, normal_corners, faces):
    """The mesh; a vertex of the file with several normals is several vertices of the mesh."""
    vertices, colors, normals = points
    sizes, vertex_counts, normal_sizes, normal_counts = np.reshape(faces, (-1, 4)).T
    rows = _rows(corners, np.repeat(vertex_counts, sizes), len(vertices), "v")
    normal_rows = _rows(normal_corners, np.repeat(normal_counts, normal_sizes), len(normals), "vn")
    has_normals, has_colors = len(normal_rows) == len(rows), len(colors) == len(vertices)
    step = len(normals) if has_normals else 1
    pairs, corners = np.unique(step * rows + (normal_rows if has_normals else 0), return_inverse=True)
    kept, kept_normals = np.divmod(pairs, max(step, 1))
    return polygon_mesh(
        vertices[kept],
        sizes,
        corners,
        normals[kept_normals] if has_normals else None,
        colors[kept] if has_colors else None,
    )


def _lines(path):
    """The lines that have words, without comments; a backslash at the end of a line continues it."""
    text = re.sub(rb"\\(\r\n|\r|\n)", b" ", path.read_bytes().removeprefix(b"\xef\xbb\xbf"))
    return filter(bytes.strip, (line.partition(b"#")[0] for line in text.splitlines()))


def _rows(indices, before, count, kind):
    """The rows of elements of a kind, of which so many are before each index: -1 is the last of them."""
    indices = np.asarray(indices, np.int64)
    for is_wrong, known, where in ((indices < -before, before, " before the face"), (indices > count, count, "")):
        if is_wrong.any():
            known = np.broadcast_to(known, indices.shape)[is_wrong][0]
            wrong = indices[is_wrong][0]
            raise ValueError(f"expected an index of one of the {known} {kind}{where}, got {wrong}")
    if not indices.all():
        raise ValueError(f"expected indices of {kind} that are not 0")
    return indices + np.where(indices < 0, before, -1)
