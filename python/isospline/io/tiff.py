"""TIFF, a file of several pages or a folder of slices, read by tifffile in a process of its own."""

from __future__ import annotations

import contextlib
import logging
import os
import re
import struct
import xml.etree.ElementTree
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import isolated
from .checks import check_components, check_file, check_samples
from .confinement import check_within
from .volume_data import VolumeData, read_isolated

SUFFIXES = (".tif", ".tiff")
#: The packages that are needed, imported once by the server of processes.
LIBRARIES = "tifffile imagecodecs"

# Names of units in ImageJ, and units of length in metres.
_UNITS = {"micron": "µm", "microns": "µm", "um": "µm", "\\u00B5m": "µm", "pixel": "", "pixels": ""}
_LENGTHS = {"nm": 1e-9, "µm": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "inch": 0.0254}
# The numbers of coefficients of ImageJ's calibration functions of samples that are polynomials, by their codes (its
# class Calibration), and the code of none.
_POLYNOMIALS, _UNCALIBRATED = {0: 2, 1: 3, 2: 4, 3: 5}, 20

# tifffile's letters for the axes of a volume; I and Q are pages of which the file tells no more.
_SPACE = "XYZIQ"

# Bytes of an item of a tag, by the type of the tag.
_TAG_SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 10: 8, 11: 4, 12: 8, 13: 4, 16: 8, 17: 8, 18: 8}


def read_file(path, *, within=None):
    """Read a file of several pages.

    Spacing comes from ImageJ's and OME's metadata. The resolution tags of a plain TIFF file are ignored: they do not
    include z, and are often a default of a scanner or a program.
    """
    return read_isolated(
        "isospline.io.tiff:load_file", path, LIBRARIES, readable=isolated.referenced(within), within=_text(within)
    )


def read_folder(path, *, within=None):
    """Read a folder of files of one page each, in the order of the numbers in their names."""
    return read_isolated("isospline.io.tiff:load_folder", path, LIBRARIES, within=_text(within))


def read_slice(path):
    """Read a file of one page, [y, x]."""
    return isolated.call("isospline.io.tiff:load_slice", path, LIBRARIES)


def read_layout(path):
    """Where the samples of a file are: a dict of `shape`, `dtype`, `stored`, `place`, `begin` (or None), `pages`."""
    return isolated.call("isospline.io.tiff:load_layout", path, LIBRARIES, readable=isolated.referenced(None))


def read_pages(path, first, last):
    """The samples of pages of a file, from `first` up to `last`, exclusive."""
    readable = isolated.referenced(None)
    return isolated.call("isospline.io.tiff:load_pages", path, LIBRARIES, readable=readable, first=first, last=last)


# What follows runs in the process of its own.


def load_file(path, within=None):
    """`read_file`, in this process."""
    with _opened_series(Path(path), within) as (file, series):
        check_samples(series.shape, series.dtype)
        samples = _calibrated(series.asarray(), _calibration_of(file))
        return vars(VolumeData(samples)) | place_of(file)  # and its warning, if it has one


def load_layout(path):
    """`read_layout`, in this process."""
    with _opened_series(Path(path)) as (file, series):
        calibration = _calibration_of(file)
        return {
            "shape": series.shape,
            "dtype": _calibrated(np.zeros(1, series.dtype), calibration).dtype.str,
            "stored": series.dtype.newbyteorder(file.byteorder).str,
            "place": place_of(file),
            "begin": series.dataoffset if calibration is None else None,
            "pages": len(series.pages),
        }


def load_pages(path, first, last):
    """`read_pages`, in this process."""
    with _opened_series(Path(path)) as (file, series):
        pages, calibration = [], _calibration_of(file)
        for number in range(first, last):
            try:
                pages.append(_calibrated(series.pages[number].asarray(), calibration))
            except Exception as error:
                raise ValueError(f"page {number}: {error}") from error
        return pages


@contextlib.contextmanager
def _opened_series(path, within=None):
    """A tifffile file and its only series of pages, after checks."""
    with _opened(path, within) as file:
        if len(file.series) != 1:
            shapes = ", ".join(str(series.shape) for series in file.series)
            raise ValueError(f"expected pages of one kind, got {len(file.series)}: {shapes}")
        series = file.series[0]
        _check_axes(series)
        yield file, series


