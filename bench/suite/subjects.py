"""Subjects: procedural volumes of several sizes and, if ISOSPLINE_VOLUMES names their folder, real ones."""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import isospline
from isospline import volumes

#: Files of the folder of real volumes: interesting levels and, for raw files, what the name does not tell.
REAL = {
    "fuel.nii.gz": (40, {}),
    "headsq.mha": (500, {}),
    "ironprot.vtk": (128, {}),
    "tooth_103x94x161_uint16.raw": (600, {"shape": (161, 94, 103), "dtype": "<u2"}),
    "weave.tif": (140, {}),
    "engine.nii.gz": (80, {}),
    "mouse_skull.nrrd": (40, {}),
    "vismale_128x256x256_uint8.raw": (
        60,
        {"shape": (256, 256, 128), "dtype": "u1", "spacing": (1.57774, 0.995861, 1.00797)},
    ),
    "bonsai.nii.gz": (40, {}),
    "abdomen_512x512x275_int16.nii.gz": (-300, {}),
}


@dataclass
class Subject:
    """Samples [z, y, x], their place in the world, and a level."""

    name: str
    data: np.ndarray
    grid: dict  # spacing, origin and direction, as of isospline.Volume
    level: float


def procedural(names, sizes):
    """Subjects made of the named fields, with these sizes along each axis, one at a time."""
    for size in sizes:
        for name in names:
            field = getattr(volumes, name)()
            yield Subject(f"{name} {size}", field.values(size), field.grid(size), field.level)


def noisy(size):
    """Blobs seen by a detector that counts photons, so that the level lies within the noise of the ground."""
    field = volumes.blobs(24)
    light = np.clip(field.values(size), 0, None)
    counts = np.random.default_rng(size).poisson(6 + 40 * light / light.max())
    return Subject(f"noisy {size}", np.clip(4 * counts, 0, 255).astype(np.uint8), field.grid(size), 60.0)


def real(pattern=""):
    """Subjects made of the files in the folder ISOSPLINE_VOLUMES whose names contain the pattern."""
    folder = os.environ.get("ISOSPLINE_VOLUMES")
    if not folder:
        print("ISOSPLINE_VOLUMES is not set: no real volumes")
        return
    for name, (level, options) in REAL.items():
        path = Path(folder) / name
        if pattern.lower() not in name.lower():
            continue
        if not path.exists():
            print(f"{path} is not there: left out")
            continue
        volume = isospline.read_volume(path, **options)
        grid = {"spacing": volume.spacing, "origin": volume.origin, "direction": volume.direction}
        yield Subject(name.split(".")[0].split("_")[0], np.ascontiguousarray(volume.data), grid, level)


def cubic(subject):
    """The subject, padded to a cube with samples of its smallest value at the ends of its shorter axes."""
    size = max(subject.data.shape)
    data = np.pad(subject.data, [(0, size - count) for count in subject.data.shape], constant_values=subject.data.min())
    return Subject(subject.name, data, subject.grid, subject.level)


def closed(subject, margin=8):
    """The subject in a frame of samples below the level, so that its surface is closed within the volume."""
    floor = subject.data.min()
    if not floor < subject.level:
        raise ValueError(f"subject: expected samples below the level {subject.level:g}, got none in {subject.name}")
    data = np.pad(subject.data, margin, constant_values=floor)
    return Subject(subject.name, data, {}, subject.level)
