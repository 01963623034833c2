"""OFF files. trimesh changes the order of faces and leaves out colours; meshio reads triangles alone."""

from __future__ import annotations

import re
from array import array

import numpy as np

from .polygon_meshes import numbers_of, polygon_mesh


def read_off(path):
    """The mesh of a text file, with its normals and colours of vertices."""
    lines = [line for line in (line.partition(b"#")[0].split() for line in path.read_bytes().splitlines()) if line]
    word, *counts = lines[0] if lines else [b""]
    kind = re.fullmatch(rb"(?:ST)?(C?)(N?)OFF", word)
    if kind is None or b"BINARY" in counts:
        raise ValueError("expected a text file that begins with OFF, COFF, NOFF, CNOFF or one of these after ST")
    begin = 1 if counts else 2
    counts = numbers_of(counts or next(iter(lines[1:]), []), int, "vertices and faces", 2)
    if min(counts) < 0:
        raise ValueError(f"expected numbers of vertices and faces, got {counts[0]} and {counts[1]}")
    vertex_count, face_count = counts[:2]
    rows, faces = lines[begin : begin + vertex_count], lines[begin + vertex_count :][:face_count]
    if len(faces) < face_count or len(rows) < vertex_count:
        raise ValueError(
            f"expected {vertex_count} vertices and {face_count} faces, got {len(lines) - begin} lines: the file is "
            "truncated"
        )
    width = 3 * (1 + bool(kind[1]) + bool(kind[2]))  # opacities and coordinates of textures follow
    numbers = array("d")
    for row in rows:
        numbers.extend(numbers_of(row, float, "a vertex", width)[:width])
    vertices, *others = np.split(np.reshape(numbers, (vertex_count, width)), range(3, width, 3), axis=1)
    sizes, corners = array("q"), array("q")
    for row in faces:
        size = numbers_of(row[:1], int, "a face")[0]
        indices = numbers_of(row[1 : 1 + max(size, 0)], int, "a face", size)
        sizes.append(len(indices))
        corners.extend(indices)
    normals = others.pop(0) if kind[2] else None
    colors = others.pop(0) if kind[1] else None
    return polygon_mesh(vertices, np.asarray(sizes), np.asarray(corners), normals, colors)
