"""First pictures: what is shown of a volume if nothing is said, as a person would hold it.

Formulas, turned at random, keep the usual view. Bodies without directions stand up: a head by its neck and its face,
and what lies on a plate by the plate, which is left out. For files: ``015-first-pictures.py head.mha mouse.nrrd``.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import isospline
from isospline.volumes import blobs, gyroid, heart, marschner_lobb, torus, waves


def ball(p: Any, x: float, y: float, z: float, radii: Any, order: float = 2) -> Any:
    return (1 - np.linalg.norm((p - (x, y, z)) / radii, order, axis=-1)) * np.min(radii)


def bodies(p: Any) -> dict[str, Any]:
    """Values above 0 inside, at (..., 3) points in [-1, 1]^3."""
    x, y, z = np.moveaxis(p, -1, 0)
    eyes = np.maximum(*[ball(p, side, -0.72, 0.24, (0.12, 0.1, 0.1)) for side in (-0.22, 0.22)])
    skull, jaw = ball(p, 0, 0, 0.2, (0.56, 0.72, 0.64)), ball(p, 0, -0.4, -0.24, (0.36, 0.36, 0.28))
    face = [skull, jaw, ball(p, 0, -0.74, 0.1, (0.1, 0.14, 0.16)), np.minimum(0.34 - np.hypot(x, y - 0.1), 0.2 - z)]
    glass = np.minimum(np.interp(z, [0.2, 0.44], [0.32, 0.14]) - np.hypot(x, y), np.minimum(z + 0.88, 0.8 - z))
    knobs = [ball(p, *center, 0.22) for center in ((-0.6, -0.08, 0), (-0.6, 0.1, 0), (0.62, 0.06, 0))]
    shaft, table = np.minimum(0.13 - np.hypot(y, z), 0.65 - np.abs(x)), 0.04 - np.abs(y - 0.64)
    return {
        "head": np.minimum(np.max(face, axis=0), -eyes),
        "bottle": np.maximum(glass, 0.04 - np.abs(z + 0.9)),
        "bone": np.max([shaft, *knobs, table], axis=0),
        "two objects": np.maximum(ball(p, -0.46, 0, 0, 0.4), ball(p, 0.46, 0, 0, 0.34, np.inf)),
        "slab": ball(p, 0, 0, 0, (0.6, 0.8, 0.12), np.inf),
        "noise": np.random.default_rng(1).normal(0, 0.05, p.shape[:-1]),
    }


def main(samples: int = 96, size: tuple[int, int] = (320, 260), folder: str = "out", *files: str) -> None:
    shown = {Path(path).name.split(".")[0]: isospline.read_volume(path).to_volume() for path in files}
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, samples)] * 3, indexing="ij")[::-1], axis=-1)
    for field in () if files else (torus(), gyroid(), marschner_lobb(), blobs(), waves(8), heart()):
        turn = np.linalg.qr(np.random.default_rng(len(shown)).normal(size=(3, 3)))[0]
        shown[f"{field}"[8:]] = isospline.Volume(field.value(grid @ turn) - field.level)
    for name, values in () if files else bodies(grid[..., [2, 0, 1]]).items():
        shown[name] = isospline.Volume(np.clip(values * samples / 2, -1, 1).astype(np.float32))
    figure, rows = Figure(figsize=(12, 2.6 * -(-len(shown) // 4)), layout="constrained"), -(-len(shown) // 4)
    for axes, (name, volume) in zip(figure.subplots(rows, 4, squeeze=False).ravel(), shown.items()):
        light = isospline.Studio(material=isospline.Material("ivory"))
        axes.imshow(isospline.render(volume, size=size, light=light, background=0.9, samples=4))
        axes.set(title=name, xticks=[], yticks=[])
    Path(folder).mkdir(exist_ok=True)
    figure.savefig(Path(folder) / "015-first-pictures.png")


if __name__ == "__main__":
    main(96, (320, 260), "out", *sys.argv[1:])
