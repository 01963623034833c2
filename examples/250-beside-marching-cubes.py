"""Degrees 1, 2 and 3 compared with marching cubes of the same samples, at the same zoom.

Marching cubes make flat triangles through points on the edges of cells. Degree 1 is the trilinear surface that these
triangles approximate, with a crease at every face of a cell. Degrees 2 and 3 have a continuous gradient, and are
closer to the signal of Marschner and Lobb, of which there are 40 x 40 x 40 samples.
"""

from pathlib import Path

import pyvista
from matplotlib.figure import Figure

import isospline
from isospline import volumes


def main(samples: int = 40, size: tuple[int, int] = (400, 400), folder: str = "out") -> None:
    field = volumes.marschner_lobb()
    data, grid = field.values(samples), field.grid(samples)
    image_data = pyvista.ImageData(dimensions=data.shape[::-1], spacing=grid["spacing"], origin=grid["origin"])
    image_data["f"] = data.ravel()
    contour = image_data.contour([field.level], scalars="f", method="marching_cubes")

    scenes = {"marching cubes": isospline.Scene(isospline.Mesh.from_pyvista(contour))}
    for degree in (1, 2, 3):
        volume = isospline.Volume(data, **grid, degree=degree)
        scenes[f"degree {degree}"] = isospline.Scene(isospline.Isosurface(volume, field.level, inside="below"))

    camera = isospline.PerspectiveCamera(eye=(1.5, -3, 4), target=(0.15, -0.3, 0.1), field_of_view=9)
    look = isospline.Phong(color="#c9b79c", ambient=0.1, specular=0.12, specular_exponent=40)
    figure = Figure(figsize=(14, 3.9), layout="constrained")
    for axes, (name, scene) in zip(figure.subplots(1, 4), scenes.items()):
        axes.imshow(isospline.render(scene, camera, size=size, light=look, background="white", samples=9))
        axes.set_title(name)
        axes.set_axis_off()
    Path(folder).mkdir(exist_ok=True)
    figure.savefig(Path(folder) / "250-beside-marching-cubes.png")


if __name__ == "__main__":
    main()
