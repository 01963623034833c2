"""Functions that all conversions share: checks, and the last step."""

from __future__ import annotations

import contextlib

# Options of `Volume` that the other library's object determines.
_PLACE = ("spacing", "origin", "direction", "axes")


# The extra of isospline that installs a library.
_EXTRAS = {
    **dict.fromkeys(("SimpleITK", "nibabel", "vtkmodules"), "io"),
    **dict.fromkeys(("meshio", "pyvista", "trimesh", "xarray"), "interop"),
}


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
    return volume_type(data.data, spacing=data.spacing, origin=data.origin, direction=data.direction, **options)


def to_mesh(mesh_type, vertices, faces, parameter, options):
    """Make a mesh of at least one triangle."""
    if len(faces) == 0:
        raise ValueError(f"{parameter}: expected faces, got none ({len(vertices)} vertices)")
    return mesh_type(vertices, faces, **options)
