"""A triangle mesh and an isosurface in one scene, each with its own transform and shading."""

from pathlib import Path

import numpy as np

import isospline
from isospline import volumes


def main(samples: int = 96, size: tuple[int, int] = (640, 480), folder: str = "out") -> None:
    field = volumes.torus()
    volume = field.volume(samples)
    upright = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0.2], [0, 0, 0, 1.0]])
    floor = isospline.Mesh([[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]], [[0, 1, 2], [0, 2, 3]])

    scene = isospline.Scene()
    ring_id = scene.add(isospline.Isosurface(volume, field.level), upright)
    floor_id = scene.add(floor)

    camera = isospline.PerspectiveCamera(eye=(2.5, -5, 2.5), target=(0, 0, 0.3), field_of_view=30)
    shading = {
        ring_id: isospline.Phong(color=(0.9, 0.7, 0.2), specular=0.5),
        floor_id: isospline.Phong(color=(0.4, 0.5, 0.6), specular=0),
    }
    image = isospline.render(scene, camera, size=size, light=shading)
    Path(folder).mkdir(exist_ok=True)
    image.write(Path(folder) / "070-meshes.png")


if __name__ == "__main__":
    main()
