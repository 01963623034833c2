"""Pixels that are lost or wrong if roots are only found by signs.

The paper (section 4) searches a cell for a root if f has different signs at both ends of the ray's segment in it. A ray
that enters and leaves the solid in one cell has equal signs there: the root is missed, and the pixel shows the
background or something farther away. Here the Bernstein coefficients of the polynomial along the ray prove that each
root is the first one.
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

import isospline
from isospline import volumes


def main(samples: int = 40, size: tuple[int, int] = (480, 400), folder: str = "out") -> tuple[float, float]:
    field = volumes.gyroid()
    walls = 0.15 - np.abs(field.values(samples))  # as thin as a cell
    volume = isospline.Volume(walls, **field.grid(samples))
    surfaces = [isospline.research.isosurface(volume, 0.0, method=method) for method in ("exact", "bracket")]
    camera = isospline.PerspectiveCamera(eye=(2, -4, 2.4), target=(0.3, -0.5, 0.05), field_of_view=20)
    exact, bracket = (isospline.Scene(surface).cast_rays(camera.rays(size))["t_hit"] for surface in surfaces)

    lost = np.isfinite(exact) & np.isinf(bracket)
    wrong = np.isfinite(bracket) & ~np.isclose(bracket, exact, rtol=1e-6)
    hit = np.isfinite(exact).sum()
    look = isospline.Phong(color="lightsteelblue", ambient=0.2, specular=0.1)
    scene = isospline.Scene(surfaces[0])
    picture = np.array(isospline.render(scene, camera, size=size, light=look, background="white"))
    picture[lost, :3], picture[wrong, :3] = (200, 20, 20), (250, 150, 0)

    figure = Figure(figsize=(6, 5.6), layout="constrained")
    axes = figure.subplots()
    axes.imshow(picture, interpolation="nearest")
    axes.set_axis_off()
    axes.set_title(f"By signs alone, of {hit} pixels")
    parts = ("#c81414", f"lost: {lost.sum() / hit:.1%}"), ("#fa9600", f"wrong: {wrong.sum() / hit:.1%}")
    patches = [Patch(color=color, label=label) for color, label in parts]
    figure.legend(handles=patches, loc="outside lower center", ncols=2)
    Path(folder).mkdir(exist_ok=True)
    figure.savefig(Path(folder) / "255-lost-pixels.png")
    return lost.sum() / hit, wrong.sum() / hit


if __name__ == "__main__":
    main()
