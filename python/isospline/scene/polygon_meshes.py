"""What the readers of OBJ, OFF and PLY share: numbers of a line, and meshes of polygons."""

from __future__ import annotations

from array import array

import numpy as np

from ..interop.checks import attributes, to_mesh
from ..interop.polygons import cut_polygons
from ..interop.vtk import check_indices
from .mesh import Mesh

# The types of `array.array` for numbers of Python.
_TYPES = {float: "d", int: "q"}


def numbers_of(words, kind, what, least=1):
    """The numbers that the words of a line are, an array of `float` or `int`."""
    try:
        numbers = array(_TYPES[kind], map(kind, words))
    except (ValueError, OverflowError):
        raise ValueError(f"expected numbers of {what}, got {_shown(words)}") from None
    if len(numbers) < least:
        raise ValueError(f"expected at least {least} numbers of {what}, got {_shown(words)}")
    return numbers


def _shown(words):
    return repr(b" ".join(words)[:80].decode("ascii", "replace"))


def polygon_mesh(vertices, sizes, corners, normals=None, colors=None, named=()):
    """The mesh of polygons with these numbers of corners, which are rows of vertices."""
    check_indices(corners, len(vertices))
    faces = cut_polygons(vertices, sizes, corners)
    found = attributes(normals, None if colors is None else _of_one(colors), named)
    return to_mesh(Mesh, {"vertices": vertices, "faces": faces, **found}, "mesh", {})


def _of_one(colors):
    """Colours from 0 to 1: of whole numbers, or of text, which has numbers up to 1 or bytes."""
    if colors.dtype.kind in "iu":
        return colors / np.iinfo(colors.dtype).max
    is_bytes = colors.max(initial=0) > 1 and np.array_equal(colors, np.rint(colors))
    return np.clip(colors / 255 if is_bytes else colors, 0, 1)
