"""Rays that leave a surface: a mirror made with cast_rays. There is no distance to tune."""

from pathlib import Path

import numpy as np
import PIL.Image
from numpy.typing import NDArray

import isospline
from isospline import volumes


def reflected(directions: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    along: NDArray[np.float64] = (directions * normals).sum(-1, keepdims=True)
    return directions - 2 * along * normals


def sky(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Blue above, brown below, by the height of a direction."""
    height: NDArray[np.float64] = directions[..., 2:] / np.linalg.norm(directions, axis=-1, keepdims=True)
    return np.where(height > 0, 1 - height * (0.75, 0.5, 0.2), (0.35, 0.3, 0.26) + 0.3 * (1 + height) ** 6)


def main(samples: int = 96, size: tuple[int, int] = (640, 480), folder: str = "out", bounces: int = 8) -> None:
    field = volumes.gyroid(periods=1.0)
    volume = field.volume(samples)
    scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    camera = isospline.PerspectiveCamera(eye=(2.4, -3.4, 1.9), target=(0, 0, 0), field_of_view=36)

    rays = camera.rays(size).reshape(-1, 6)
    color, tint, pixels = np.zeros((len(rays), 3)), np.ones((len(rays), 3)), np.arange(len(rays))
    for _ in range(bounces):
        hits = scene.cast_rays(rays)
        hit = np.isfinite(hits.t_hit)
        color[pixels[~hit]] = tint[pixels[~hit]] * sky(rays[~hit, 3:])
        rays, pixels, hits = rays[hit], pixels[hit], hits.select(hit)
        tint[pixels] *= (0.95, 0.78, 0.5)  # gold
        rays = scene.secondary_rays(rays, hits, reflected(rays[:, 3:], hits.primitive_normals))
    color[pixels] = 0.3 * tint[pixels]
    print(f"{len(rays)} rays are still on their way after {bounces} reflections")

    Path(folder).mkdir(exist_ok=True)
    bytes_ = np.rint(255 * color.clip(0, 1) ** (1 / 2.2)).astype(np.uint8)
    PIL.Image.fromarray(bytes_.reshape(*size[::-1], 3)).save(Path(folder) / "170-secondary-rays.png")


if __name__ == "__main__":
    main()