@contextlib.contextmanager
def _opened(path, within):
    """A tifffile file. If it is confined to a folder, only the files that OME's metadata name may belong to it."""
    import tifffile

    _check_pages(path)
    with _quiet():
        is_of_several = within is None or _names_files(path, within)
        with tifffile.TiffFile(path, _multifile=is_of_several) as file:
            yield file


def _names_files(path, within):
    """Whether OME's metadata name further files, after checking that these are in a folder."""
    import tifffile

    with tifffile.TiffFile(path, _multifile=False) as file:
        if not file.is_ome or getattr(file, "is_mmstack", False) or getattr(file, "is_ndtiff", False):
            return False
        elements = list(xml.etree.ElementTree.fromstring(file.ome_metadata or "").iter())
    names = {element.get(key) for element in elements for key in ("FileName", "MetadataFile")} - {None, path.name}
    for name in names:
        check_within(path.parent / name, within)
    return bool(names)


def load_folder(path, within):
    """`read_folder`, in this process."""
    files = slices_of(Path(path))
    for file in files:
        check_within(file, within)
    data: NDArray[Any] = np.empty(0)
    for index, file in enumerate(files):
        samples = load_slice(file, within)
        if index == 0:
            check_samples((len(files), *samples.shape), samples.dtype)
            data = np.empty((len(files), *samples.shape), samples.dtype)
        if (samples.shape, samples.dtype) != (data.shape[1:], data.dtype):
            raise ValueError(
                f"expected slices like the first one, {data.shape[1:]} {data.dtype}, "
                f"got {samples.shape} {samples.dtype} in {file.name}"
            )
        data[index] = samples
    return vars(VolumeData(data))


def load_slice(path, within=None):
    """`read_slice`, in this process."""
    path = Path(path)
    check_file(path)
    with _opened(path, within) as file:
        series = file.series[0]
        _check_axes(series)
        if len(series.shape) != 2:
            raise ValueError(f"expected slices of one page each, got shape {series.shape} in {path.name}")
        check_samples((1, *series.shape), series.dtype)
        return _calibrated(series.asarray(), _calibration_of(file))


