"""DICOM, a series of slices or one file of several frames, read by pydicom in its own process."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from . import isolated
from .checks import check_file, check_samples, errors_name_slice
from .confinement import check_folder_within
from .dicom_frames import frames_of, is_directory, read_dataset
from .dicom_pixels import read_samples
from .dicom_segments import load_mask
from .dicom_stack import arrange, samples_type
from .told import warn_of_place
from .volume_data import VolumeData, read_isolated, volume_of

# Suffixes of files that count as slices, even without the preamble of DICOM.
SUFFIXES = (".dcm", ".dicom", ".ima")
_LIBRARY = "pydicom.pixels"


class Slices(NamedTuple):
    """A file for each slice, in order; the shape and type of the samples of each, and the place of the volume."""

    files: list[Path]
    shape: tuple[int, int]
    dtype: np.dtype[Any]
    frame: dict[str, Any]


def read_file(path):
    """Read a single file: one with several frames, or one slice."""
    return read_isolated("isospline.io.dicom:load_file", path, _LIBRARY)


def read_folder(path, name=None, *, within=None):
    """Read the only series of a folder, or the one whose Series Instance UID is `name`."""
    check_folder_within(path, within)
    return read_isolated("isospline.io.dicom:load_folder", path, _LIBRARY, name=name)


def read_segmentation(path):
    """The label map of a DICOM segmentation, [z, y, x] or [z, y, x, layer], and what it tells of its segments.

    These are dicts of `number`, `name`, `color` (CIELab, or None) and `layer`. None for other files.
    """
    fields = isolated.call("isospline.io.dicom_segments:load_segmentation", path, _LIBRARY)
    segments = fields.pop("segments", None)
    return None if segments is None else (volume_of(fields, path), segments)


def has_segments(path):
    """Whether a file is a DICOM segmentation."""
    return isolated.call("isospline.io.dicom_segments:load_count", path, _LIBRARY)["segments"] > 0


def find_slices(path, name=None):
    """The `Slices` of a series, checked, but not read; None if a file has several, or all."""
    found = isolated.call("isospline.io.dicom:load_slices", path, _LIBRARY, name=name)
    if found is None:
        return None
    warn_of_place(Path(path), found)
    files = [Path(file) for file in found["files"]]
    return Slices(files, tuple(found["shape"]), np.dtype(found["dtype"]), found["frame"])


def find_series(path):
    """The names of the files of each series in a folder."""
    return isolated.call("isospline.io.dicom:load_series", path, _LIBRARY)["series"]


def read_slice(path, dtype):
    """The samples [y, x] of a file with one slice, as a type that `find_slices` gives."""
    return isolated.call("isospline.io.dicom:load_slice", path, _LIBRARY, dtype=np.dtype(dtype).str)["data"]


def load_file(path):
    """`read_file`, in this process."""
    dataset = read_dataset(path, stop_before_pixels=True)
    return _load(frames_of(path, dataset))


def load_folder(path, name):
    """`read_folder`, in this process."""
    return _load(_frames_of_series(Path(path), name))


def load_slices(path, name):
    """`find_slices`, in this process."""
    frames, place, told = arrange(_frames_of_series(Path(path), name))
    dtype, shape = samples_type(frames), frames[0].size[::-1]
    check_samples((len(frames), *shape), dtype, mapped=True)
    if len(frames) == 1 or any(frame.count > 1 for frame in frames):
        return None
    return {"files": [frame.file for frame in frames], "shape": shape, "dtype": dtype.str, "frame": place, **told}


def load_series(path):
    """`find_series`, in this process."""
    series = _series_of(Path(path)).values()
    return {"series": [list(dict.fromkeys(Path(frame.file).name for frame in frames)) for frames in series]}


def load_slice(path, dtype):
    """`read_slice`, in this process."""
    dataset = read_dataset(path, stop_before_pixels=True)
    frames = frames_of(path, dataset)
    if len(frames) != 1:
        raise ValueError(f"expected one slice, got {len(frames)}")
    return {"data": read_samples(frames, np.dtype(dtype))[0]}


def _load(frames):
    if all(frame.segment_number for frame in frames):
        return load_mask(frames)
    frames, place, told = arrange(frames)
    samples = read_samples(frames, samples_type(frames))
    return vars(VolumeData(samples, **place, unit="mm")) | told


def _series_of(folder):
    """The frames of a folder by the UID of their series, in the order of files."""
    series: dict[str, list[Any]] = {}
    for file in _entries_of(folder):
        check_file(file)
        if not _looks_like_a_slice(file):
            continue
        with errors_name_slice(file):
            dataset = read_dataset(file, stop_before_pixels=True)
            if is_directory(dataset):
                continue
            frames = frames_of(file, dataset)
        if not frames[0].series:
            raise ValueError(f"expected slices with the UID of their series, got none in {file.name}")
        series.setdefault(frames[0].series, []).extend(frames)
    return series


def _frames_of_series(folder, name):
    """The frames of the only series of a folder, or of that with this name, in the order of files."""
    series = _series_of(folder)
    if not series:
        raise ValueError("expected a folder that holds a DICOM series or TIFF slices, got one without any")
    if name is None and len(series) > 1:
        counts = {uid: len(frames) for uid, frames in sorted(series.items())}
        found = ", ".join(f"{uid} ({count} image{'s' if count > 1 else ''})" for uid, count in counts.items())
        raise ValueError(f"expected one series, or its UID as name, got {len(series)}: {found}")
    if name is not None and name not in series:
        raise ValueError(f"expected name to be the UID of a series, {', '.join(sorted(series))}, got {name}")
    return series[name or next(iter(series))]


def begins_as_dicom(path):
    """Whether a file has the preamble of DICOM files, or ends inside it."""
    with open(path, "rb") as file:
        beginning = file.read(132)
    return beginning[128:] == b"DICM" or (len(beginning) < 132 and not beginning[:128].strip(b"\0"))


def slices_of(folder):
    """The files in a folder that look like DICOM."""
    return [file for file in _entries_of(folder) if file.is_file() and _looks_like_a_slice(file)]


def may_have_slices(folder):
    """Whether a folder has files that look like DICOM, or some that are no regular files, which the reader refuses."""
    return any(not file.is_file() or _looks_like_a_slice(file) for file in _entries_of(folder))


def _entries_of(folder):
    return [file for file in sorted(folder.iterdir()) if not (file.is_dir() or file.name.startswith("."))]


def _looks_like_a_slice(file):
    if file.stat().st_size == 0:  # a slice that could not be written, unless its name tells otherwise, as LOCKFILE
        return file.suffix.lower() in SUFFIXES or file.name[-1].isdigit()
    return begins_as_dicom(file) or file.suffix.lower() in SUFFIXES
