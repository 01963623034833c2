"""Volume, area and wall thickness of a solid, with their errors."""

import numpy as np

import isospline
from isospline import volumes


def main(samples: int = 64, size: object = None, folder: str = "out") -> tuple[float, float, float]:
    field = volumes.torus(major=0.5, minor=0.24)
    volume = field.volume(samples)
    surface = isospline.Isosurface(volume, field.level)

    content, area = surface.enclosed_volume(), surface.area()
    print(f"volume {content.value:.6f} +- {content.error:.0e}, of the torus {2 * np.pi**2 * 0.5 * 0.24**2:.6f}")
    print(f"area {area.value:.6f} +- {area.error:.0e}, of the torus {4 * np.pi**2 * 0.5 * 0.24:.6f}")

    points = surface.sample_points(200)["points"]
    thickness = float(np.median(surface.thickness(points)))
    print(f"thickness {thickness:.4f} in the median, of the torus {2 * 0.24}")
    return content.value, area.value, thickness


if __name__ == "__main__":
    main()
