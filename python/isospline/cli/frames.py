"""``isospline render --frames``: a picture of each time step of a store, or of each volume in a folder."""

from __future__ import annotations

import argparse
import errno
import os
import re
from pathlib import Path

from ..base.parameters import check_path
from ..io.files import files_of
from ..io.read import FORMATS
from ..io.tiff import words_of
from ..picture.sequences import PICTURES, VIDEOS, is_numbered, numbered
from ..store import time_steps
from ..store.detail import is_store
from .record import Record, identity, options_of, record_path

# Files that --frames does not write: a folder with such a name would be a mistake.
_OTHER_FILES = (*VIDEOS, ".avi", ".bmp", ".jpeg", ".jpg", ".mkv", ".mov", ".tif", ".tiff", ".webm", ".webp")


def render_frames(arguments, render, say):
    """Make the pictures that are not there yet, or were made otherwise, each by ``render(arguments, write=True)``.

    All steps of a time series get the camera and the levels of the first; each volume of a folder has its own.
    """
    for name in ("session", "turntable", "checkpoint"):
        if getattr(arguments, name):
            raise ValueError(f"--{name} cannot be combined with --frames")
    if arguments.file is None:
        raise ValueError("FILE: expected a time series or a folder of volumes, got none")
    check_path(arguments.file)
    frames, is_series = _frames_of(Path(arguments.file), arguments.shape)
    outputs = _outputs(arguments.output, [name for name, _ in frames])
    record = Record(record_path(arguments.output))
    options = options_of(arguments)
    if is_series:
        options["first"] = identity(frames[0][1], arguments.shape)
    for number, ((_, path), output) in enumerate(zip(frames, outputs)):
        made_of = {**options, "volume": identity(path, arguments.shape)}
        is_made = os.path.exists(output) and record.has(output, made_of)
        frame = argparse.Namespace(**{**vars(arguments), "file": str(path), "output": str(output)})
        if is_made:
            say(f"{output} exists already")
        else:
            record.forget(output)
        if not is_made or (is_series and number == 0):
            cameras, levels = render(frame, write=not is_made)
        if not is_made:
            record.add(output, made_of)
        if is_series:
            arguments.cameras, arguments.level = cameras, levels


def _frames_of(path, shape):
    """Names and paths of the volumes to render, and whether they are a time series."""
    if not path.exists():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    if not path.is_dir():
        raise ValueError(f"{path}: expected a store of a time series or a folder of volumes, got a file")
    if is_store(path):
        steps = time_steps(path)
        if steps == [Path(os.path.realpath(path))]:
            raise ValueError(f"{path}: expected a time series, got a store of one volume: render it without --frames")
        return [(step.name, step) for step in steps], True
    files = [file for file in sorted(path.iterdir(), key=lambda file: words_of(file.name)) if _is_volume(file)]
    files = _without_named(files, shape)
    if not files:
        raise ValueError(f"{path}: expected a folder of volumes, got none in it")
    return [(file.name, file) for file in files], False


def _without_named(files, shape):
    """Files without those that headers of others name; of OME-TIFF files that name each other, the first one stays."""
    named = {os.path.realpath(file): files_of(file, shape)[1:] for file in files if file.is_file()}
    left: dict[str, Path] = {}
    for file in files:
        own = os.path.realpath(file)
        others = [other for other, names in named.items() if own in names]
        if not any(other in left or other not in named.get(own, ()) for other in others):
            left[own] = file
    return list(left.values())


def _is_volume(path):
    name = path.name.lower()
    return not name.startswith(".") and (is_store(path) if path.is_dir() else name.endswith((*FORMATS, ".raw")))


def _outputs(output, names):
    """The pictures: by numbers in place of ####, or in a folder by the volumes' names."""
    if output.lower().endswith(PICTURES):
        if not is_numbered(output):
            raise ValueError(f"{output}: expected a name with #### in place of the number, such as frame-####.png")
        return [numbered(output, number) for number in range(len(names))]
    if output.lower().endswith(_OTHER_FILES) and not os.path.isdir(output):
        raise ValueError(
            f"{output}: expected the name of a folder, or of pictures with #### in place of their number, such as "
            "frame-####.png: --frames makes one picture of each volume"
        )
    stems = [re.sub(r"(\.nii\.gz|\.[^.]*)$", "", name) for name in names]
    doubled = next((stem for stem in stems if stems.count(stem) > 1), None)
    if doubled is not None:
        raise ValueError(f"{output}: expected volumes of different names, got several of {doubled}")
    if not os.path.isdir(os.path.dirname(os.path.abspath(output.rstrip("/")))):
        raise FileNotFoundError(f"{output}: expected an existing folder, or a new one in an existing folder")
    os.makedirs(output, exist_ok=True)
    return [os.path.join(output, f"{stem}.png") for stem in stems]
