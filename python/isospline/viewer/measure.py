"""Measurement of a clicked point, and tables of measurements."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import asdict, dataclass, replace

import numpy as np

from .. import _core
from ..picture.rendering import render


@dataclass(frozen=True)
class Measurement:
    """A point of a surface, in world units.

    Attributes
    ----------
    object : int
        Id of the object in the state.
    position, normal : (3,) tuple of float
    index : (3,) tuple of float or None
        Position in the volume's grid; None on a mesh, like value and curvatures.
    value : float or None
        The value of the volume's model at the point.
    mean_curvature, gaussian_curvature : float or None
    thickness : float or None
        Thickness of the wall, in world units. On an isosurface, the diameter of the largest ball in the solid that
        touches the point. On a mesh or a cap, the distance straight through the wall to its other side. None if there
        is no other side.
    distance : float or None
        Distance to the previously measured point.
    id : int
        Unique among the measurements of a viewer.
    """

    object: int
    position: tuple[float, ...]
    normal: tuple[float, ...]
    index: tuple[float, ...] | None = None
    value: float | None = None
    mean_curvature: float | None = None
    gaussian_curvature: float | None = None
    thickness: float | None = None
    distance: float | None = None
    id: int = 0


def with_distances(measurements):
    """The measurements, each with its distance to the one before it."""
    found: list[Measurement] = []
    for each in measurements:
        distance = math.dist(each.position, found[-1].position) if found else None
        found.append(replace(each, distance=distance))
    return tuple(found)


def measure(scene, ids, camera, size, pixel):
    """Measure the visible point at a pixel.

    Parameters
    ----------
    scene : Scene
    ids : dict
        Geometry ids by ids of objects.
    camera : camera of the picture
    size : (int, int)
        Of the picture.
    pixel : (float, float)
        x points to the right and y downwards.

    Returns
    -------
    Measurement or None
        None if the picture shows the background.
    """
    column, row = (min(max(int(place), 0), side - 1) for place, side in zip(pixel, size))
    ray = camera.rays(tuple(size))[row, column].reshape(1, 6)
    outputs = ("t_hit", "geometry_ids", "primitive_ids", "primitive_normals", "positions")
    hits = scene.cast_rays(ray, outputs=outputs)
    if not np.isfinite(hits["t_hit"][0]):
        return None
    geometry = int(hits["geometry_ids"][0])
    position, normal = hits["positions"][0], hits["primitive_normals"][0]
    item = scene.object(geometry)
    known = {}
    if isinstance(item, _core.Isosurface):
        known = _of_surface(scene, item, ray[0], int(hits["primitive_ids"][0]) < item.volume.cell_count, position)
    if "mean_curvature" in known:
        thickness = float(item.thickness(position))
    else:
        inwards = scene.secondary_rays(ray, hits, -normal[None])
        thickness = float(scene.cast_rays(inwards, outputs=("t_hit",))["t_hit"][0])
    return Measurement(
        object=next(id for id, each in ids.items() if each == geometry),
        position=tuple(position.tolist()),
        normal=tuple(normal.tolist()),
        thickness=thickness if math.isfinite(thickness) else None,
        **known,
    )


def _of_surface(scene, surface, ray, is_skin, position):
    """Index and value of a point of an isosurface, and its curvatures if it is not on a cut."""
    volume = surface.volume
    index = np.linalg.solve(volume.affine, np.append(position, 1.0))[:3]
    known = {"index": tuple(index.tolist()), "value": float(volume.sample(position))}
    if is_skin:
        # The renderer computes curvatures: render one pixel with the same ray.
        origin, direction = ray[:3], ray[3:] / np.linalg.norm(ray[3:])
        up = np.eye(3)[np.argmin(np.abs(direction))]
        camera = _core.PerspectiveCamera(origin, origin + direction, up, 1e-3)
        mean, gaussian = render(scene, camera, size=(1, 1), layers=("curvature",)).curvature[0, 0].tolist()
        known.update(mean_curvature=mean, gaussian_curvature=gaussian)
    return known


def to_csv(measurements, names):
    """A table of measurements as CSV; `names` has the objects' names by their ids."""
    vectors = ("position", "normal", "index")
    columns = ["object"] + [f"{name}_{axis}" for name in vectors for axis in "xyz"]
    scalars = ["value", "mean_curvature", "gaussian_curvature", "thickness", "distance"]
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(columns + scalars)
    for each in map(asdict, measurements):
        row = [names.get(each["object"], each["object"])]
        for name in vectors:
            row += each[name] or ("", "", "")
        writer.writerow(row + ["" if each[name] is None else each[name] for name in scalars])
    return file.getvalue()
