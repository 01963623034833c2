"""All crossings along rays: the thickness of a solid, seen from one side."""

from pathlib import Path

import numpy as np
import PIL.Image
from numpy.typing import NDArray

import isospline
from isospline import volumes


def main(samples: int = 96, size: tuple[int, int] = (480, 400), folder: str = "out") -> NDArray[np.float64]:
    field = volumes.heart()
    volume = field.volume(samples)
    scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    camera = isospline.camera_for(scene, view="front", projection="orthographic", size=size)

    # The sum of t at exits minus the sum at entries, for each ray; `ray_ids` is the ray of each crossing.
    rays = camera.rays(size).reshape(-1, 6)
    crossings = scene.list_intersections(rays)
    length = np.linalg.norm(rays[crossings.ray_ids, 3:], axis=1) * crossings.t_hit
    sign = np.where(crossings.entering, -1, 1)
    thickness = np.zeros(len(rays))
    np.add.at(thickness, crossings.ray_ids, sign * length)
    thickness = thickness.reshape(size[::-1])
    walls = np.bincount(crossings.ray_ids, minlength=len(rays)) // 2
    print(f"at most {thickness.max():.2f} thick, through at most {walls.max()} walls")

    ramp = np.array([(0.02, 0.03, 0.08), (0.35, 0.06, 0.3), (0.85, 0.25, 0.2), (0.98, 0.7, 0.25), (1, 0.98, 0.85)])
    at = thickness / (thickness.max() or 1) * (len(ramp) - 1)
    color = np.stack([np.interp(at, range(len(ramp)), channel) for channel in ramp.T], axis=-1)
    Path(folder).mkdir(exist_ok=True)
    PIL.Image.fromarray(np.rint(255 * color).astype(np.uint8)).save(Path(folder) / "175-thickness.png")
    return thickness


if __name__ == "__main__":
    main()
