"""A scene in other processes: it is pickled, built again there, and gives the same hits."""

from concurrent.futures import ProcessPoolExecutor

import numpy as np

import isospline
from isospline import volumes


def main(samples: int = 64, size: tuple[int, int] = (160, 120), folder: str = "out") -> list[float]:
    field = volumes.torus()
    volume = field.volume(samples)
    scene = isospline.Scene(isospline.Isosurface(volume, field.level))
    front = isospline.PerspectiveCamera(eye=(0, -4, 1), target=(0, 0, 0))
    cameras = [front.replace(eye=(x, -4, 1)) for x in (-1, 0, 1)]
    with ProcessPoolExecutor(2) as pool:
        results = list(pool.map(isospline.Scene.cast_rays, [scene] * 3, [camera.rays(size) for camera in cameras]))
    depths = [float(hits.t_hit[np.isfinite(hits.t_hit)].mean()) for hits in results]
    print("mean depths:", ", ".join(f"{depth:.3f}" for depth in depths))
    return depths


if __name__ == "__main__":
    main()
