"""A picture and its depth in a matplotlib figure."""

from pathlib import Path

from matplotlib.figure import Figure

import isospline
from isospline import volumes


def main(samples: int = 96, size: tuple[int, int] = (320, 240), folder: str = "out") -> None:
    field = volumes.gyroid()
    volume = field.volume(samples)
    scene = isospline.Scene(isospline.Isosurface(volume, field.level, clip=isospline.Box((-1, -1, -1), (1, 0.5, 1))))
    image = isospline.render(scene, size=size, light=isospline.Phong(color="gold"), layers=("depth",))

    figure = Figure(figsize=(8, 3))
    left, right = figure.subplots(1, 2)
    left.imshow(image)
    shown = right.imshow(image.depth)
    figure.colorbar(shown, ax=right, label="depth")
    Path(folder).mkdir(exist_ok=True)
    figure.savefig(Path(folder) / "230-figure.png")


if __name__ == "__main__":
    main()
