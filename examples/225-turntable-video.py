"""A video of one turn around a surface, in one call; .gif, or a folder of pictures, work as well."""

from pathlib import Path

import isospline
from isospline import volumes


def main(samples: int = 96, size: tuple[int, int] = (320, 240), folder: str = "out") -> Path:
    field = volumes.heart()
    surface = isospline.Isosurface(field.volume(samples), field.level, color="firebrick")
    Path(folder).mkdir(exist_ok=True)
    path = Path(folder) / "225-turntable-video.mp4"
    return isospline.turntable(surface, path, frames=12, fps=12, view="front", size=size, background="white")


if __name__ == "__main__":
    main()
