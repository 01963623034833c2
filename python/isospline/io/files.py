"""The files that a volume is read from."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from . import dicom, metaimage, nrrd, tiff
from .folders import tiff_slices
from .read import errors_name

# Formats whose headers may name other files with the samples, and the function that lists these.
_HEADERS = {
    nrrd.SUFFIXES: ("NRRD", nrrd.sample_files),
    metaimage.SUFFIXES: ("MetaImage", metaimage.sample_files),
    tiff.SUFFIXES: ("TIFF", tiff.sample_files),
}


def files_of(path: str | os.PathLike[str], shape: Any = None) -> list[str]:
    """The files that `read_volume` and `open_volume` read, with links resolved: a file itself is the first.

    With a `shape`, every file is a raw one, as in `read_volume`. In a folder, these are its slices, or all files of
    a store.
    """
    path = Path(path)
    files: list[Any] = [path]
    if path.is_dir():
        slices = [] if (path / "zarr.json").is_file() else tiff_slices(path) or dicom.slices_of(path)
        files = slices or sorted(file for file in path.rglob("*") if file.is_file())
    elif shape is None:
        for suffixes, (format, sample_files) in _HEADERS.items():
            if path.name.lower().endswith(suffixes):
                with errors_name(path, format):
                    files += sample_files(path)
    return list(dict.fromkeys(map(os.path.realpath, files)))
