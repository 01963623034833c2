"""Hard shadows of Phong's lights, and ambient occlusion: objects between a point and its light hide the light."""

from pathlib import Path

import isospline
from isospline import volumes


def main(samples: int = 96, size: tuple[int, int] = (640, 480), folder: str = "out") -> None:
    field = volumes.heart()
    volume = field.volume(samples)
    floor = isospline.Mesh([[-6, -6, -1], [6, -6, -1], [6, 6, -1], [-6, 6, -1]], [[0, 1, 2], [0, 2, 3]])
    scene = isospline.Scene([isospline.Isosurface(volume, field.level), floor])
    camera = isospline.PerspectiveCamera(eye=(1.5, -6, 2.5), target=(0, 0, -0.2), field_of_view=28)

    lights = [isospline.PositionalLight((-4, -4, 6)), isospline.DirectionalLight((-1, 0.4, -1.2), intensity=0.3)]
    shading = {
        0: isospline.Phong(color=(0.85, 0.15, 0.15), lights=lights, shadows=True),
        1: isospline.Phong(color=(0.8, 0.8, 0.75), specular=0, lights=lights, shadows=True),
    }
    Path(folder).mkdir(exist_ok=True)
    image = isospline.render(scene, camera, size=size, light=shading, samples=4)
    image.write(Path(folder) / "125-shadows.png")
    sky = isospline.AmbientOcclusion(samples=64)
    image = isospline.render(scene, camera, size=size, light=sky)
    image.write(Path(folder) / "125-ambient-occlusion.png")


if __name__ == "__main__":
    main()
