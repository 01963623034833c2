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

from ..base.parameters import printable
from . import isolated
from .checks import check_components, check_file, check_samples, errors_name_slice
from .confinement import check_within
from .tiff_metadata import calibrated, calibration_of, is_transposed, is_upright, place_of, upright
from .volume_data import VolumeData, read_isolated

SUFFIXES = (".tif", ".tiff")
#: The packages that are needed, imported once by the server of processes.
LIBRARIES = "tifffile imagecodecs"

# tifffile's letters for the axes of a volume; I and Q are pages of which the file tells no more.
_SPACE = "XYZIQ"

# Bytes of an item of a tag, by the type of the tag.
_TAG_SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 10: 8, 11: 4, 12: 8, 13: 4, 16: 8, 17: 8, 18: 8}


def read_file(path, *, within=None):
    """Read a file of several pages.

    Spacing comes from ImageJ's and OME's metadata. The resolution tags of a plain TIFF file are not used: they do not
    include z, and are often a default of a scanner or a program. If they are not, a warning tells them.
    """
    return read_isolated(
        "isospline.io.tiff:load_file", path, LIBRARIES, readable=isolated.referenced(within), within=_text(within)
    )


def read_folder(path, *, within=None):
    """Read a folder of files of one page each, sorted by the numbers in their names; spacing as in `read_file`."""
    return read_isolated("isospline.io.tiff:load_folder", path, LIBRARIES, within=_text(within))


def sample_files(path):
    """The further files of samples that OME's metadata of a file name, and that exist."""
    found = isolated.call("isospline.io.tiff:load_names", path, LIBRARIES)["names"]
    return [file for name in found if (file := path.parent / name).is_file()]


def find_slices(path):
    """The slices of a folder, checked, but not read: a dict of `files`, `shape` and `dtype` of each, and `place`."""
    return isolated.call("isospline.io.tiff:load_slices", path, LIBRARIES)


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
        return vars(VolumeData(_values_of(series, file))) | place_of(file)


def load_layout(path):
    """`read_layout`, in this process."""
    with _opened_series(Path(path)) as (file, series):
        calibration = calibration_of(file)
        return {
            "shape": _shape_of(series, file),
            "dtype": calibrated(np.zeros(1, series.dtype), calibration).dtype.str,
            "stored": series.dtype.newbyteorder(file.byteorder).str,
            "place": place_of(file),
            "begin": series.dataoffset if calibration is None and is_upright(file) else None,
            "pages": len(series.pages),
        }


def load_names(path):
    """The names of `sample_files`, in this process."""
    _be_quiet()
    return {"names": sorted(_names_in(Path(path)))}


def load_pages(path, first, last):
    """`read_pages`, in this process."""
    with _opened_series(Path(path)) as (file, series):
        pages = []
        for number in range(first, last):
            try:
                pages.append(_values_of(series.pages[number], file))
            except Exception as error:
                raise ValueError(f"page {number}: {error}") from error
        return pages


def _values_of(pages, file):
    """The values of a series, or of a page: upright and calibrated."""
    return upright(calibrated(pages.asarray(), calibration_of(file)), file)


def _shape_of(series, file):
    """The shape of its values."""
    *others, height, width = series.shape
    return (*others, width, height) if is_transposed(file) else series.shape


@contextlib.contextmanager
def _opened_series(path, within=None):
    """A tifffile file and its only series of pages, after checks."""
    with contextlib.ExitStack() as stack:
        file = stack.enter_context(_opened(path, within))
        if file.is_shaped and len(file.series) > 1 and all(len(series.pages) == 1 for series in file.series):
            # Pages that tifffile has written one by one have a description each, which makes a series of each.
            file = stack.enter_context(_opened(path, within, is_shaped=False))
        if len(file.series) != 1:
            kinds = ", ".join(f"{series.shape} {series.dtype}" for series in file.series)
            raise ValueError(f"expected one series of pages of one kind, got {len(file.series)}: {kinds}")
        series = file.series[0]
        _check_axes(series)
        yield file, series


@contextlib.contextmanager
def _opened(path, within, **flags):
    """A tifffile file. If it is confined to a folder, only the files that OME's metadata name may belong to it."""
    import tifffile

    _check_pages(path)
    _be_quiet()
    is_of_several = within is None or _names_files(path, within)
    with tifffile.TiffFile(path, _multifile=is_of_several, **flags) as file:
        yield file


def _names_in(path):
    """The names of further files in OME's metadata."""
    import tifffile

    with tifffile.TiffFile(path, _multifile=False) as file:
        if not file.is_ome or getattr(file, "is_mmstack", False) or getattr(file, "is_ndtiff", False):
            return set()
        elements = list(xml.etree.ElementTree.fromstring(file.ome_metadata or "").iter())
    return {element.get(key) for element in elements for key in ("FileName", "MetadataFile")} - {None, path.name}


