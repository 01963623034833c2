"""Translucent surfaces: objects behind them show through, in the exact order of all crossings."""

from pathlib import Path

import isospline
from isospline import volumes


def main(samples: int = 96, size: tuple[int, int] = (640, 480), folder: str = "out") -> None:
    # Two levels of one volume, nested, and a mesh that runs through both.
    field = volumes.blobs(count=8, width=0.22)
    volume = field.volume(samples)
    outer = isospline.Isosurface(volume, field.level)
    inner = outer.with_level(2.2 * field.level)
    plate = isospline.Mesh([[-0.3, -0.5, -1], [0.3, -0.5, -1], [0.3, 0.5, 1], [-0.3, 0.5, 1]], [[0, 1, 2], [0, 2, 3]])
    scene = isospline.Scene([outer, inner, plate])

    lights = [isospline.PositionalLight((-4, -6, 6)), isospline.DirectionalLight((-1, 0.4, -1.2), intensity=0.3)]
    shading = {
        0: isospline.Phong(color=(0.85, 0.3, 0.25), opacity=0.3, lights=lights, shadows=True),
        1: isospline.Phong(color=(0.9, 0.7, 0.5), opacity=0.6, lights=lights, shadows=True),
        2: isospline.Phong(color=(0.3, 0.5, 0.8), lights=lights, shadows=True),
    }
    camera = isospline.PerspectiveCamera(eye=(2, -4.5, 1.5), target=(0, 0, 0), field_of_view=28)
    Path(folder).mkdir(exist_ok=True)
    image = isospline.render(scene, camera, size=size, light=shading, background=0.9, samples=4)
    image.write(Path(folder) / "150-transparency.png")


if __name__ == "__main__":
    main()
