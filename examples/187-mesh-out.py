"""A mesh of the surface: closed, as coarse as a tolerance allows, and shown next to the exact surface."""

from pathlib import Path

import numpy as np

import isospline
from isospline import volumes


def main(samples: int = 48, size: tuple[int, int] = (640, 360), folder: str = "out") -> tuple[isospline.Mesh, float]:
    field = volumes.torus(major=0.5, minor=0.24)
    volume = field.volume(samples)
    surface = isospline.Isosurface(volume, field.level)

    mesh, distance = surface.to_mesh(tolerance=0.02, return_distance=True)
    print(f"{len(mesh.faces)} triangles, at most {distance:.3f} from the surface")
    Path(folder).mkdir(exist_ok=True)
    mesh.write(Path(folder) / "187-torus.stl")  # or .ply, .obj, .glb; surface.write(path, tolerance) does both

    # Flat triangles, without the mesh's normals, next to the surface itself.
    apart = np.eye(4)
    apart[0, 3] = 1.6
    scene = isospline.Scene([surface])
    scene.add(isospline.Mesh(mesh.vertices, mesh.faces), transform=apart)
    camera = isospline.camera_for(scene, view=(0.2, -1, 0.8), size=size)
    image = isospline.render(scene, camera, size=size, background="white")
    image.write(Path(folder) / "187-mesh-out.png")
    return mesh, distance


if __name__ == "__main__":
    main()
