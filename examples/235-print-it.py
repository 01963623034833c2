"""A mesh file for a printer: a solid that is cut and closed, checked by trimesh."""

from pathlib import Path

import trimesh

import isospline
from isospline import volumes


def main(samples: int = 64, size: object = None, folder: str = "out") -> float:
    field = volumes.gyroid()
    volume = field.volume(samples)
    box = isospline.Box((-0.8, -0.8, -0.8), (0.8, 0.8, 0.8))
    part = isospline.Isosurface(volume, field.level, clip=box, capped=True)

    Path(folder).mkdir(exist_ok=True)
    path = Path(folder) / "235-part.stl"
    part.write(path)

    mesh = trimesh.load_mesh(path)
    print(f"{len(mesh.faces)} triangles, closed: {mesh.is_watertight}, volume {mesh.volume:.4f}")
    return float(mesh.volume)


if __name__ == "__main__":
    main()
