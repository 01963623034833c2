"""Writing the pictures and videos of the command line, and errors while an output is written."""

from __future__ import annotations

import contextlib
import errno

from ..picture.sequences import is_video, numbered, write_sequence
from .record import turntable_record

#: Errors of the disk, and not of a wrong name.
DISK_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


@contextlib.contextmanager
def writing():
    """Raise errors of the system while an output is written as failures of the work, not as bad arguments."""
    try:
        yield
    except OSError as error:
        raise RuntimeError(error_text(error)) from error


def write_images(arguments, frames, images):
    """Write the picture, the video, or pictures of these numbers, as the output's name asks; returns a description."""
    output = arguments.output
    with writing():
        if not arguments.turntable:
            for image in images:  # one image; after Ctrl-C, the interrupt is raised again once the image is written
                image.write(output)
            return repr(image)
        if not is_video(output):
            images = _recorded(arguments, frames, images)
        write_sequence(output, images, fps=arguments.fps, numbers=frames)
    return f"{arguments.turntable} pictures of {arguments.size[0]} x {arguments.size[1]}"


def _recorded(arguments, frames, images):
    """The pictures; each is removed from the record before it is written, and added to it afterwards."""
    record, made_of = turntable_record(arguments)
    for frame, image in zip(frames, images):
        path = numbered(arguments.output, frame)
        record.forget(path)
        yield image
        record.add(path, made_of)


def error_text(error):
    """The text of an error in one line."""
    if isinstance(error, OSError) and error.strerror:
        text = f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    else:
        text = str(error)
    return " ".join(text.split())