def _names_files(path, within):
    """Whether OME's metadata name further files, after checking that these are in a folder."""
    names = _names_in(path)
    for name in names:
        check_within(path.parent / name, within)
    return bool(names)


def load_folder(path, within):
    """`read_folder`, in this process."""
    files = slices_of(Path(path))
    for file in files:
        check_within(file, within)
    slices = []
    data: NDArray[Any] = np.empty(0)
    for index, path in enumerate(files):
        with _opened_slice(path, within) as (file, series):
            slices.append(_header_of(series, file))
            _check_like(slices[0], slices[-1])
            if index == 0:
                check_samples((len(files), *slices[0]["shape"]), slices[0]["dtype"])
                data = np.empty((len(files), *slices[0]["shape"]), slices[0]["dtype"])
            data[index] = _values_of(series, file)
    return vars(VolumeData(data)) | _place_of_slices(files, slices)


def load_slices(path):
    """`find_slices`, in this process."""
    files, slices = slices_of(Path(path)), []
    for path in files:
        with _opened_slice(path) as (file, series):
            slices.append(_header_of(series, file))
            _check_like(slices[0], slices[-1])
    return {"files": list(map(str, files)), **slices[0], "place": _place_of_slices(files, slices)}


def load_slice(path):
    """`read_slice`, in this process."""
    with _opened_slice(Path(path)) as (file, series):
        return _values_of(series, file)


@contextlib.contextmanager
def _opened_slice(path, within=None):
    """A tifffile file and its only page, after checks; errors name the file."""
    check_file(path)
    with errors_name_slice(path), _opened(path, within) as file:
        series = file.series[0]
        _check_axes(series)
        if len(series.shape) != 2:
            raise ValueError(f"expected slices of one page each, got shape {series.shape}")
        check_samples((1, *series.shape), series.dtype)
        yield file, series


def _header_of(series, file):
    """Shape, type and place of a slice."""
    dtype = calibrated(np.zeros(1, series.dtype), calibration_of(file)).dtype
    return {"shape": _shape_of(series, file), "dtype": dtype.str, "place": place_of(file)}


def _check_like(first, other):
    """Check that a slice is like the first one."""
    kinds = [f"{each['shape']} {np.dtype(each['dtype'])}" for each in (first, other)]
    if kinds[0] != kinds[1]:
        raise ValueError(f"expected slices like the first one, {kinds[0]}, got {kinds[1]}")
    spacing, own = (each["place"].get("spacing", (1.0, 1.0, 1.0)) for each in (first, other))
    unit, own_unit = (each["place"].get("unit", "") for each in (first, other))
    if unit != own_unit or not np.allclose(spacing, own, rtol=1e-4, atol=0):
        raise ValueError(
            f"expected slices with the spacing of the first one, {spacing} {unit or '(no unit)'}, "
            f"got {own} {own_unit or '(no unit)'}"
        )


def _place_of_slices(files, slices):
    """The place of the first slice, and a ``warning`` of gaps."""
    return slices[0]["place"] | {"warning": _told_of_gaps(files)}


def _told_of_gaps(files):
    """What is uneven in the numbers of files whose names differ by one number; empty for none."""
    names = [words_of(file.stem) for file in files]
    if len({len(name) for name in names}) > 1:
        return ""
    columns = [column for column in zip(*names) if len(set(column)) > 1]
    if len(columns) != 1 or isinstance(columns[0][0], str):
        return ""
    steps = [after - before for before, after in zip(columns[0], columns[0][1:])]
    usual = sorted(steps)[len(steps) // 2]
    gaps = [number for number, step in enumerate(steps) if step != usual]
    if not gaps:
        return ""
    more = f", and {len(gaps) - 1} more such gaps" if len(gaps) > 1 else ""
    before, after = (printable(files[gaps[0] + number].name) for number in (0, 1))
    return f"{after} follows {before}{more}: are slices missing?"


def slices_of(folder):
    """The TIFF files in a folder, slice2 before slice10."""
    files = [file for file in folder.iterdir() if file.suffix.lower() in SUFFIXES and not file.name.startswith(".")]
    return sorted(files, key=lambda file: words_of(file.name))


def words_of(name):
    """The words of a name and the numbers between them, for the natural order of names."""
    return [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", name.lower())]


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


def _be_quiet():
    """Suppress tifffile's log, which Python prints if logging is not configured."""
    logging.getLogger("tifffile").setLevel(logging.CRITICAL + 1)