def slices_of(folder):
    """The TIFF files in a folder, slice2 before slice10."""
    files = [file for file in folder.iterdir() if file.suffix.lower() in SUFFIXES and not file.name.startswith(".")]
    return sorted(
        files,
        key=lambda file: [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", file.name.lower())],
    )


def _text(path):
    return None if path is None else os.path.abspath(path)


def _check_axes(series):
    """Refuse colours, channels, time steps and others; tifffile has a letter for each axis."""
    for axis, count in zip(series.axes, series.shape):
        if axis in "SC":
            check_components(count)
        elif axis not in _SPACE and count != 1:
            times = " (a time series)" if axis == "T" else ""
            raise ValueError(f"expected one item along axis {axis}, got {count}{times}")


def place_of(file):
    """Spacing and unit from ImageJ's or OME's metadata; ones without a unit if these do not calibrate x and y.

    A missing spacing along z is 1 in ImageJ, which does not write it then (ij/io/FileSaver.java). OME leaves it open:
    then there is a ``warning``, too.
    """
    warning: dict[str, str] = {}
    if file.is_imagej:
        metadata, tags = file.imagej_metadata, file.pages[0].tags
        names = [str(metadata.get(name, metadata.get("unit", ""))) for name in ("unit", "yunit", "zunit")]
        # Pixels per inch without a spacing are a printer's resolution, which ImageJ takes from any TIFF file.
        if "spacing" not in metadata and _UNITS.get(names[0], names[0]) in ("", "inch"):
            return {}
        resolution = [tags[name].value if name in tags else (0, 1) for name in ("XResolution", "YResolution")]
        spacing = [bottom / top if top else 0.0 for top, bottom in resolution]
        spacing.append(abs(float(metadata.get("spacing", 1))))
    elif file.is_ome:
        elements = xml.etree.ElementTree.fromstring(file.ome_metadata).iter()
        pixels: Any = next((element for element in elements if element.tag.endswith("}Pixels")), {})
        spacing = [float(pixels.get(f"PhysicalSize{axis}", 0)) for axis in "XYZ"]
        names = [pixels.get(f"PhysicalSize{axis}Unit", "µm") for axis in "XYZ"]
        if min(spacing[:2]) > 0 and spacing[2] == 0:
            spacing[2], names[2] = 1.0, names[0]
            warning = {"warning": f"the file has no spacing along z: 1 {names[0]} is assumed; say spacing=(x, y, z)"}
    else:
        return {}
    if not min(spacing) > 0:
        return {}
    units = [_UNITS.get(name, name) for name in names]
    if len(set(units)) > 1:
        if not set(units) <= set(_LENGTHS):
            raise ValueError(f"expected units of length along x, y and z, got {', '.join(names)}")
        spacing = [value * _LENGTHS[unit] / _LENGTHS[units[0]] for value, unit in zip(spacing, units)]
        spacing = [float(f"{value:.12g}") for value in spacing]  # without the rounding of the factors
    return {"spacing": tuple(spacing), "unit": units[0], **warning}


def _calibration_of(file):
    """The coefficients of ImageJ's polynomial from stored samples to values, or None."""
    metadata = file.imagej_metadata if file.is_imagej else {}
    function = int(metadata.get("cf", _UNCALIBRATED))
    if function == _UNCALIBRATED:
        return None
    if function not in _POLYNOMIALS:
        raise ValueError(f"expected samples that are calibrated by a polynomial, got ImageJ's function {function}")
    coefficients = [float(metadata.get(f"c{power}", 0)) for power in range(_POLYNOMIALS[function])]
    if not np.isfinite(coefficients).all():
        raise ValueError(f"expected finite coefficients of the calibration of samples, got {coefficients}")
    return None if coefficients == [0, 1] else coefficients


def _calibrated(samples, coefficients):
    """The values of stored samples: integers if these are only moved, and real numbers otherwise."""
    if coefficients is None:
        return samples
    move, *others = coefficients
    if samples.dtype.kind in "iu" and others == [1] and move.is_integer() and abs(move) < 2**31:
        limits = np.iinfo(samples.dtype)
        kinds = (kind for kind in (np.int8, np.int16, np.int32, np.int64) if np.iinfo(kind).min <= limits.min + move)
        kind = next(kind for kind in kinds if limits.max + move <= np.iinfo(kind).max)
        return (samples.astype(np.int64) + int(move)).astype(kind)
    values = np.polynomial.polynomial.polyval(samples.astype(np.float64), coefficients)
    return values.astype(np.float32 if samples.dtype.itemsize <= 2 else np.float64)


def _check_pages(path):
    """Follow the list of pages to its end: tifffile ignores missing pages."""
    size = os.path.getsize(path)
    with open(path, "rb") as file:

        def unpack(at, format):
            file.seek(at)
            content = file.read(struct.calcsize(order + format))
            if len(content) < struct.calcsize(order + format):
                raise ValueError("expected a list of pages that ends within the file: the file is truncated")
            return struct.unpack(order + format, content)

        order = {b"II": "<", b"MM": ">"}.get(file.read(2))
        if order is None:
            raise ValueError("expected the signature of a TIFF file")
        big = unpack(2, "H") == (43,)
        count_format, tag_format, offset_format, at = ("Q", "HHQQ", "Q", 8) if big else ("H", "HHII", "I", 4)

        pages = set()
        step = struct.calcsize(order + tag_format)
        while page := unpack(at, offset_format)[0]:
            if page in pages:
                raise ValueError("expected a list of pages, got a circular one")
            pages.add(page)
            (count,) = unpack(page, count_format)
            begin = page + struct.calcsize(count_format)
            if count * step > size - begin:
                raise ValueError(f"expected {count} tags within the file: the file is truncated")
            tags = unpack(begin, tag_format * count)
            for kind, items, value in zip(tags[1::4], tags[2::4], tags[3::4]):
                length = _TAG_SIZES.get(kind, 0) * items
                if length > struct.calcsize(offset_format) and value + length > size:
                    raise ValueError("expected tags that end within the file: the file is truncated")
            at = begin + step * count


@contextlib.contextmanager
def _quiet():
    """Suppress tifffile's log, which Python prints if logging is not configured."""
    logger = logging.getLogger("tifffile")
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        logger.setLevel(level)
