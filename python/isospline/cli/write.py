"""Writing the pictures and videos of the command line, and errors while an output is written."""

from __future__ import annotations

import contextlib
import errno

import numpy as np

import isospline

from ..io.dicom_stack import ADVICE
from ..picture.sequences import check_folder, is_video, numbered, write_sequence
from .given import keywords
from .record import Record, record_path

#: Errors of the disk, and not of a wrong name.
DISK_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


@contextlib.contextmanager
def writing():
    """Raise errors of the system while an output is written as failures of the work, not as bad arguments."""
    try:
        yield
    except OSError as error:
        raise RuntimeError(error_text(error)) from error


def check_table(path):
    """Raise ValueError unless a table can be written to a file of this name."""
    if not path.lower().endswith(".csv"):
        raise ValueError(f"{path}: expected the name of a table, which ends in .csv")
    check_folder(path)


def write_measures(arguments, surfaces, progress):
    """Write the table of the volumes and areas of surfaces, one for each level."""
    options = {"tolerance": arguments.tolerance, "order": arguments.order}
    tables = []
    for surface in surfaces:
        with progress(f"level {surface.level:g}", arguments) as report:
            tables.append(isospline.measure(surface, [surface.level], progress=report, **options))
    table = isospline.LevelMeasures({name: np.concatenate([each[name] for each in tables]) for name in tables[0]})
    with writing():
        table.to_csv(arguments.output)
    print(f"{arguments.output}: {len(surfaces)} level{'s' if len(surfaces) > 1 else ''}")


def measured(surface, arguments, progress):
    """The measures of a surface, by their names, and its components."""
    options = {"tolerance": arguments.tolerance, "order": arguments.order}
    with progress("volume and area", arguments) as report:
        table = isospline.measure(surface, [surface.level], progress=report, **options)
    found = {
        "enclosed_volume": isospline.Measurement(table.enclosed_volumes[0], table.volume_errors[0]),
        "area": isospline.Measurement(table.areas[0], table.area_errors[0]),
    }
    for name in ["mean_curvature", "gaussian_curvature"] if surface.volume.degree > 1 else []:
        with progress(name.replace("_", " "), arguments) as report:
            found[name] = getattr(surface, name)(progress=report, **options)
    with progress("components", arguments) as report:
        components = surface.components(measured=True, progress=report, **options)
    if found["area"].value == 0 and found["enclosed_volume"].value == 0:
        raise ValueError(f"level: expected one with a surface, got {surface.level:g}, where nothing is to be measured")
    return found, components


def write_images(arguments, frames, images, made_of=None):
    """Write the picture, the video, or pictures of these numbers, as the output's name asks; returns a description.

    Numbered pictures of a turntable are recorded with what they are made of, as `record.made_of` returns it.
    """
    output = arguments.output
    with writing():
        if not arguments.turntable:
            for image in images:  # one image; after Ctrl-C, the interrupt is raised again once the image is written
                image.write(output)
            return repr(image)
        if not is_video(output):
            images = _recorded(arguments, frames, images, made_of)
        write_sequence(output, images, numbers=frames, **keywords(arguments, ["fps"]))
    return f"{arguments.turntable} pictures of {arguments.size[0]} x {arguments.size[1]}"


def _recorded(arguments, frames, images, made_of):
    """The pictures; each is removed from the record before it is written, and added to it afterwards."""
    record = Record(record_path(arguments.output))
    for frame, image in zip(frames, images):
        path = numbered(arguments.output, frame)
        record.forget(path)
        yield image
        record.add(path, made_of)


def error_text(error):
    """The text of an error in one line, with the advice for the command line."""
    if isinstance(error, OSError) and error.strerror:
        name = "''" if error.filename == "" else error.filename
        text = f"{name}: {error.strerror}" if name else error.strerror
    else:
        text = str(error).replace(ADVICE, "--labels of render and measure reads all of them")
    return " ".join(text.split())
