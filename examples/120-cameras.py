"""A lens with little depth of field, and a panorama from inside of the surface."""

from pathlib import Path

import isospline
from isospline import volumes


def main(samples: int = 128, size: tuple[int, int] = (640, 360), folder: str = "out") -> None:
    field = volumes.gyroid(periods=2)
    volume = field.volume(samples)
    scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    shading = isospline.Phong(color=(0.8, 0.45, 0.2))
    Path(folder).mkdir(exist_ok=True)

    # Points 4.6 away along the viewing direction are in focus. Every sample of a pixel has its own point of the lens.
    camera = isospline.PerspectiveCamera(eye=(3.2, -4.4, 2.2), target=(0, 0, -0.1), field_of_view=34)
    lens = camera.with_lens(aperture_radius=0.2, focus_distance=4.6)
    image = isospline.render(scene, lens, size=size, light=shading, background=1, samples=64)
    image.write(Path(folder) / "120-lens.png")

    inside = isospline.PanoramicCamera(eye=(0.25, -0.6, 0.25), target=(0.25, 0, 0.25))
    lamp = isospline.Phong(color=(0.8, 0.45, 0.2), lights=[isospline.PositionalLight(inside.eye)])
    image = isospline.render(scene, inside, size=(size[0], size[0] // 2), light=lamp, background=1, samples=4)
    image.write(Path(folder) / "120-panorama.png")


if __name__ == "__main__":
    main()
