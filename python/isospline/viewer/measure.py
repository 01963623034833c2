"""Measurement of a clicked point."""

from __future__ import annotations

import math

import numpy as np

from ..cameras import PerspectiveCamera
from ..picture.rendering import render
from ..scene import Isosurface
from .measurements import MeasuredPoint


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
    MeasuredPoint or None
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
    if isinstance(item, Isosurface):
        known = _of_surface(scene, item, ray[0], int(hits["primitive_ids"][0]) < item.volume.cell_count, position)
    if "mean_curvature" in known:
        thickness = float(item.thickness(position))
    else:
        # To the other side of this object; others may be within it.
        inwards = scene.list_intersections(scene.secondary_rays(ray, hits, -normal[None]))
        own = inwards["t_hit"][inwards["geometry_ids"] == geometry]
        thickness = float(own[0]) if len(own) else math.inf
    return MeasuredPoint(
        object=next(id for id, each in ids.items() if each == geometry),
        position=tuple(position.tolist()),
        normal=tuple(normal.tolist()),
        thickness=thickness if math.isfinite(thickness) else None,
        **known,
    )


def index_of(position, grid):
    """Grid coordinates of a position, by what has the affine matrix of the grid."""
    return tuple(np.linalg.solve(grid.affine, np.append(position, 1.0))[:3].tolist())


def _of_surface(scene, surface, ray, is_skin, position):
    """Index and value of a point of an isosurface, and its curvatures if it is not on a cut."""
    volume = surface.volume
    known = {"index": index_of(position, volume), "value": float(volume.sample(position))}
    if is_skin:
        # The renderer computes curvatures: render one pixel with the same ray.
        origin, direction = ray[:3], ray[3:] / np.linalg.norm(ray[3:])
        up = np.eye(3)[np.argmin(np.abs(direction))]
        camera = PerspectiveCamera(origin, origin + direction, up, 1e-3)
        mean, gaussian = render(scene, camera, size=(1, 1), layers=("curvature",)).curvature[0, 0].tolist()
        known.update(mean_curvature=mean, gaussian_curvature=gaussian)
    return known
