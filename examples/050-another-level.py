"""Another level of the same volume: the coefficients are kept, and only the shell is computed again."""

from pathlib import Path

import isospline
from isospline import volumes


def main(samples: int = 128, size: tuple[int, int] = (320, 240), folder: str = "out") -> list[int]:
    field = volumes.blobs()
    volume = field.volume(samples)
    surface = isospline.Isosurface(volume, level=0.2)
    scene = isospline.Scene([surface])
    camera = isospline.PerspectiveCamera(eye=(2, -4, 2), target=(0, 0, 0), field_of_view=30)

    Path(folder).mkdir(exist_ok=True)
    counts = []
    for level in (0.2, 0.5, 0.9):
        surface.level = level
        image = isospline.render(scene, camera, size=size, background="white")
        image.write(Path(folder) / f"050-level-{level}.png")
        counts.append(surface.shell.count)
        print(f"level {level}: {surface.shell.count} cells in the shell")
    return counts


if __name__ == "__main__":
    main()
