"""Vertices in single precision: relative to an offset near the mesh, where rounding would lose detail."""

from __future__ import annotations

import math

import numpy as np

from ..base.parameters import printable
from ..base.system import warn

#: What may be lost: edges keep this many steps of float32, except those of the share of faces with the shortest ones.
_STEPS, _SHARE = 10, 0.01

_LARGEST = float(np.finfo(np.float32).max)

#: Of binary STL files.
STL_HEADER_SIZE = 80
# The beginning of the header of STL files with an offset.
_HEADER = b"offset "


@np.errstate(invalid="ignore", over="ignore")  # of coordinates that are refused
def offset_for(vertices, faces):
    """The point of which vertices are to be written in float32, as differences.

    Parameters
    ----------
    vertices : (V, 3) float64 array
    faces : (F, 3) integer array

    Returns
    -------
    (3,) float64 array
        Zero if float32 holds the vertices as they are, up to a small part of the edges of the faces. Otherwise its
        numbers are as round as precision allows, so that meshes of the same place mostly have the same one.

    Raises
    ------
    ValueError
        If a coordinate exceeds the range of float32.
    """
    corners = vertices[faces]
    edges = _shortest_edges(corners)
    edges = edges[edges > 0]
    step = np.quantile(edges, _SHARE) / _STEPS if len(edges) else math.inf
    return offset_for_box(corners.min(axis=(0, 1)), corners.max(axis=(0, 1)), step)


def offset_for_box(lowest, highest, step):
    """The same for all vertices between two corners, of which differences of `step` are to be kept."""
    largest = max(np.abs(lowest).max(), np.abs(highest).max())
    if largest > _LARGEST:
        raise ValueError(f"expected coordinates up to {_LARGEST:.3g} for single precision, got {largest:.3g}: .ply")
    if _spacing(largest) <= step:
        return np.zeros(3)
    # The largest power of ten within which float32 has these steps; but one near the mesh's size for larger meshes.
    unit = 10.0 ** math.floor(math.log10(max(step * 2**23, np.max(highest - lowest))))
    offset = np.rint((lowest + highest) / 2 / unit) * unit
    rest = max(np.abs(lowest - offset).max(), np.abs(highest - offset).max())
    return offset if 4 * _spacing(rest) <= _spacing(largest) else np.zeros(3)


def blurred_faces(vertices, faces, offset):
    """How many faces lose their form: rounding moves a corner by more than a quarter of the shortest edge.

    Zero if they are not more than the share that may be lost.
    """
    corners = vertices[faces] - offset
    moved = np.abs(corners.astype(np.float32) - corners).max(axis=(1, 2))
    count = int(np.sum(4 * moved > _shortest_edges(corners)))
    return count if count > _SHARE * len(faces) else 0


def _shortest_edges(corners):
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).min(axis=1)


def stl_header(offset):
    """The 80 bytes at the beginning of a binary STL file, which name the offset if there is one."""
    if not offset.any():
        return bytes(STL_HEADER_SIZE)
    return (_HEADER + " ".join(numbers_of(offset)).encode()).ljust(STL_HEADER_SIZE)


def warn_of_stl_offset(path, offset):
    """Warn that vertices in an STL file are relative to an offset."""
    warn(
        f"{printable(path)}: the vertices are written relative to ({', '.join(numbers_of(offset))}), which the "
        f"header names and read_mesh adds: STL has single precision, too little so far from the origin; .ply, .obj "
        f"and .glb keep the place"
    )


def numbers_of(offset):
    """The shortest texts of an offset's numbers that keep their values."""
    return [repr(number).removesuffix(".0") for number in offset.tolist()]


def offset_in_header(header):
    """The offset that the header of an STL file names; zero if there is none."""
    words = header[len(_HEADER) :].split() if header.startswith(_HEADER) else []
    try:
        offset = np.array([float(word) for word in words])
    except ValueError:
        return np.zeros(3)
    return offset if offset.shape == (3,) and np.isfinite(offset).all() else np.zeros(3)


def _spacing(number):
    """The distance of a number in float32 from the next one."""
    return float(np.spacing(np.float32(number)))
