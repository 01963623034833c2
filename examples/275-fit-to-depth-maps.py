"""Inverse rendering: the samples of a ball become a heart, by gradients of eight depth maps."""

from pathlib import Path

import numpy as np
import PIL.Image

import isospline
from isospline import volumes
from isospline.derivatives import cast_vjp


def smoothed(array: np.ndarray) -> np.ndarray:
    for axis in range(3):
        array = (np.roll(array, 1, axis) + 2 * array + np.roll(array, -1, axis)) / 4
    return array


def main(samples: int = 64, size: tuple[int, int] = (96, 72), folder: str = "out", steps: int = 100) -> float:
    # Eight depth maps of a heart, inside of a ball.
    field = volumes.heart()
    heart = isospline.Isosurface(field.volume(samples), field.level)
    cameras = isospline.turntable_cameras(heart, 8, size=size)
    rays = np.stack([camera.rays(size) for camera in cameras])
    depths = isospline.Scene(heart).cast_rays(rays).t_hit
    grid = field.grid((samples, samples, samples))
    data = 0.95 - np.linalg.norm(np.meshgrid(*[np.linspace(-1, 1, samples)] * 3), axis=0)

    error, mean, square = np.inf, np.zeros_like(data), np.zeros_like(data)
    for step in range(steps):
        fitted = isospline.Isosurface(isospline.Volume(data, **grid), 0.0)
        hits, vjp = cast_vjp(isospline.Scene(fitted), rays)
        is_hit = np.isfinite(hits.t_hit)
        both, lone = is_hit & np.isfinite(depths), is_hit & ~np.isfinite(depths)
        # The gradient of the squared errors, without outliers; where there is no heart, the surface is pushed away.
        of_t = np.zeros_like(depths)
        off = hits.t_hit[both] - depths[both]
        of_t[both], of_t[lone], error = np.clip(off, -0.1, 0.1), -0.05, float(np.median(np.abs(off)))
        gradient = smoothed(vjp(t_hit=of_t)["samples"][0])
        # Adam's step (Kingma & Ba 2015), shorter and shorter.
        mean, square = 0.8 * mean + 0.2 * gradient, 0.95 * square + 0.05 * gradient**2
        scale = np.sqrt(square)
        data = data - 0.03 * (1 - step / steps) * mean / (scale + 1e-3 * scale.max() + 1e-12)
    fitted = isospline.Isosurface(isospline.Volume(data, **grid), 0.0)
    print(f"depths are off by {error:.4f} in the median, in units of the ray's direction")

    wide = (4 * size[0], 4 * size[1])
    views = [np.asarray(isospline.render(each, cameras[1], size=wide)) for each in (heart, fitted)]
    Path(folder).mkdir(exist_ok=True)
    PIL.Image.fromarray(np.concatenate(views, axis=1)).save(Path(folder) / "275-fit-to-depth-maps.png")
    return error


if __name__ == "__main__":
    main()
