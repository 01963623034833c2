"""Functions that all conversions share: checks, and the last step."""

from __future__ import annotations

import contextlib
import re
from typing import Any

import numpy as np

# Options of `Volume` that the other library's object determines.
_PLACE = ("spacing", "origin", "direction", "axes")

# Properties of vertices in PLY that together are positions, normals, colours or places in a texture.
_PLY_GROUPS = (
    {"x", "y", "z"},
    {"nx", "ny", "nz"},
    {"red", "green", "blue"},
    {"red", "green", "blue", "alpha"},
    {"s", "t"},
    {"u", "v"},
)
#: The names of all of them.
PLY_NAMES = set[str]().union(*_PLY_GROUPS)

# The extra of isospline that installs a library.
_EXTRAS = {
    **dict.fromkeys(("SimpleITK", "nibabel", "vtkmodules"), "io"),
    **dict.fromkeys(("lxml", "meshio", "networkx", "pyvista", "trimesh", "xarray"), "interop"),
}


def names_of_values(names):
    """The names of properties of vertices, as in PLY, that may be values: a lone "s" is no place in a texture."""
    given = set(names)
    others = set[str]().union(*(group for group in _PLY_GROUPS if group <= given))
    return [name for name in names if name not in others]


@contextlib.contextmanager
def library_of(what):
    """Name a missing library, and how to install it."""
    try:
        yield
    except ModuleNotFoundError as error:
        extra = _EXTRAS.get((error.name or "").partition(".")[0])
        hint = f": pip install isospline[{extra}]" if extra else ""
        raise ModuleNotFoundError(f"{what} needs the package {error.name}{hint}", name=error.name) from error


@contextlib.contextmanager
def errors_name(parameter):
    """Put the name of the parameter in front of error messages."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{parameter}: {error}") from error
    except MemoryError as error:
        raise MemoryError(f"{parameter}: {error}") from error


def to_volume(volume_type, data, parameter, options):
    """Model a `VolumeData`; options may not change its place."""
    for name in _PLACE:
        if name in options:
            raise TypeError(f"{name}: expected none, as {parameter} has it, got {options[name]!r}")
    try:
        return volume_type(data.data, **{**data.frame, **options})
    except (ValueError, TypeError, MemoryError) as error:
        if not str(error).startswith("data: "):
            raise
        text = str(error).removeprefix("data: ")
        text = re.sub(r"data\[(\d+), (\d+), (\d+)\]", r"index (x, y, z) = (\3, \2, \1)", text)
        raise type(error)(f"{parameter}: {text}") from error


def to_mesh(mesh_type, arrays, parameter, options):
    """Make a mesh of at least one triangle from its arrays, by parameter; options replace them."""
    if len(arrays["faces"]) == 0:
        raise ValueError(f"{parameter}: expected faces, got none ({len(arrays['vertices'])} vertices)")
    return mesh_type(**{**arrays, **options})


def is_one_number_each(array):
    """Whether an array has one real number at each vertex."""
    return array.dtype.kind in "iuf" and (array.ndim == 1 or array.shape[1:] == (1,))


def attributes(normals, colors, named=()):
    """Normals, colours and values of vertices as parameters of `Mesh`, without those that are missing or unusable.

    Colours are sRGB, numbers from 0 to 1 or whole numbers up to 255. Opacity is left out. `named`
    are pairs of a name and an array; the values are the first array with one real number at each vertex.
    """
    found: dict[str, Any] = {}
    if normals is not None and np.isfinite(normals).all():
        found["normals"] = np.asarray(normals)
    if colors is not None and np.ndim(colors) == 2 and np.shape(colors)[1] >= 3:
        colors = np.asarray(colors)[:, :3]
        colors = colors / 255 if colors.dtype == np.uint8 else colors
        if colors.dtype.kind == "f" and np.isfinite(colors).all() and ((colors >= 0) & (colors <= 1)).all():
            found["colors"] = colors
    for name, values in named:
        values = np.asarray(values)
        if is_one_number_each(values):
            found["values"], found["values_name"] = values.reshape(-1).astype(float), str(name) or "values"
            break
    return found
