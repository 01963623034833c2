"""A cut that closes the solid, with the volume's values on its faces."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import isospline
from isospline import volumes


def main(samples: int = 96, size: tuple[int, int] = (640, 480), folder: str = "out") -> NDArray[np.int64]:
    field = volumes.gyroid(periods=1.5)
    volume = field.volume(samples)

    # A clip at the volume's border closes the solid there as well.
    clip = [isospline.Box(*volume.bounds), isospline.HalfSpace((0, 0, 0), normal=(-1, 1, -1))]
    surface = isospline.Isosurface(volume, field.level, clip=clip, capped=True)

    values = isospline.ColorByVolume(volume, [(0.15, 0.05, 0.02), (1.0, 0.75, 0.3)], limits=(0, 1.5))
    shading = isospline.Phong(color=(0.55, 0.7, 0.75), cap_color=values, shadows=True)
    camera = isospline.PerspectiveCamera(eye=(3, -4, 2.5), target=(0, 0, 0), field_of_view=32)
    Path(folder).mkdir(exist_ok=True)
    scene = isospline.Scene([surface])
    image = isospline.render(
        scene, camera, size=size, light=shading, background="white", samples=16, layers=("primitive_ids",)
    )
    image.write(Path(folder) / "155-capped-cuts.png")

    # Primitive ids minus the number of cells identify the faces: 0 to 5 of the box, 6 of the half-space.
    return image.primitive_ids.astype(int) - volume.cell_count


if __name__ == "__main__":
    main()
