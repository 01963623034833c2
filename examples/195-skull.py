"""A mouse's skull from a micro-CT scan, path traced: the picture of the README.

It needs mouse_skull.nrrd, from 3D Slicer's sample data, in the folder given by ISOSPLINE_VOLUMES, and
Open Image Denoise: pip install isospline[denoise].
"""

import os
from pathlib import Path

import numpy as np

import isospline


def main(samples: int = 64, size: tuple[int, int] = (1000, 500), folder: str = "out") -> None:
    data = isospline.read_volume(Path(os.environ["ISOSPLINE_VOLUMES"]) / "mouse_skull.nrrd")
    skull = isospline.Isosurface(data, level=40)
    lower, upper = skull.bounds
    center, length = (lower + upper) / 2, (upper - lower).max()
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]) * 30 * length
    table = isospline.Mesh(corners + (center[0], center[1], lower[2]), [(0, 1, 2), (0, 2, 3)])

    eye = center + length * np.array((1.14, -0.54, 0.33))
    camera = isospline.PerspectiveCamera(eye=eye, target=center + (0, -0.9, 0), field_of_view=27)
    integrator = isospline.PathTracer(
        materials={
            0: isospline.Material((0.85, 0.76, 0.61), roughness=0.45),
            1: isospline.Material((0.06, 0.066, 0.078), roughness=0.6),
        },
        lights=[
            isospline.SphereLight(center + length * np.array((0.9, -1.3, 1.2)), 0.4 * length, radiance=15),
            isospline.SphereLight(center + length * np.array((-1.4, 0.6, 1.1)), 0.3 * length, radiance=14),
            isospline.EnvironmentLight((0.07, 0.08, 0.11)),
        ],
    )
    image = isospline.render(
        isospline.Scene([skull, table]), camera, size=size, light=integrator, samples=samples, background=0.02
    )
    Path(folder).mkdir(exist_ok=True)
    image.denoise().save(Path(folder) / "195-skull.jpg")


if __name__ == "__main__":
    main()
