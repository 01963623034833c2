"""Colours that depend on the point: a second volume, curvature, ridges and valleys, normals, depth, vertices."""

from pathlib import Path

import numpy as np

import isospline
from isospline import volumes


def main(samples: int = 96, size: tuple[int, int] = (480, 400), folder: str = "out") -> None:
    # Curvature depends on second derivatives, which are continuous for degree 3.
    field = volumes.heart(periods=3.5, sharpness=8)
    data = field.values(samples)
    volume = isospline.Volume(data, degree=3, **field.grid(samples))
    scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    camera = isospline.camera_for(scene, view=(0.4, -1, 0.3), size=size)

    waves = volumes.waves()
    other = waves.volume(samples)
    ramp = np.array([(0.02, 0.05, 0.3), (0.1, 0.6, 0.5), (1, 0.9, 0.2)])
    cool_warm = np.array([(0.05, 0.1, 0.6), (0.8, 0.8, 0.8), (0.6, 0.02, 0.05)])
    colors = {
        "volume": isospline.ColorByVolume(other, ramp),
        "curvature": isospline.ColorByCurvature("mean", cool_warm, limits=(-8, 8)),  # or a name, such as "coolwarm"
        "ridges": isospline.ridges_and_valleys(8, color=(0.4, 0.3, 0.2), valley=(0.05, 0.02, 0.01)),
        "normal": isospline.ColorByNormal(),
        "depth": isospline.ColorByDepth(ramp[::-1]),
    }
    Path(folder).mkdir(exist_ok=True)
    for name, color in colors.items():
        shading = isospline.Phong(color=color)
        image = isospline.render(scene, camera, size=size, light=shading, background=1, samples=4)
        image.write(Path(folder) / f"130-{name}.png")

    # An octahedron with the normals of a ball, and a colour by position at each vertex.
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    faces = [(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)]
    ball = isospline.Mesh(corners, faces, normals=corners, colors=(corners + 1) / 2)
    scene = isospline.Scene([ball])
    camera = isospline.camera_for(scene, view=(0.4, -1, 0.3), size=size)
    image = isospline.render(scene, camera, size=size, background=1, samples=4)
    image.write(Path(folder) / "130-vertices.png")


if __name__ == "__main__":
    main()
