"""One unit of length for all files of a command: meshes and other volumes are converted to that of the volume."""

from __future__ import annotations

import numpy as np

import isospline

from ..base.units import ratio_of_units
from ..scene.mesh_files import unit_of_mesh
from ..scene.world_units import converts


def unit_of(given, path):
    """The unit of the coordinates of an object that a file gave; empty if it is not known."""
    if isinstance(given, isospline.Isosurface):
        return given.volume.unit
    if not isinstance(given, isospline.Mesh):
        return given.unit
    return unit_of_mesh(path)


def unit_transform(unit, arguments, say, given, path):
    """The transform to a unit, that of the volume of a command, from the unit of another file; None if it is that."""
    own = unit_of(given, path)
    ratio = ratio_of_units(own, unit)
    if ratio == 1:
        return None
    if ratio is None:
        raise ValueError(f"{path}: expected coordinates in {unit}, as in {arguments.file}, got {own}")
    say(f"{path}: coordinates in {own} are converted to {unit}")
    return np.diag([ratio, ratio, ratio, 1.0])


def volume_to_unit(to_unit, data, path):
    """The volume of a file's samples, placed in the unit of the command's volume, and the transform that is left."""
    scale = to_unit(data, path)
    if scale is None or not isinstance(data, isospline.VolumeData):
        return data.to_volume(), scale
    spacing, origin = (scale[0, 0] * np.asarray(place) for place in (data.spacing, data.origin))
    return data.replace(spacing=spacing, origin=origin, unit="").to_volume(), None


def in_one_unit(placed, unit, arguments, say):
    """The meshes of a command, (path, mesh, transform) each, for `Scene`: converted, unless their transform does so."""
    pairs = []
    for path, mesh, place in placed:
        scale = None if converts(place) else unit_transform(unit, arguments, say, mesh, path)
        pairs.append((mesh, place if scale is None else place @ scale))
    return pairs
