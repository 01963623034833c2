"""The picture for a photograph: intrinsics and a (4, 4) pose in the form of OpenCV, COLMAP and Open3D."""

from pathlib import Path

import numpy as np

import isospline
from isospline import volumes


def main(samples: int = 96, size: tuple[int, int] = (640, 480), folder: str = "out") -> float:
    field = volumes.sphere(0.7)
    scene = isospline.Scene(isospline.Isosurface(field.volume(samples), 0.0))

    width, height = size
    K = np.array([(width, 0, width / 2), (0, width, height / 2), (0, 0, 1)])
    world_to_camera = np.eye(4)
    world_to_camera[:3, 3] = 0, 0, 4
    camera = isospline.ProjectionPlaneCamera.from_opencv(K, world_to_camera, size=size, pixel_center=0.5)
    image = isospline.render(scene, camera, size=size, light=isospline.Outline(3), layers=("depth",))
    print(f"the sphere begins {image.depth.min():.3f} before the camera")

    Path(folder).mkdir(exist_ok=True)
    image.write(Path(folder) / "210-photograph.png")
    return float(image.depth.min())


if __name__ == "__main__":
    main()
