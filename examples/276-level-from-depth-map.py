"""Inverse rendering: the level of a surface from one depth map, by the secant method on the picture's gradients."""

import numpy as np

import isospline
from isospline import volumes
from isospline.derivatives import picture_vjp


def main(samples: int = 64, size: tuple[int, int] = (80, 60), folder: str = "out", steps: int = 12) -> float:
    # Blobs that grow together at lower levels, seen at level 40. The search begins at level 60, with fewer of them.
    field = volumes.blobs(count=12, width=0.25)
    surface = isospline.Isosurface(isospline.Volume(50 * field.values(samples), **field.grid(samples)), 40.0)
    camera = isospline.PerspectiveCamera((4, 1, 1.5), (0, 0, 0), field_of_view=30)
    # Where there is no hit, the depth is that of a wall behind the blobs: so the outlines count, too.
    wall = 5.0
    measured, _ = picture_vjp(
        isospline.Scene(surface), camera, size, "depth", samples_per_pixel=64, background=wall, seed=1
    )

    level, change, slope_before = 60.0, 1.0, 0.0
    for step in range(steps):
        scene = isospline.Scene(surface.with_level(level))
        depths, vjp = picture_vjp(scene, camera, size, "depth", samples_per_pixel=16, background=wall)
        off = depths - measured
        # Half of the sum of squared errors has a slope of 0 at the level that fits best.
        slope = vjp(off, samples=False)["levels"][0]
        if step % 3 == 0:
            print(f"step {step}: level {level:.3f}, depths off by {np.sqrt(np.mean(off**2)):.4f}")
        # Always downhill and never far, since outlines that appear bend the slope.
        length = abs(slope * change / (slope - slope_before)) if step > 0 and slope != slope_before else 1.0
        change, slope_before = -np.sign(slope) * min(length, 4.0), slope
        level += change
    print(f"after {steps} steps: level {level:.3f}")
    return float(level)


if __name__ == "__main__":
    main()
