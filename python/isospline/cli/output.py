"""Checks that the output of the command line can be written, before the work begins."""

from __future__ import annotations

import os
import re

from ..picture import video

#: Suffixes of the pictures and the videos that can be written.
PICTURES, VIDEOS = (".exr", ".png"), (".mp4",)


def is_video(path):
    """Whether a name is that of a video."""
    return path.lower().endswith(VIDEOS)


def numbered(path, number):
    """The name of a picture of a turntable."""
    return re.sub("#+", lambda hashes: f"{number:0{len(hashes[0])}d}", path)


def check_output(arguments):
    """Check before the work begins that the output can be written."""
    path = arguments.output
    if arguments.turntable is not None:
        if arguments.turntable < 1:
            raise ValueError(f"--turntable: expected at least 1 picture, got {arguments.turntable}")
        has_number = len(re.findall("#+", os.path.basename(path))) == 1 and "#" not in os.path.dirname(path)
        if is_video(path):
            video.check(arguments.size, arguments.fps)
        elif not (has_number and path.lower().endswith(PICTURES)):
            expected = "that of a video, which ends in .mp4, or of pictures, with #### in place of their number"
            raise ValueError(f"{path}: expected {expected}, such as turn-####.png")
    elif not path.lower().endswith(PICTURES):
        videos = " (for a video, say --turntable)" if is_video(path) else ""
        raise ValueError(f"{path}: expected the name of a picture, which ends in {' or '.join(PICTURES)}{videos}")
    if arguments.layers and not path.lower().endswith(".exr"):
        raise ValueError(f"--layers: expected the name of a picture that has layers, which ends in .exr, got {path}")
    traced = {"direct", "variance"} & set(arguments.layers)
    if traced and arguments.light != "path-trace":
        raise ValueError(f"--layers: expected {min(traced)} with --light path-trace only, got {arguments.light}")
    check_folder(path)


def check_folder(path):
    """Check that a file can be written at a path."""
    folder = os.path.dirname(os.path.abspath(path))
    if not os.path.isdir(folder):
        raise FileNotFoundError(f"{path}: expected a folder that exists, got {folder}")
    if os.path.isdir(path):
        raise IsADirectoryError(f"{path}: expected the name of a file, got that of a folder")
    if not os.access(folder, os.W_OK):
        raise PermissionError(f"{path}: expected a folder that can be written to, got {folder}")
