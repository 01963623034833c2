"""DICOM, a series of slices or one file of several frames, read by SimpleITK, which uses GDCM, in its own process."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

import numpy as np

from . import isolated, itk
from .checks import check_file, utf8
from .confinement import check_folder_within
from .dicom_elements import DIRECTORY_CLASS, begins_as_dicom, check_elements
from .volume_data import read_isolated

# Suffixes of files that count as slices, even without the preamble of DICOM.
SUFFIXES = (".dcm", ".dicom", ".ima")
# The largest deviation of a slice from its place in an even series, as a fraction of the distance of slices. Positions
# are stored as decimal text, often rounded to 1/100 mm.
TOLERANCE = 0.02


def read_file(path):
    """Read a single file: an enhanced file with several frames, or one slice."""
    return read_isolated("isospline.io.dicom:load_file", path, "SimpleITK")


def read_folder(path, name=None, *, within=None):
    """Read the only series of a folder, or the one whose Series Instance UID is `name`."""
    check_folder_within(path, within)
    return read_isolated("isospline.io.dicom:load_folder", path, "SimpleITK", name=name)


def find_series(path, name=None):
    """The files of a series of slices, in order, and its spacing, origin and direction; checked, but not read.

    A single file may have several slices and its own frame.
    """
    found = isolated.call("isospline.io.dicom:load_series", path, "SimpleITK", name=name, mapped=True)
    return [Path(file) for file in found["files"]], found["frame"]


def load_file(path):
    """`read_file`, in this process."""
    path = Path(path)
    check_elements(path)
    with itk.quiet():
        reader = itk.open_header(path, "GDCMImageIO")
        itk.check_header(reader)
        return vars(itk.to_volume_data(reader.Execute()).replace(patient=True))


def load_folder(path, name):
    """`read_folder`, in this process."""
    import SimpleITK

    with itk.quiet():
        files, frame = _find_series(Path(path), name)
        if len(files) == 1:
            return load_file(files[0])
        reader = SimpleITK.ImageSeriesReader()
        reader.SetImageIO("GDCMImageIO")
        reader.SetFileNames(files)
        try:
            volume = itk.to_volume_data(reader.Execute())
        except RuntimeError:
            # ITK does not say which file is broken.
            for file in files:
                with errors_name(file):
                    load_file(file)
            raise
    return vars(volume.replace(patient=True, **frame))


def load_series(path, name, mapped):
    """`find_series`, in this process."""
    with itk.quiet():
        files, frame = _find_series(Path(path), name, mapped)
    return {"files": list(files), "frame": frame}


def _find_series(path, name, mapped=False):
    import SimpleITK

    slices = _slices_of(path)
    series = SimpleITK.ImageSeriesReader.GetGDCMSeriesIDs(utf8(path))
    _check_all_found(path, slices, series)
    if not series:
        raise ValueError("expected a folder that holds a DICOM series or TIFF slices, got one without any")
    if name is None and len(series) > 1:
        raise ValueError(f"expected one series, or its UID as name, got {len(series)}: {', '.join(series)}")
    if name is not None and name not in series:
        raise ValueError(f"expected name to be the UID of a series, {', '.join(series)}, got {name}")
    files = SimpleITK.ImageSeriesReader.GetGDCMSeriesFileNames(utf8(path), name or series[0])
    if len(files) == 1:
        return files, {}

    headers = []
    for file in files:
        with errors_name(file):
            headers.append(itk.open_header(file, "GDCMImageIO"))
    itk.check_header(headers[0], slices=len(files), mapped=mapped)
    step = _check_slices(headers)

    # The third axis runs along the slices' positions; with a tilted gantry, this is not their normal.
    first = headers[0]
    distance = float(np.linalg.norm(step))
    direction = np.reshape(first.GetDirection(), (3, 3)).copy()
    direction[:, 2] = step / distance
    spacing = (*first.GetSpacing()[:2], distance)
    return files, {"spacing": spacing, "origin": first.GetOrigin(), "direction": direction}


def may_have_slices(folder):
    """Whether a folder has files that look like DICOM, or some that are no regular files, which the reader refuses."""
    return any(not file.is_file() or _looks_like_a_slice(file) for file in _entries_of(folder))


def _entries_of(folder):
    return [file for file in sorted(folder.iterdir()) if not (file.is_dir() or file.name.startswith("."))]


def _looks_like_a_slice(file):
    return begins_as_dicom(file) or file.suffix.lower() in SUFFIXES


def _slices_of(folder):
    """The DICOM files of a folder, after checking all of them: GDCM would leave out files that it cannot read."""
    slices = []
    for file in _entries_of(folder):
        check_file(file)
        if not _looks_like_a_slice(file):
            continue
        with errors_name(file):
            utf8(file)
            if check_elements(file) != DIRECTORY_CLASS:
                slices.append(file)
    return slices


def _check_all_found(folder, slices, series):
    """Check that GDCM has assigned every slice to a series."""
    import SimpleITK

    found = set()
    for name in series:
        found.update(SimpleITK.ImageSeriesReader.GetGDCMSeriesFileNames(utf8(folder), name))
    found = {os.path.realpath(file) for file in found}
    for file in slices:
        if os.path.realpath(file) not in found:
            raise ValueError(f"expected slices with the UID of their series, got none in {file.name}")


@contextlib.contextmanager
def errors_name(file):
    """Put the name of a broken slice in front of the error message."""
    try:
        yield
    except (ValueError, RuntimeError) as error:
        reason = str(error).strip().splitlines()[-1].strip()
        raise ValueError(f"{os.path.basename(file)}: {reason}") from error


def _check_slices(headers):
    """Check that slices are evenly spaced along a line, and return the vector from one to the next."""
    first = headers[0]
    for header in headers[1:]:
        for what in ("Size", "Spacing", "Direction"):
            expected, got = getattr(first, f"Get{what}")(), getattr(header, f"Get{what}")()
            if what == "Spacing":
                expected, got = expected[:2], got[:2]
            if not np.allclose(expected, got, rtol=1e-4, atol=1e-4):
                raise ValueError(
                    f"expected slices of the same {what.lower()}, got {expected} in {first.GetFileName()} "
                    f"and {got} in {header.GetFileName()}"
                )

    positions = np.array([header.GetOrigin() for header in headers])
    step = (positions[-1] - positions[0]) / (len(positions) - 1)
    even = positions[0] + np.arange(len(positions))[:, None] * step
    off = np.linalg.norm(positions - even, axis=1)
    distance = np.linalg.norm(step)
    if not (off <= TOLERANCE * distance).all() or distance == 0:
        gaps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
        raise ValueError(
            f"expected evenly spaced slices, got distances from {gaps.min():g} to {gaps.max():g} "
            "(slices missing, or a time series?)"
        )
    return step
