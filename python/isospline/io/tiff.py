"""TIFF, a file of several pages or a folder of slices: by tifffile."""

from __future__ import annotations

import contextlib
import logging
import os
import re
import struct
import xml.etree.ElementTree

import numpy as np

from .checks import check_components, check_file, check_samples
from .volume_data import VolumeData

SUFFIXES = (".tif", ".tiff")

# Bytes of an item of a tag, by the type of the tag.
_TAG_SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 10: 8, 11: 4, 12: 8, 13: 4, 16: 8, 17: 8, 18: 8}


def read_file(path):
    """Read a file of several pages.

    Spacing comes from ImageJ's and OME's metadata. The resolution tags of a plain TIFF file are left alone: they say
    nothing of z, and are often a scanner's or a program's default.
    """
    import tifffile

    _check_pages(path)
    with _quiet(), tifffile.TiffFile(path) as file:
        if len(file.series) != 1:
            shapes = ", ".join(str(series.shape) for series in file.series)
            raise ValueError(f"expected pages of one kind, got {len(file.series)}: {shapes}")
        series = file.series[0]
        _check_axes(series)
        check_samples(series.shape, series.dtype)
        return VolumeData(series.asarray(), _spacing(file))


def read_folder(path):
    """Read a folder of files of one page each, in the order of the numbers in their names."""
    import tifffile

    files = slices_of(path)
    data = None
    for index, file_path in enumerate(files):
        check_file(file_path)
        _check_pages(file_path)
        with _quiet(), tifffile.TiffFile(file_path) as file:
            series = file.series[0]
            _check_axes(series)
            if len(series.shape) != 2:
                raise ValueError(f"expected slices of one page each, got shape {series.shape} in {file_path.name}")
            if data is None:
                check_samples((len(files), *series.shape), series.dtype)
                data = np.empty((len(files), *series.shape), series.dtype)
            if (series.shape, series.dtype) != (data.shape[1:], data.dtype):
                raise ValueError(
                    f"expected slices like the first one, {data.shape[1:]} {data.dtype}, "
                    f"got {series.shape} {series.dtype} in {file_path.name}"
                )
            series.asarray(out=data[index])
    return VolumeData(data)


def slices_of(folder):
    """The TIFF files in a folder, slice2 before slice10."""
    files = [file for file in folder.iterdir() if file.suffix.lower() in SUFFIXES and not file.name.startswith(".")]
    return sorted(files, key=lambda file: [int(part) if part.isdigit() else part
                                           for part in re.split(r"(\d+)", file.name.lower())])


def _check_axes(series):
    """Refuse colours and channels; tifffile names the axes by letters."""
    for axis, count in zip(series.axes, series.shape):
        if axis in "SC":
            check_components(count)


def _spacing(file):
    """Spacing by ImageJ's or OME's metadata, in their unit; ones where they do not give all three."""
    if file.is_imagej and "spacing" in file.imagej_metadata:
        tags = file.pages[0].tags
        resolution = [tags[name].value if name in tags else (0, 1) for name in ("XResolution", "YResolution")]
        spacing = [bottom / top if top else 0.0 for top, bottom in resolution]
        spacing.append(abs(float(file.imagej_metadata["spacing"])))
    elif file.is_ome:
        elements = xml.etree.ElementTree.fromstring(file.ome_metadata).iter()
        pixels = next((element for element in elements if element.tag.endswith("}Pixels")), {})
        spacing = [float(pixels.get(f"PhysicalSize{axis}", 0)) for axis in "XYZ"]
        if len({pixels.get(f"PhysicalSize{axis}Unit") for axis in "XYZ"}) > 1:
            raise ValueError("expected physical sizes of one unit along x, y and z, got several")
    else:
        return (1.0, 1.0, 1.0)
    return tuple(spacing) if min(spacing) > 0 else (1.0, 1.0, 1.0)


def _check_pages(path):
    """Follow the list of pages to its end: tifffile takes the pages that it finds, however many are missing."""
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
                raise ValueError("expected a list of pages, got one that runs in a circle")
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
    """Without tifffile's log, which Python prints where nobody set up logging."""
    logger = logging.getLogger("tifffile")
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        logger.setLevel(level)
