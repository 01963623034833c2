"""The paper's outline illumination model: lines on paper, from the exact gradient and without light."""

from pathlib import Path

import isospline
from isospline import volumes


def main(samples: int = 128, size: tuple[int, int] = (640, 480), folder: str = "out") -> None:
    field = volumes.blobs()
    volume = field.volume(samples)
    scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    camera = isospline.PerspectiveCamera(eye=(2, -4, 2), target=(0, 0, 0), field_of_view=26)

    Path(folder).mkdir(exist_ok=True)
    for exponent in (1, 4):
        ink_on_paper = isospline.Outline(exponent, color=0, surface_color=1)
        image = isospline.render(scene, camera, size=size, light=ink_on_paper, background=1, samples=4)
        image.write(Path(folder) / f"020-outline-{exponent}.png")


if __name__ == "__main__":
    main()
