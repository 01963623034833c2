"""Samples of different distances along oblique axes: spacing, origin and direction place the volume in the world."""

import numpy as np

import isospline
from isospline import volumes


def main(samples: int = 48, size: tuple[int, int] = (8, 8), folder: str = "out") -> float:
    field = volumes.sphere()
    shape = (samples // 2, samples, samples)  # half as many slices, twice as far apart
    grid = field.grid(shape)

    # Rotated by 30 degrees about z and moved: the sphere's centre, the middle of index space, is at (10, 20, 30).
    angle = np.radians(30)
    direction = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    origin = np.array([10, 20, 30]) + direction @ grid["origin"]
    volume = isospline.Volume(field.values(shape), spacing=grid["spacing"], origin=origin, direction=direction)

    print("voxel to world:\n", volume.affine.round(3))
    scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    hits = scene.cast_rays([[10, 20, 0, 0, 0, 1]])  # from below, through the centre
    print("hit at z =", 30 - 0.7, "and", hits.t_hit[0])
    return float(hits.t_hit[0])


if __name__ == "__main__":
    main()
