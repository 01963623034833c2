"""Many instances of one object; and objects that are invisible for the camera or cast no shadow."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import isospline
from isospline import volumes


def place(x: float, y: float, size: float, turn: float) -> NDArray[np.float64]:
    """A transform: rotation about z, scaling and translation."""
    cosine, sine = size * np.cos(turn), size * np.sin(turn)
    return np.array([[cosine, -sine, 0, x], [sine, cosine, 0, y], [0, 0, size, size], [0, 0, 0, 1.0]])


def main(samples: int = 96, size: tuple[int, int] = (640, 400), folder: str = "out") -> isospline.Scene:
    field = volumes.heart(periods=3.5, sharpness=8)
    heart = isospline.Isosurface(field.volume(samples), field.level)
    floor = isospline.Mesh([[-60, -60, 0], [60, -60, 0], [60, 60, 0], [-60, 60, 0]], [[0, 1, 2], [0, 2, 3]])
    scene = isospline.Scene([floor])
    lights = [isospline.DirectionalLight((0.7, 0.5, -1)), isospline.DirectionalLight((-1, 1, -1), intensity=0.25)]
    shading = {0: isospline.Phong(color=(0.85, 0.84, 0.8), specular=0, ambient=0.15, lights=lights, shadows=True)}

    # An instance is only a transform: the object of the 169 instances is built and stored once. Every fourth instance
    # is only a shadow, and every fourth casts no shadow.
    random = np.random.default_rng(3)
    for i, (x, y) in enumerate(np.stack(np.meshgrid(range(-6, 7), range(-6, 7)), axis=-1).reshape(-1, 2)):
        where = 3.2 * np.array((x, y)) + random.uniform(-0.5, 0.5, 2)
        transform = place(where[0], where[1], random.uniform(0.75, 1.25), random.uniform(0, 2 * np.pi))
        number = scene.add(heart, transform, visible=i % 4 != 1, casts_shadow=i % 4 != 3)
        color = (0.75, 0.15, 0.12) if number % 2 else (0.9, 0.62, 0.3)
        shading[number] = isospline.Phong(color=color, ambient=0.15, lights=lights, shadows=True)
    print(f"{len(scene)} objects, of which {scene.build_count} were built, in {scene.memory / 1e6:.1f} MB")

    camera = isospline.PerspectiveCamera(eye=(14, -27, 17), target=(0.5, -3.5, 0), field_of_view=32)
    image = isospline.render(scene, camera, size=size, light=shading, background=(0.75, 0.8, 0.88), samples=4)
    Path(folder).mkdir(exist_ok=True)
    image.write(Path(folder) / "165-instances-and-masks.png")
    return scene


if __name__ == "__main__":
    main()
