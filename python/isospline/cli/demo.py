"""The command ``isospline demo``: a volume and a picture to start from, without any file."""

from __future__ import annotations

import os
import shlex
from typing import Any

import numpy as np

import isospline

from ..base.system import whole_file
from .write import writing

#: Samples of the volume along each axis, and pixels of the picture.
SAMPLES, SIZE = 192, (960, 720)

NEXT = """
What to try next:
  isospline info {volume}
  isospline view {volume} --level {level:g}
  isospline render {volume} --level {level:g} --light path-trace -o {traced}
  isospline measure {volume} --level {level:g}

The same with a file of yours (NIfTI, NRRD, MetaImage, DICOM, TIFF, VTK, NumPy or raw):
  isospline view head.nii.gz
  isospline render head.nii.gz -o head.png

`isospline COMMAND --help` lists the options of a command."""


def make_demo(folder, progress):
    """Write the volume ``demo.npy`` and the picture ``demo.png`` into a folder.

    ``progress(title)`` is a context manager that returns a function of the finished fraction. Returns the text for the
    user.
    """
    if os.path.exists(folder) and not os.path.isdir(folder):
        raise NotADirectoryError(f"{folder}: expected a folder, got a file")
    os.makedirs(folder, exist_ok=True)
    paths = {
        name: os.path.join(folder, file)
        for name, file in (("volume", "demo.npy"), ("picture", "demo.png"), ("traced", "traced.png"))
    }

    field = isospline.volumes.heart()
    data = field.values(SAMPLES)
    with writing(), whole_file(paths["volume"]) as temporary, open(temporary, "wb") as file:
        np.save(file, data)

    with progress("filtering") as report:
        volume = isospline.Volume(data, progress=report)
    scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    camera = isospline.camera_for(scene, view=(0.4, -1, 0.3), size=SIZE)
    look: dict[str, Any] = {"color": (0.75, 0.06, 0.09)}
    with progress("rendering") as report:
        image = isospline.render(scene, camera, size=SIZE, progress=report, **look)
    with writing():
        image.write(paths["picture"])

    made = (
        f"{paths['volume']}: {SAMPLES} x {SAMPLES} x {SAMPLES} samples of a heart that dissolves into a gyroid\n"
        f"{paths['picture']}: its surface at level {field.level:g}, {SIZE[0]} x {SIZE[1]} pixels\n"
    )
    return made + NEXT.format(level=field.level, **{name: shlex.quote(path) for name, path in paths.items()})
