"""A video of one turn around a scene, rendered image by image."""

from pathlib import Path

import isospline
from isospline import volumes


def main(samples: int = 96, size: tuple[int, int] = (320, 240), folder: str = "out") -> Path:
    field = volumes.heart()
    volume = field.volume(samples)
    scene = isospline.Scene(isospline.Isosurface(volume, field.level))

    shading = isospline.Phong(color="firebrick")
    cameras = isospline.turntable(scene, 12, view="front", size=size)
    images = (
        isospline.render(scene, camera, size=size, light=shading, background="white", encoding="srgb8")
        for camera in cameras
    )
    Path(folder).mkdir(exist_ok=True)
    path = Path(folder) / "225-turntable-video.mp4"
    isospline.write_video(path, images, fps=12)
    return path


if __name__ == "__main__":
    main()
