"""All crossings of rays with a solid: where they enter and leave."""

import numpy as np

import isospline
from isospline import volumes


def main(samples: int = 64, size: tuple[int, int] = (16, 16), folder: str = "out") -> float:
    field = volumes.torus(major=0.6, minor=0.25)
    volume = field.volume(samples)
    scene = isospline.Scene(isospline.Isosurface(volume, field.level))

    rays = np.array([(-2, 0, 0, 1, 0, 0), (0, 0, -2, 0, 0, 1), (0.6, 0, -2, 0, 0, 1)], np.float32)
    hits = scene.cast_rays(rays)
    print("first hits, in the type of the rays:", hits.t_hit)
    crossings = scene.list_intersections(rays)
    for ray in range(len(rays)):
        of_ray = slice(*crossings.ray_splits[ray : ray + 2])
        print(f"ray {ray}:", crossings.t_hit[of_ray].round(3), crossings.entering[of_ray])
    inside: float = np.where(crossings.entering, -crossings.t_hit, crossings.t_hit).sum()
    return float(inside)


if __name__ == "__main__":
    main()
