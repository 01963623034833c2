"""From a file to a picture in five lines, as a first program."""

from pathlib import Path

import numpy as np

import isospline
from isospline import volumes


def main(samples: int = 128, size: tuple[int, int] = (640, 480), folder: str = "out") -> isospline.Image:
    Path(folder).mkdir(exist_ok=True)
    path = Path(folder) / f"200-heart_{samples}x{samples}x{samples}_uint8.raw"
    (100 + 60 * volumes.heart().values(samples).clip(-1, 1)).astype(np.uint8).tofile(path)

    data = isospline.read_volume(path, spacing=0.5)  # shape and type are in the name
    level = isospline.suggest_levels(data.data)[0]
    surface = isospline.Isosurface(data, level)
    image = isospline.render(isospline.Scene(surface), size=size, background="white")
    image.save(Path(folder) / "200-first-try.jpg")
    return image


if __name__ == "__main__":
    main()
