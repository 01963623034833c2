"""MetaImage. SimpleITK reads the header after it is checked; Python, zlib and NumPy read the samples.

ITK accepts partly inflated samples of damaged files, reads any number of dimensions that a header names, and rounds
samples as text to float64 and then to the type, whether it holds them or not.
"""

from __future__ import annotations

import math
import os
import re

import numpy as np

from ..base.units import PICOMETRES
from . import itk
from .checks import check_file, integer_of, utf8
from .confinement import check_within
from .packed import read_samples, read_text

SUFFIXES = (".mha", ".mhd")
# The longest line of a header in bytes: ITK reads it into a buffer of fixed size.
LINE_LIMIT = 4000
# The largest dimension of ITK's images.
DIMENSION_LIMIT = 10
# The count of numbers after a key, for dimension n. ITK reads this many, even if the line has fewer.
_COUNTS = {
    "DimSize": lambda n: n,
    "ElementSpacing": lambda n: n,
    "ElementSize": lambda n: n,
    "Offset": lambda n: n,
    "Position": lambda n: n,
    "Origin": lambda n: n,
    "CenterOfRotation": lambda n: n,
    "TransformMatrix": lambda n: n * n,
    "Rotation": lambda n: n * n,
    "Orientation": lambda n: n * n,
}


def read(path, load=read_samples, *, within=None):
    """Read a MetaImage file with attached or detached samples, which must be in the folder `within`, if it is given.

    `load` reads binary samples, like `read_samples`.
    """
    header, begin = _read_header(path)
    parts = _parts(path, header, begin)
    for part, _ in parts:
        check_within(part, within, "files of samples")
        check_file(part)
    is_text = not _is_true(header, "BinaryData", default=True)
    about = itk.read_header(path, "MetaImageIO", mapped=load is not read_samples and not is_text)
    dtype = np.dtype(about.dtype)
    if _is_true(header, "BinaryDataByteOrderMSB") or _is_true(header, "ElementByteOrderMSB"):
        dtype = dtype.newbyteorder(">")
    shape = tuple(about.size[2::-1])
    compression = "zlib" if _is_true(header, "CompressedData") else None
    is_of_known_size = not (is_text or compression)
    expected = math.prod(shape) * dtype.itemsize // len(parts) if is_of_known_size else 0
    parts = [(part, _begin(header, part, at, expected)) for part, at in parts]
    if is_text:
        slices, rest = divmod(shape[0], len(parts))
        if rest:
            raise ValueError(f"expected files of whole slices, got {len(parts)} for {shape[0]} slices")
        part_shape, native = (slices, *shape[1:]), dtype.newbyteorder("=")
        data = np.concatenate([read_text(part, at, part_shape, native) for part, at in parts])
    else:
        data = load([(part, at, 0) for part, at in parts], shape, dtype, compression)
    return about.to_volume_data(data).replace(patient=_is_patient(header), unit=_unit(header))


def sample_files(path):
    """The files with the samples that a header names, or the file itself."""
    return [part for part, _ in _parts(path, *_read_header(path))]


def _is_patient(header):
    """Whether the header names anatomical directions of the axes, such as RAI; ??? means none."""
    letters = header.get("AnatomicalOrientation", "").upper()
    return len(letters) == 3 and all(sum(each in letters for each in pair) == 1 for pair in ("RL", "AP", "SI"))


def _unit(header):
    """The unit of lengths; empty if it is ?, none or not known."""
    unit = header.get("DistanceUnits", "")
    return unit if unit in PICOMETRES else ""


def _read_header(path):
    """The lines `Key = Value` of a header, and the position after them; file names follow LIST."""
    header = {}
    with open(path, "rb") as file:
        while "ElementDataFile" not in header:
            line = file.readline(LINE_LIMIT + 1)
            key, equals, value = (part.strip() for part in line.decode("latin-1").partition("="))
            if not (equals and re.fullmatch(r"[^\s:][^:]{0,200}", key)):
                raise ValueError("expected a header of lines 'Key = Value' that ends with ElementDataFile")
            if len(line) > LINE_LIMIT:
                raise ValueError(f"expected lines of at most {LINE_LIMIT} bytes in the header")
            if key in header:
                raise ValueError(f"expected {key} once in the header")
            header[key] = value
        begin = file.tell()
    _check_header(header)
    return header, begin


def _check_header(header):
    for key in ("NDims", "DimSize", "ElementType"):
        if key not in header:
            raise ValueError(f"expected {key} in the header")
    dimension = integer_of(header, "NDims")
    if not 1 <= dimension <= DIMENSION_LIMIT:
        raise ValueError(f"expected NDims from 1 to {DIMENSION_LIMIT}, got {dimension}")
    for key, count in _COUNTS.items():
        words = header.get(key, "0 " * count(dimension)).split()
        try:
            right = len(words) == count(dimension) and np.isfinite(np.array(words, float)).all()
        except ValueError:
            right = False
        if not right:
            raise ValueError(f"expected {key} of {count(dimension)} numbers, got {header[key]}")
    if not all(re.fullmatch(r"\d{1,18}", word) for word in header["DimSize"].split()):
        raise ValueError(f"expected DimSize of whole numbers, got {header['DimSize']}")


def _parts(path, header, begin):
    """The files with the samples, and the positions where these begin."""
    name = header["ElementDataFile"]
    folder = os.path.dirname(utf8(path))
    if name.upper() == "LOCAL":
        return [(path, begin)]
    words = name.split()
    if words[:1] == ["LIST"]:
        with open(path, "rb") as file:
            file.seek(begin)
            names = [line.decode("latin-1").strip() for line in file.readlines(LINE_LIMIT * 1000)]
        names = [name for name in names if name]
    elif "%" in name:
        names = _numbered(words, header)
    else:
        names = [name]
    if not names or not all(names):
        raise ValueError("expected the names of files in ElementDataFile, got none")
    return [(os.path.join(folder, name), 0) for name in names]


def _numbered(words, header):
    """`slice%03d.raw 1 93 1`: names by a pattern, the first and the last number, and the step."""
    numbers = [int(word) for word in words[1:] if re.fullmatch(r"\d{1,9}", word)]
    defaults = [1, int(header["DimSize"].split()[-1]), 1]
    first, last, step = numbers + defaults[len(numbers) :]
    if not re.fullmatch(r"[^%]*%0?\d{0,2}d[^%]*", words[0]) or len(words) > 4 or step < 1 or last - first > 1_000_000:
        raise ValueError(f"expected a pattern with one number in ElementDataFile, got {' '.join(words)}")
    return [words[0] % number for number in range(first, last + 1, step)]


def _begin(header, path, begin, expected):
    """Where samples begin, of which a number of bytes is expected: at HeaderSize from the beginning of the file.

    With -1, they end with the file; compressed ones then begin behind the header, as without it.
    """
    size, skipped = check_file(path), integer_of(header, "HeaderSize", 0)
    if skipped > 0:
        begin = skipped
    elif skipped < 0 and expected > 0:
        begin = size - expected
    got = max(size - begin, 0)
    if got < expected or begin < 0:
        raise ValueError(f"expected {expected} bytes of samples, got {got} bytes: the file is truncated")
    return begin


def _is_true(header, key, default=False):
    return header[key][:1].upper() in ("T", "1") if key in header else default
