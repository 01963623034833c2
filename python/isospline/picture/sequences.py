"""Files of several pictures: a video, numbered pictures, or a folder of them."""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Iterable
from typing import Any

from ..base.parameters import check_path
from . import video

#: Suffixes of the pictures and the videos that can be written.
PICTURES, VIDEOS = (".exr", ".png"), (".gif", ".mp4")
#: The name of pictures in a folder.
_IN_FOLDER = "frame-####.png"


def is_video(path: str) -> bool:
    """Whether a name is that of a video."""
    return path.lower().endswith(VIDEOS)


def is_numbered(path: str) -> bool:
    """Whether a name has one number, as turn-####.png."""
    return len(re.findall("#+", os.path.basename(path))) == 1 and "#" not in os.path.dirname(path)


def numbered(path: str, number: int) -> str:
    """The name of a picture, with its number in place of ####; in a folder, frame-0000.png and so on."""
    if not path.lower().endswith(PICTURES):
        return os.path.join(path, numbered(_IN_FOLDER, number))
    return re.sub("#+", lambda hashes: f"{number:0{len(hashes[0])}d}", path)


def check_sequence(path: Any, count: int, size: tuple[int, int] | None, fps: float = 30.0) -> None:
    """Check, before the work begins, that a number of pictures of a (width, height) can be written to a path."""
    if isinstance(path, str) and not path:
        raise ValueError("path: expected the name of a video or of a folder, got an empty one")
    check_path(path)
    name = os.fspath(path)
    if is_video(name):
        video.check(name, size, fps)
        check_folder(name)
    elif name.lower().endswith(PICTURES):
        if not is_numbered(name):
            raise ValueError(f"path: expected one #### for the number in it, such as turn-####.png, got {name!r}")
        check_folder(name)
        _check_no_more(name, count)
    elif os.path.isdir(name):
        _check_no_more(os.path.join(name, _IN_FOLDER), count)
        if not os.access(name, os.W_OK):
            raise PermissionError(f"{name}: expected a folder that can be written to")
    elif not os.path.splitext(name)[1]:
        check_folder(name.rstrip(os.sep))
    else:
        raise ValueError(
            "path: expected the name of a video, which ends in .mp4 or .gif, of pictures, with #### for their number, "
            f"such as turn-####.png, or of a folder, got {name!r}"
        )


def _check_no_more(path: str, count: int) -> None:
    """Check that there are no pictures that would seem to continue the ones that are written."""
    folder, name = os.path.split(path)
    before, hashes, after = re.split("(#+)", name)
    pattern = rf"{re.escape(before)}(\d{{{len(hashes)},}}){re.escape(after)}"
    pictures = (re.fullmatch(pattern, other, re.ASCII) for other in sorted(os.listdir(folder or os.curdir)))
    beyond = [found[0] for found in pictures if found and int(found[1]) >= count]
    if beyond:
        raise ValueError(
            f"path: expected a folder without pictures after the {count} that are written, got {folder or os.curdir!r} "
            f"with {beyond[0]}: remove them, or choose another folder"
        )


def check_folder(path: str) -> None:
    """Check that a file, or a new folder, can be written at a path."""
    folder = os.path.dirname(os.path.abspath(path))
    if not os.path.isdir(folder):
        raise FileNotFoundError(f"{path}: expected a folder that exists, got {folder}")
    if os.path.isdir(path):
        raise IsADirectoryError(f"{path}: expected the name of a file, got that of a folder")
    if not os.access(folder, os.W_OK):
        raise PermissionError(f"{path}: expected a folder that can be written to, got {folder}")


def write_sequence(
    path: str | os.PathLike[str],
    images: Iterable[Any],
    *,
    fps: float = 30.0,
    quality: float = 7.0,
    numbers: Iterable[int] | None = None,
) -> None:
    """Write images as they are made: as a video, completely or not at all, or as pictures, each completely.

    Parameters
    ----------
    path : str or path-like
        As `check_sequence` accepts it.
    images : iterable of Image, or of objects with the same `size`, `to_srgb` and `write`
        All of one size.
    fps, quality
        As in `write_video`.
    numbers : iterable of int, optional
        Of the pictures; by default from 0 on.
    """
    name = os.fspath(path)
    if is_video(name):
        video.encode(name, images, fps=fps, quality=quality)
        return
    given = itertools.count() if numbers is None else iter(numbers)
    for image in images:
        if not name.lower().endswith(PICTURES):
            os.makedirs(name, exist_ok=True)
        image.write(numbered(name, next(given)))
