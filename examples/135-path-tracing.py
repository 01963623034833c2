"""Materials, area lights and an environment: Monte Carlo path tracing until the noise is small."""

from pathlib import Path

import numpy as np

import isospline
from isospline import volumes


def main(samples: int = 96, size: tuple[int, int] = (480, 360), folder: str = "out") -> None:
    field = volumes.heart()
    volume = field.volume(samples)
    floor = isospline.Mesh([[-6, -6, -1], [6, -6, -1], [6, 6, -1], [-6, 6, -1]], [[0, 1, 2], [0, 2, 3]])
    scene = isospline.Scene([isospline.Isosurface(volume, field.level), floor])
    camera = isospline.PerspectiveCamera(eye=(1.5, -6, 2.5), target=(0, 0, -0.2), field_of_view=28)

    sky = np.linspace((0.5, 0.65, 0.9), (0.25, 0.22, 0.2), 16)[:, None].repeat(32, axis=1)  # from blue to brown
    integrator = isospline.PathTracer(
        materials={
            0: isospline.Material((0.75, 0.04, 0.04), roughness=0.25),
            1: isospline.Material((0.7, 0.7, 0.65), roughness=0.6),
        },
        lights=[
            isospline.RectangleLight((-5, -5, 5), (0, 2, 1), (2, 0, 0), radiance=25),
            isospline.EnvironmentLight(image=sky, visible=True),
        ],
    )
    images = isospline.render_progressive(scene, camera, size=size, light=integrator, samples=64, layers=("variance",))
    Path(folder).mkdir(exist_ok=True)
    for image in images:
        image.write(Path(folder) / "135-path-tracing.png")
        if np.sqrt(image.variance.mean()) < 0.02:
            break


if __name__ == "__main__":
    main()
