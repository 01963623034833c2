"""An image of PyVista and a mesh of trimesh in one scene, each at its place in the world."""

from pathlib import Path

import numpy as np
import pyvista
import trimesh

import isospline
from isospline import volumes


def main(samples: int = 96, size: tuple[int, int] = (640, 480), folder: str = "out") -> None:
    # A gyroid, rotated and placed with PyVista.
    field = volumes.gyroid()
    cosine, sine = np.cos(np.pi / 6), np.sin(np.pi / 6)
    place = np.array([[cosine, -sine, 0, 0], [sine, cosine, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    turn = place[:3, :3]
    grid = pyvista.ImageData(
        dimensions=(samples,) * 3,
        direction_matrix=turn,
        spacing=(2 / samples,) * 3,
        origin=turn @ np.full(3, -1 + 1 / samples),
    )
    grid["gyroid"] = field.values(samples).ravel()
    sheet = isospline.Isosurface(isospline.Volume.from_pyvista(grid, degree=3), field.level)

    # A frame around it, of twelve rods placed with trimesh.
    box = trimesh.creation.box(extents=(2, 2, 2), transform=place)
    edges = box.vertices[box.edges_unique]
    edges = edges[np.isclose(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1), 2)]
    rods = [trimesh.creation.cylinder(0.04, segment=edge) for edge in edges]
    joints = [trimesh.creation.icosphere(radius=0.07).apply_translation(corner) for corner in box.vertices]
    frame = isospline.Mesh.from_trimesh(trimesh.util.concatenate([*rods, *joints]))

    scene = isospline.Scene([sheet, frame])
    shading = {0: isospline.Phong(color=(0.2, 0.55, 0.75)), 1: isospline.Phong(color=(0.85, 0.65, 0.3), specular=0.5)}
    camera = isospline.camera_for(scene, view=(0.6, -1, 0.5), size=size)
    image = isospline.render(scene, camera, size=size, light=shading, background=(1, 1, 1), samples=4)
    Path(folder).mkdir(exist_ok=True)
    image.write(Path(folder) / "160-other-libraries.png")


if __name__ == "__main__":
    main()
