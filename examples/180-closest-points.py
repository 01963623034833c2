"""Closest points and signed distance: contours on a plane through a surface, and lines to the nearest points."""

from pathlib import Path

import numpy as np
import PIL.Image
import PIL.ImageDraw
from numpy.typing import NDArray

import isospline
from isospline import volumes


def main(
    samples: int = 48, size: tuple[int, int] = (480, 480), folder: str = "out"
) -> tuple[NDArray[np.float64], isospline.ClosestPoints]:
    field = volumes.torus(major=0.5, minor=0.24)
    volume = field.volume(samples)
    surface = isospline.Isosurface(volume, field.level)

    # The plane y = 0.1, seen from the front. Distances are smooth, so every sixth pixel is enough to draw them.
    columns, rows = (max(2, pixels // 6) for pixels in size)
    x, z = np.meshgrid((np.arange(columns) + 0.5) * 2 / columns - 1, 1 - (np.arange(rows) + 0.5) * 2 / rows)
    points = np.stack([x, np.full_like(x, 0.1), z], axis=-1).reshape(-1, 3)
    coarse = surface.signed_distance(points, tolerance=1e-4).reshape(rows, columns).astype(np.float32)
    distance = np.asarray(PIL.Image.fromarray(coarse).resize(size, PIL.Image.Resampling.BICUBIC), float)

    # A contour line every 0.05, the surface in white; blue inside and orange outside.
    pixel = 2 / size[0]
    line = 1 - np.clip(np.abs((distance / 0.05 + 0.5) % 1 - 0.5) * 0.05 / pixel, 0, 1)
    edge = 1 - np.clip(np.abs(distance) / pixel - 0.7, 0, 1)
    fade = np.exp(-2.5 * np.abs(distance))[..., None]
    base = np.where(distance[..., None] < 0, (0.25, 0.5, 0.85), (0.95, 0.6, 0.25)) * fade + 0.12 * (1 - fade)
    color = np.maximum(base * (1 - 0.55 * line[..., None]), edge[..., None])
    picture = PIL.Image.fromarray(np.rint(255 * color.clip(0, 1)).astype(np.uint8))

    # Points on a circle, and the nearest points of the surface.
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    points = np.stack([0.93 * np.cos(angle), np.full(24, 0.1), 0.6 * np.sin(angle)], axis=-1)
    nearest = surface.closest_points(points)
    print(f"no point of the surface is nearer than told by more than {nearest['error_bounds'].max():.1e}")
    draw = PIL.ImageDraw.Draw(picture)
    for point, end in zip(points, nearest["points"]):
        draw.line([((q[0] + 1) * size[0] / 2, (1 - q[2]) * size[1] / 2) for q in (point, end)], fill="white", width=2)
    Path(folder).mkdir(exist_ok=True)
    picture.save(Path(folder) / "180-closest-points.png")
    return points, nearest


if __name__ == "__main__":
    main()
