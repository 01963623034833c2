"""Ray queries: the position of hits, the object, and the exact normal."""

import numpy as np
from numpy.typing import NDArray

import isospline
from isospline import volumes


def main(
    samples: int = 64, size: tuple[int, int] = (16, 16), folder: str = "out"
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    field = volumes.sphere(radius=0.7)
    volume = field.volume(samples)
    scene = isospline.Scene([isospline.Isosurface(volume, field.level)])

    # One ray per row: origin and direction. t is in units of the direction's length.
    x, z = np.meshgrid(np.linspace(-0.9, 0.9, size[0]), np.linspace(-0.9, 0.9, size[1]))
    rays = np.zeros((x.size, 6))
    rays[:, 0], rays[:, 1], rays[:, 2], rays[:, 4] = x.ravel(), -2, z.ravel(), 1

    hits = scene.cast_rays(rays)
    hit = np.isfinite(hits["t_hit"])
    points = rays[hit, :3] + hits["t_hit"][hit, None] * rays[hit, 3:]
    normals = hits["primitive_normals"][hit]

    print(f"{hit.sum()} of {len(rays)} rays hit")
    print(f"distance to the sphere: at most {np.abs(np.linalg.norm(points, axis=1) - 0.7).max():.1e}")
    print(f"angle to its normal: at most {np.abs(np.cross(normals, points / 0.7)).max():.1e} rad")
    return points, normals


if __name__ == "__main__":
    main()
