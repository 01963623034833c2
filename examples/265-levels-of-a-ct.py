"""Several levels of one CT: skin, bone, and bone inside skin that is only opaque at its silhouette.

One index of the volume serves all levels. For your own scan, pass a file and two levels, such as
``265-levels-of-a-ct.py head.nii.gz 500 1150``. The default is a phantom of a head in Hounsfield units, made from a
formula.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import isospline

Vector = tuple[float, float, float]


def phantom(samples: int) -> isospline.Volume:
    """Air, skin and brain, and a skull with eye sockets."""
    z, y, x = np.meshgrid(*[np.linspace(-1, 1, samples)] * 3, indexing="ij")

    def ball(center: Vector, radii: Vector) -> Any:  # from 0 outside to 1 inside
        parts = [(axis - middle) / radius for axis, middle, radius in zip((x, y, z), center, radii)]
        return 0.5 + 0.5 * np.tanh(12 * (1 - np.sqrt(np.square(parts).sum(axis=0))))

    head = ball((0, 0.05, 0.1), (0.62, 0.75, 0.78))
    tissue = 1 - (1 - head) * (1 - ball((0, 0.15, -0.9), (0.34, 0.38, 0.5)))  # and neck
    bone = ball((0, 0.07, 0.13), (0.5, 0.62, 0.65)) * (1 - ball((0, 0.08, 0.14), (0.43, 0.54, 0.57)))
    bone *= (1 - ball((-0.2, -0.55, 0.08), (0.13, 0.3, 0.11))) * (1 - ball((0.2, -0.55, 0.08), (0.13, 0.3, 0.11)))
    bone *= 1 - ball((0, -0.55, -0.14), (0.07, 0.3, 0.1))
    bone = np.maximum(bone, ball((0, 0.3, -0.8), (0.1, 0.1, 0.6)))  # and spine
    return isospline.Volume(1040 * tissue - 1000 + 1100 * bone, spacing=(200 / samples,) * 3)


def main(samples: int = 128, size: tuple[int, int] = (420, 480), folder: str = "out", *scan: str) -> None:
    path, *levels = scan or ("", "-300", "500")
    volume = isospline.read_volume(path).to_volume() if path else phantom(samples)
    skin = isospline.Isosurface(volume, float(levels[0]))
    bone = skin.with_level(float(levels[1]))
    camera = isospline.camera_for(isospline.Scene(skin), view=(0.45, -1, 0.15), size=size)
    flesh, ivory = isospline.Phong(color="#d9a583", specular=0.1), isospline.Phong(color="#efe6d2", specular=0.1)
    edge = flesh.replace(opacity=0.08, silhouette_opacity=0.95, silhouette_exponent=2.5)
    panels = {levels[0]: {skin: flesh}, levels[1]: {bone: ivory}, "both": {skin: edge, bone: ivory}}

    figure = Figure(figsize=(11, 4.5), layout="constrained")
    for axes, (title, looks) in zip(figure.subplots(1, 3), panels.items()):
        scene = isospline.Scene(list(looks))
        axes.imshow(isospline.render(scene, camera, size=size, light=looks, background=0.9, samples=9))
        axes.set_title(title)
        axes.set_axis_off()
    Path(folder).mkdir(exist_ok=True)
    figure.savefig(Path(folder) / "265-levels-of-a-ct.png")


if __name__ == "__main__":
    main(128, (420, 480), "out", *sys.argv[1:4])
