"""Figures 1 and 2 of the paper, and its table 1, with a volume similar to the paper's.

The paper's lobster is a scan of 120 x 120 x 34 samples of 8 bits. It is seen by an eye inside of it, 640 x 360 without
antialiasing, at the level of a K-means algorithm, with Phong's model with two positional lights, and with the outline
model. Its data are not free, so the volume here is made from a formula, on the same grid.
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import isospline
from isospline import volumes


def two_means(data: np.ndarray) -> float:
    """The level halfway between the means of both classes, as found by a K-means algorithm."""
    level, before = float(data.mean()), np.inf
    while abs(level - before) > 1e-6:
        before, level = level, float((data[data < level].mean() + data[data >= level].mean()) / 2)
    return level


def main(samples: int = 120, size: tuple[int, int] = (640, 360), folder: str = "out") -> list[int]:
    field = volumes.gyroid()
    shape = (round(samples * 34 / 120), samples, samples)  # z, y, x: slices are far apart
    values = field.values(shape)
    data = np.rint(255 * (values - values.min()) / np.ptp(values)).astype(np.uint8)
    volume, level = isospline.Volume(data, **field.grid(shape)), two_means(data)
    surface = isospline.Isosurface(volume, level, inside="below")

    camera = isospline.ProjectionPlaneCamera(
        eye=(0.25, -0.6, 0.25), center=(0.25, -0.4, 0.25), right=(0.32, 0, 0), down=(0, 0, -0.18)
    )
    places = {(0.1, -0.7, 0.5): 0.75, (0.6, 0.2, 0.2): 0.3}
    lights = [isospline.PositionalLight(place, intensity=intensity) for place, intensity in places.items()]
    looks = {"Phong, two positional lights": isospline.Phong(lights=lights), "outline, $n_o$ = 2": isospline.Outline(2)}
    counts = [
        isospline.research.isosurface(volume, level, prune_depth=depth, prune_border=False).shell.count
        for depth in range(5)
    ]

    figure = Figure(figsize=(12, 4), layout="constrained")
    for axes, (title, look) in zip(figure.subplots(1, 2), looks.items()):
        axes.imshow(isospline.render(isospline.Scene(surface), camera, size=size, light=look, background="black"))
        axes.set_title(title)
        axes.set_axis_off()
    table = ", ".join(f"{count} ({count / max(counts[0], 1):.0%})" for count in counts)
    grid = " x ".join(map(str, shape[::-1]))
    figure.suptitle(f"f = {level:.2f} of {grid} samples; cells after pruning 0 to 4 times: {table}", y=0, va="top")
    Path(folder).mkdir(exist_ok=True)
    figure.savefig(Path(folder) / "270-paper-figures.png", bbox_inches="tight")
    return counts


if __name__ == "__main__":
    main()
