"""A turn around a surface, as a sheet of frames; isospline.write_video makes a video of the same images."""

from pathlib import Path

import numpy as np
import PIL.Image

import isospline
from isospline import volumes


def main(samples: int = 96, size: tuple[int, int] = (160, 150), folder: str = "out") -> None:
    columns, rows = 4, 2
    field = volumes.heart(periods=3.5, sharpness=8)
    volume = field.volume(samples, degree=3)
    scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    color = isospline.ridges_and_valleys(8, color=(0.55, 0.12, 0.1), valley=(0.1, 0.01, 0.01))
    shading = isospline.Phong(color=color, specular=0.3)

    cameras = isospline.turntable_cameras(scene, columns * rows, view=(0, -1, 0.25), size=size)
    frames = [
        isospline.render(scene, camera, size=size, light=shading, background="white", samples=4) for camera in cameras
    ]
    pixels = np.stack([frame.to_srgb()[..., :3] for frame in frames])
    sheet = pixels.reshape(rows, columns, *pixels.shape[1:]).swapaxes(1, 2).reshape(rows * size[1], -1, 3)
    Path(folder).mkdir(exist_ok=True)
    PIL.Image.fromarray(sheet).save(Path(folder) / "190-turntable.png")


if __name__ == "__main__":
    main()
