"""The distance between two surfaces: mean, maximum, and where it is largest."""

import isospline
from isospline import volumes


def main(samples: int = 48, size: object = None, folder: str = "out") -> isospline.SurfaceDistance:
    field = volumes.sphere(0.7)
    volume = field.volume(samples)
    surface = isospline.Isosurface(volume, field.level)
    mesh = surface.to_mesh(tolerance=0.01)

    distance = isospline.surface_distance(surface, mesh, samples=2000)
    lower, upper = distance.maximum
    print(f"mean {distance.mean.value:.4f}, largest between {lower:.4f} and {upper:.4f}")
    print(f"farthest at {distance.points[distance.distances.argmax()]}")
    return distance


if __name__ == "__main__":
    main()
