"""Degrees 1, 2 and 3 on the signal of Marschner and Lobb: smoother models of the same 40^3 samples are more exact."""

from pathlib import Path

import isospline
from isospline import volumes


def main(samples: int = 40, size: tuple[int, int] = (480, 480), folder: str = "out") -> None:
    field = volumes.marschner_lobb()
    data = field.values(samples)
    camera = isospline.PerspectiveCamera(eye=(1.5, -3, 4), target=(0, 0, 0), field_of_view=32)

    Path(folder).mkdir(exist_ok=True)
    for degree in (1, 2, 3):
        volume = isospline.Volume(data, **field.grid(samples), degree=degree)
        surface = isospline.Isosurface(volume, field.level, inside="below")
        scene = isospline.Scene([surface])
        image = isospline.render(scene, camera, size=size, background="white")
        image.write(Path(folder) / f"080-degree-{degree}.png")


if __name__ == "__main__":
    main()
