"""Two ways to look inside: straight cuts by half-spaces and boxes, and whole voxels by a mask."""

from pathlib import Path

import numpy as np

import isospline
from isospline import volumes


def main(samples: int = 128, size: tuple[int, int] = (640, 480), folder: str = "out") -> None:
    field = volumes.gyroid(periods=1.5)
    volume = field.volume(samples)

    # Keeps the part in the box and on the side of the plane that its normal points to.
    clip = [isospline.Box((-0.9, -0.9, -0.9), (0.9, 0.9, 0.9)), isospline.HalfSpace((0, 0, 0), normal=(-1, 1, -1))]
    cut = isospline.Isosurface(volume, field.level, clip=clip)

    # Keeps the voxels of a ball.
    z, y, x = np.indices(volume.shape) * (2 / samples) - 1
    masked = isospline.Isosurface(volume, field.level, mask=x**2 + y**2 + z**2 < 0.8)

    camera = isospline.PerspectiveCamera(eye=(3, -4, 2.5), target=(0, 0, 0), field_of_view=28)
    Path(folder).mkdir(exist_ok=True)
    for name, surface in {"clip": cut, "mask": masked}.items():
        scene = isospline.Scene([surface])
        image = isospline.render(scene, camera, size=size, background="white")
        image.write(Path(folder) / f"060-cutouts-{name}.png")


if __name__ == "__main__":
    main()
