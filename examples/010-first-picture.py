"""From an array to a picture: a volume, its isosurface, a scene, a camera."""

from pathlib import Path

import isospline
from isospline import volumes


def main(samples: int = 128, size: tuple[int, int] = (640, 480), folder: str = "out") -> None:
    field = volumes.gyroid(periods=2)
    data = field.values(samples)  # data[z, y, x], any real or integer type

    volume = isospline.Volume(data, **field.grid(samples))
    surface = isospline.Isosurface(volume, level=field.level)
    scene = isospline.Scene([surface])
    camera = isospline.camera_for(scene, view=(3, -4, 2.5), size=size)
    shading = isospline.Phong(color=(0.9, 0.6, 0.3))
    image = isospline.render(scene, camera, size=size, light=shading, background="white", samples=16)

    Path(folder).mkdir(exist_ok=True)
    image.write(Path(folder) / "010-first-picture.png")


if __name__ == "__main__":
    main()
