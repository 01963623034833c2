"""The paper's voxel hopping compared with a scene: the same hits, with another method to find the cells."""

import numpy as np

import isospline
from isospline import volumes


def main(
    samples: int = 96, size: tuple[int, int] = (128, 128), folder: str = "out"
) -> tuple[isospline.Hits, isospline.Hits]:
    field = volumes.gyroid()
    volume = field.volume(samples)
    surface = isospline.Isosurface(volume, field.level)
    camera = isospline.PerspectiveCamera(eye=(3, -4, 2.5), target=(0, 0, 0))
    rays = camera.rays(size)

    scene_hits = isospline.Scene([surface]).cast_rays(rays)
    hopper_hits = isospline.research.VoxelHopper(surface).cast_rays(rays)

    hit = np.isfinite(scene_hits.t_hit)
    difference = np.abs(scene_hits.t_hit[hit] - hopper_hits.t_hit[hit]).max()
    print(f"{hit.sum()} hits, found at the same t within {difference:.1e}")
    return scene_hits, hopper_hits


if __name__ == "__main__":
    main()
