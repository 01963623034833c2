"""Writing the pictures and videos of the command line."""

from __future__ import annotations

import isospline

from .output import is_video, numbered
from .record import turntable_record


def write_images(arguments, frames, images):
    """Write the picture, pictures of these numbers or the video, as the output's name asks; returns a description."""
    output = arguments.output
    try:
        if not arguments.turntable:
            for image in images:  # one image; after Ctrl-C, the interrupt is raised again once the image is written
                image.write(output)
            return repr(image)
        if is_video(output):
            isospline.write_video(output, images, fps=arguments.fps)
        else:
            record, made_of = turntable_record(arguments)
            for frame, image in zip(frames, images):
                path = numbered(output, frame)
                record.forget(path)
                image.write(path)
                record.add(path, made_of)
    except OSError as error:
        raise RuntimeError(error_text(error)) from error
    return f"{arguments.turntable} pictures of {arguments.size[0]} x {arguments.size[1]}"


def error_text(error):
    """The text of an error in one line."""
    if isinstance(error, OSError) and error.strerror:
        text = f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    else:
        text = str(error)
    return " ".join(text.split())
