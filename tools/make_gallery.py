"""Renders the README's gallery, docs/images/gallery.png, from the real volumes in the folder ISOSPLINE_VOLUMES."""

import os
from pathlib import Path

from PIL import Image

import isospline

FOLDER = Path(os.environ["ISOSPLINE_VOLUMES"])
SIZE = (480, 400)


def picture(name, level, view, shading, *, up=None, background=(1, 1, 1), **reading):
    volume = isospline.read_volume(FOLDER / name, **reading).to_volume()
    scene = isospline.Scene([isospline.Isosurface(volume, level)])
    camera = isospline.camera_for(scene, view=view, up=up, size=SIZE)
    image = isospline.render(scene, camera, size=SIZE, shading=shading, background=background, samples=9)
    return Image.fromarray(image.to_srgb()).convert("RGB")


engine = picture("engine.nii.gz", 80, (1, -1, 0.8), isospline.Phong(color=(0.55, 0.65, 0.8)))
head = picture(
    "vismale_128x256x256_uint8.raw", 60, (-0.35, -1, 0.1), isospline.Phong(color=(0.9, 0.66, 0.5)), up=(0, 0, -1),
    shape=(256, 256, 128), dtype="uint8", spacing=(1.57774, 0.995861, 1.00797),
)
skull = picture("mouse_skull.nrrd", 40, (1, -0.6, 0.5), isospline.Outline(exponent=2), background=(0, 0, 0))
tooth = picture(
    "tooth_103x94x161_uint16.raw", 600, (1, -1, 0.6), isospline.Phong(color=(0.9, 0.88, 0.8)),
    shape=(161, 94, 103), dtype="<u2",
)

gallery = Image.new("RGB", (2 * SIZE[0], 2 * SIZE[1]))
for number, tile in enumerate((engine, head, skull, tooth)):
    gallery.paste(tile, ((number % 2) * SIZE[0], (number // 2) * SIZE[1]))
gallery.save(Path(__file__).parents[1] / "docs" / "images" / "gallery.png", optimize=True)
