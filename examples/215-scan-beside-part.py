"""A scan next to the part that was scanned: a mesh of trimesh, moved, with colours by objects."""

from pathlib import Path

import numpy as np
import trimesh

import isospline
from isospline import volumes


def main(samples: int = 96, size: tuple[int, int] = (640, 480), folder: str = "out") -> float:
    field = volumes.sphere(0.7)
    scan = isospline.Isosurface(field.volume(samples), field.level)
    part = isospline.Mesh.from_trimesh(trimesh.creation.icosphere(4, 0.7))
    move = np.eye(4)
    move[0, 3] = 1.6
    scene = isospline.Scene([scan, (part, move)])

    shading = {scan: isospline.Phong(color="ivory"), part: isospline.Phong(color="steelblue")}
    image = isospline.render(scene, size=size, light=shading, background="white", samples=4)
    largest = np.abs(scan.signed_distance(part.vertices)).max()
    print(f"the part is at most {largest:.4f} from the scan")

    Path(folder).mkdir(exist_ok=True)
    image.save(Path(folder) / "215-scan-beside-part.png")
    return float(largest)


if __name__ == "__main__":
    main()
