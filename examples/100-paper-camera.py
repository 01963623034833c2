"""The paper's setting: an eye inside the volume and a projection plane, positional lights, layers in OpenEXR."""

from pathlib import Path

import isospline
from isospline import volumes


def main(samples: int = 128, size: tuple[int, int] = (640, 360), folder: str = "out") -> None:
    field = volumes.gyroid(periods=2)
    volume = field.volume(samples)
    scene = isospline.Scene([isospline.Isosurface(volume, field.level, inside="below")])

    camera = isospline.ProjectionPlaneCamera(
        eye=(0.25, -0.6, 0.25), center=(0.25, -0.4, 0.25), right=(0.32, 0, 0), down=(0, 0, -0.18)
    )
    lights = [
        isospline.PositionalLight((0.1, -0.7, 0.5), intensity=0.8),
        isospline.PositionalLight((0.6, 0.2, 0.2), intensity=(0.5, 0.4, 0.3)),
    ]
    image = isospline.render(scene, camera, size=size, light=isospline.Phong(lights=lights))

    Path(folder).mkdir(exist_ok=True)
    image.write(Path(folder) / "100-paper-camera.exr")  # colour, depth, position, normal, ids, camera matrices
    image.write(Path(folder) / "100-paper-camera.png")


if __name__ == "__main__":
    main()
