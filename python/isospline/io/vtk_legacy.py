"""Checks of VTK's legacy files (VTK File Formats, "Simple Legacy Formats") before VTK reads them.

VTK allocates any count in a file before it checks that the data exist, and lengths of cells can lead it out of its
memory.
"""

from __future__ import annotations

import mmap
import os
import re

import numpy as np

_CELLS = rb"(?i:VERTICES|LINES|POLYGONS|TRIANGLE_STRIPS|CELLS)"
_COUNTS = rb"(?i:POINTS|CELL_TYPES|VERTICES|LINES|POLYGONS|TRIANGLE_STRIPS|CELLS|FIELD\s+\S+)"
_TYPES = rb"(?i:bit|(?:unsigned_)?char|(?:unsigned_)?short|(?:unsigned_)?int|(?:unsigned_)?long|float|double|vtkIdType)"
_NUMBER = rb"([+-]?\d+)(?!\S)"
# A count; cells and arrays of fields have a second one.
_COUNT = re.compile(rb"(?<!\S)" + _COUNTS + rb"\s+" + _NUMBER)
_ARRAY = re.compile(rb"(?<!\S)\S+\s+" + _NUMBER + rb"\s+" + _NUMBER + rb"\s+" + _TYPES + rb"(?!\S)")
_CELL_LIST = re.compile(rb"(?<!\S)" + _CELLS + rb"\s+" + _NUMBER + rb"\s+" + _NUMBER + rb"[^\S\n]*\n")
_SCALARS = re.compile(rb"(?<!\S)(?i:SCALARS|COLOR_SCALARS|TEXTURE_COORDINATES)\s+\S+\s+(?:[a-zA-Z_]+\s+)?" + _NUMBER)
_TITLE = re.compile(rb"# (?i:vtk DataFile Version) (\d{1,3})\.\d{1,3}\s*\n")
_OFFSETS = re.compile(rb"\s*(?i:OFFSETS)[^\S\n]+(\S+)[^\S\n]*\n")
_CELL_TYPES = re.compile(rb"(?<!\S)(?i:CELL_TYPES)\s+" + _NUMBER + rb"[^\S\n]*\n")
# The number of VTK's types of cells.
CELL_TYPE_LIMIT = 84
_INTEGERS = {b"int": ">i4", b"vtktypeint32": ">i4", b"vtktypeint64": ">i8"}
# The counts of image data are before this position; samples follow.
HEADER = 1 << 16


def check_counts(path, whole=True):
    """Check that the counts in a file are consistent with its size, and that each cell ends within the list of cells.

    For image data, which may be large, only the beginning of the file is checked.
    """
    size = os.path.getsize(path)
    if size == 0:
        return
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        end = size if whole else min(size, HEADER)
        title = _TITLE.match(content)
        if title is None:
            raise ValueError("expected # vtk DataFile Version in the first line, and the version")
        version = int(title[1])
        for pattern in (_COUNT, _ARRAY, _SCALARS):
            for match in pattern.finditer(content, 0, end):
                _check_counts(match.groups(), size)
        binary = re.search(rb"(?<!\S)(?i:BINARY)(?!\S)", content[:1024]) is not None
        for match in _CELL_LIST.finditer(content, 0, end) if whole else ():
            count, length = (int(group) for group in match.groups())
            _check_counts(match.groups()[1:], size)
            # From version 5 on, cells are two arrays: offsets and indices.
            offsets = _OFFSETS.match(content, match.end())
            if (offsets is not None) != (version >= 5):
                raise ValueError(f"expected cells in the form of version {version} of the format")
            if offsets is None:
                _check_cells(_integers(content, match.end(), length, binary), count)
            else:
                _check_offsets(_integers(content, offsets.end(), count, binary, offsets[1].lower()), length)
        for match in _CELL_TYPES.finditer(content, 0, end) if whole else ():
            types = _integers(content, match.end(), int(match[1]), binary)
            if len(types) and not (types.min() >= 0 and types.max() < CELL_TYPE_LIMIT):
                raise ValueError(f"expected types of cells from 0 to {CELL_TYPE_LIMIT - 1}, got {types.max()}")


def _check_counts(words, size):
    """Check that the file can contain a product of counts; an item has at least one bit."""
    product = 1
    for word in words:
        product *= int(word) if len(word) < 20 else size * 9
    if product < 0 or product > size * 8:
        counts = " x ".join(word.decode() for word in words)
        raise ValueError(f"expected counts that fit into the file, got {counts}: the file is truncated or damaged")


def _integers(content, begin, length, binary, kind=b"int"):
    """The numbers of a list of cells."""
    if binary:
        if kind not in _INTEGERS:
            raise ValueError(f"expected integers of 32 or 64 bits in a list of cells, got {kind.decode('latin-1')}")
        dtype = np.dtype(_INTEGERS[kind])
        part = content[begin : begin + dtype.itemsize * length]
        numbers = np.frombuffer(part[: len(part) // dtype.itemsize * dtype.itemsize], dtype)
    else:
        end = re.compile(rb"[A-Za-z]").search(content, begin)
        words = content[begin : end.start() if end else len(content)].split()[:length]
        if not all(re.fullmatch(rb"[+-]?\d{1,18}", word) for word in words):
            raise ValueError("expected whole numbers in a list of cells")
        numbers = np.array(words, dtype="S20").astype(np.int64)
    if len(numbers) < length:
        raise ValueError(f"expected {length} numbers in a list of cells, got {len(numbers)}: the file is truncated")
    return numbers


def _check_offsets(offsets, length):
    """Check that cell offsets ascend from 0 to the number of indices."""
    # Compare, because differences of arbitrary numbers can overflow.
    if len(offsets) and not (offsets[0] == 0 and offsets[-1] == length and (offsets[1:] >= offsets[:-1]).all()):
        raise ValueError(f"expected offsets of cells that ascend from 0 to {length}, got others")


def _check_cells(numbers, count):
    """Check that `count` cells, each a length followed by that many indices, fill a list of cells."""
    position, values = 0, numbers.tolist()
    for _ in range(count):
        if position >= len(values) or values[position] < 0:
            break
        position += 1 + values[position]
    else:
        if position == len(values):
            return
    raise ValueError(f"expected {count} cells that fill {len(values)} numbers, got others")
