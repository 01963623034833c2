"""A user's typed script; test_types.py checks it, and nothing runs it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import isospline


def surface_of(path: Path, level: float | None = None) -> isospline.Isosurface:
    data = isospline.read_volume(path, spacing=0.1)
    level = isospline.suggest_levels(data.data, 1)[0] if level is None else level
    return isospline.Isosurface(data, level, clip=[isospline.HalfSpace((0, 0, 0), (0, 0, 1))], capped=True)


def depths(surface: isospline.Isosurface, rays: NDArray[np.float32]) -> NDArray[np.float32]:
    hits = isospline.Scene(surface).cast_rays(rays, outputs=("t_hit", "positions"))
    first: NDArray[np.float32] = hits.t_hit
    assert hits["t_hit"] is first
    nearest = surface.closest_points(hits.positions, max_distance=2.0)
    inside: NDArray[np.bool_] = surface.contains(nearest.points)
    return first[inside]


def pictures(scene: isospline.Scene, folder: Path) -> isospline.Image:
    camera = isospline.camera_for(scene, view="front", size=(320, 240))
    moved = camera.replace(up=(0, 0, 1))
    assert moved == camera
    looks = {0: isospline.Phong(color="white", opacity=0.5), 1: isospline.Outline(3)}
    isospline.render(scene, light="phong").save(folder / "first.jpg")
    image = isospline.render(
        scene, moved, size=(320, 240), light=looks, background="#102030", layers=("depth", "normal"), progress=True
    )
    lamp = isospline.SphereLight((0, 0, 9), 1.0, radiance=(10, 9, 8))
    traced = isospline.render(scene, light=isospline.PathTracer(lights=[lamp, isospline.EnvironmentLight(0.2)]))
    isospline.write_video(
        folder / "turn.mp4",
        (isospline.render(scene, each, light="phong") for each in isospline.turntable_cameras(scene, 90)),
    )
    studio = isospline.Studio(fast=True).replace(key=2.0)
    marked = isospline.render(scene.object(0), light=studio, annotate=("scale_bar",), unit="mm", background="w")
    reach: NDArray[np.float64] = scene.extent([(0, 0, 1)])
    assert marked.size == (640, 360) and reach.shape == (1, 2)
    pixels: NDArray[np.uint8] = np.asarray(image)
    assert pixels.shape == (*image.size[::-1], 4) and np.isfinite(image.depth).any()
    return traced
