"""The layers of an image: an EXR file with layers, and pictures of a few of them."""

from pathlib import Path

import numpy as np
import PIL.Image

import isospline
from isospline import volumes


def main(samples: int = 96, size: tuple[int, int] = (480, 400), folder: str = "out") -> None:
    field = volumes.heart(periods=3.5, sharpness=8)
    volume = field.volume(samples, degree=3)
    scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    camera = isospline.camera_for(scene, view=(0.4, -1, 0.3), size=size)
    shading = isospline.Phong(color=isospline.ridges_and_valleys(8, color=(0.5, 0.1, 0.1), valley=(0.1, 0, 0)))
    image = isospline.render(
        scene,
        camera,
        size=size,
        light=shading,
        samples=4,
        layers=("depth", "position", "normal", "albedo", "gradient_magnitude", "curvature", "geometry_ids"),
    )

    Path(folder).mkdir(exist_ok=True)
    image.write(Path(folder) / "140-layers.exr")  # R G B A, Z, P, N, albedo, gradient_magnitude, curvature, id.geometry

    seen = np.isfinite(image.depth)
    nearest, farthest = (image.depth[seen].min(), image.depth[seen].max()) if seen.any() else (0, 1)
    layers = {
        "depth": np.where(seen, (farthest - image.depth) / (farthest - nearest), 0),
        "normal": np.where(seen[..., None], (image.normal + 1) / 2, 0),
        "albedo": image.albedo,
        "gradient": image.gradient_magnitude / (image.gradient_magnitude.max() or 1),
        "curvature": np.where(seen, 0.5 + image.curvature[..., 0] / 16, 0),
    }
    for name, layer in layers.items():
        PIL.Image.fromarray(np.rint(255 * np.clip(layer, 0, 1)).astype(np.uint8)).save(Path(folder) / f"140-{name}.png")


if __name__ == "__main__":
    main()
