"""NRRD. SimpleITK reads the fields of the header after they are checked; Python and NumPy read the samples.

ITK's reader, which is Teem's, crashes at long lines and words. pynrrd reads neither patterns nor lists of files.
"""

from __future__ import annotations

import math
import os
import re
import tempfile
from typing import Any, NamedTuple

import numpy as np

from . import itk
from .checks import check_file, integer_of, one_unit, utf8
from .confinement import check_within
from .packed import check_skip, read_as, read_samples, read_text

SUFFIXES = (".nrrd", ".nhdr")
_TEXTS = ("ascii", "text", "txt")
_COMPRESSIONS = {"raw": None, "gzip": "gzip", "gz": "gzip", "bzip2": "bzip2", "bz2": "bzip2"}
# Values of the field `space` that name a patient's axes; ITK converts them to LPS.
_PATIENT_SPACES = (
    "right-anterior-superior",
    "left-anterior-superior",
    "left-posterior-superior",
    "ras",
    "las",
    "lps",
)
# The largest sizes in bytes of a field's line, for which Teem has a fixed buffer, and of a header.
LINE_LIMIT, HEADER_LIMIT = 1000, 1 << 20
# The largest dimension of Teem's arrays.
DIMENSION_LIMIT = 16


class Header(NamedTuple):
    """Fields of a header, names of sample files (None if samples follow), the position after it, and user's values."""

    fields: dict[str, Any]
    names: list[str] | None
    begin: int
    values: dict[str, str]


def read(path, load=read_samples, *, within=None, layered=False):
    """Read an NRRD file with attached or detached samples, which must be in the folder `within`, if it is given.

    `load` reads binary samples, like `read_samples`. If `layered`, the first of four axes may be a list of layers; then
    the samples have the shape [z, y, x, layer].
    """
    header, names, begin, _ = read_header(path)
    layers = _take_layers(header) if layered else ()
    files = _placed(path, names)
    for file in files:
        check_within(file, within, "files of samples")
        check_file(file)
    encoding = header["encoding"].lower()
    known = (*_COMPRESSIONS, *_TEXTS, "hex")
    if encoding not in known:
        raise ValueError(f"expected an encoding of {', '.join(known)}, got {encoding}")
    checked = _check_by_itk(header, math.prod(layers), load is not read_samples)

    # All axes of the file are axes of the volume: it was checked that a sample is one number.
    shape = tuple(checked.size[2::-1])
    if math.prod(shape) != math.prod(header["sizes"]):
        raise ValueError(f"expected one number a sample, got sizes of {' x '.join(map(str, header['sizes']))}")
    shape = (*shape, *layers)
    dtype = np.dtype(checked.dtype)
    begin = 0 if names is not None else begin
    if encoding not in _COMPRESSIONS and len(files) > 1:
        raise ValueError(f"expected one file of samples as text, got {len(files)}")
    about: dict[str, Any] = {"unit": one_unit(re.findall(r'"([^"]*)"', header.get("space units", "")))}
    about["patient"] = header.get("space", "").lower() in _PATIENT_SPACES
    if encoding in _TEXTS:
        return checked.to_volume_data(read_text(files[0], begin, shape, dtype)).replace(**about)
    if dtype.itemsize > 1:
        order = header.get("endian", "").lower()
        if order not in ("little", "big"):
            raise ValueError(f"expected endian little or big, got {order or 'none'}")
        dtype = dtype.newbyteorder("<" if order == "little" else ">")
    if encoding == "hex":
        data = read_as("isospline.io.nrrd:load_hex", files[0], begin, shape, dtype)
    else:
        parts = _parts(files, begin, header, math.prod(shape) * dtype.itemsize)
        data = load(parts, shape, dtype, _COMPRESSIONS[encoding])
    return checked.to_volume_data(data).replace(**about)


def sample_files(path):
    """The files with the samples that a header names, or the file itself."""
    return _placed(path, read_header(path).names)


def _placed(path, names):
    """The paths of files that the header of another names; the path itself if it names none."""
    return [path] if names is None else [os.path.join(os.path.dirname(utf8(path)), name) for name in names]


def _check_by_itk(fields, layers, mapped):
    """What ITK reads of a header with these fields alone: Teem refuses long lines of users' values, as of Slicer."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "header.nrrd")
        with open(path, "w", encoding="latin-1") as file:
            file.write("NRRD0005\n")
            for name, value in fields.items():
                text = " ".join(map(str, value)) if isinstance(value, list) else value
                file.write("" if name in ("data file", "line skip", "byte skip") else f"{name}: {text}\n")
            file.write("\n")
        return itk.read_header(path, "NrrdImageIO", layers, mapped)


def _take_layers(fields):
    """Remove a first axis of kind `list`, before three others, from the fields; returns its size as a tuple."""
    if fields["dimension"] != "4" or fields.get("kinds", "").split()[:1] != ["list"]:
        return ()
    fields["dimension"] = "3"
    for name in ("kinds", "space directions", "centers", "centerings", "labels", "units", "spacings", "thicknesses"):
        if name in fields:
            fields[name] = re.sub(r'^\s*("[^"]*"|\S+)\s*', "", fields[name])
    layers, *fields["sizes"] = fields["sizes"]
    return (layers,)


def read_header(path: str | os.PathLike[str]) -> Header:
    """Read and check the header of an NRRD file."""
    fields, values, names, length = {}, {}, None, 0
    with open(path, "rb") as file:
        if not re.fullmatch(rb"NRRD000[1-5]\r?\n", file.readline(16)):
            raise ValueError("expected a file that begins with NRRD0001 to NRRD0005")
        while line := file.readline(HEADER_LIMIT + 1):
            length += len(line)
            text = line.decode("latin-1").strip()
            user = re.fullmatch(r"([^#:][^:]*):=(.*)", text)
            match = re.fullmatch(r"([^#:][^:]*): ?(?!=)(.*)", text)
            if length > HEADER_LIMIT or (match and len(line) > LINE_LIMIT):
                raise ValueError(f"expected a header of at most {HEADER_LIMIT} bytes in lines of at most {LINE_LIMIT}")
            if not text:
                break
            if user:
                values[user[1]] = user[2].encode("latin-1").decode("utf-8", "replace")
            if not match:
                continue  # a comment, or a user's key and value
            name, value = match[1].strip().lower(), match[2].strip()
            name = {"datafile": "data file", "lineskip": "line skip", "byteskip": "byte skip"}.get(name, name)
            if name in fields:
                raise ValueError(f"expected {name} once in the header")
            fields[name] = value
            if name == "data file" and value.split()[:1] == ["LIST"]:
                names = [line.decode("latin-1").strip() for line in file.readlines(HEADER_LIMIT)]
                break
        begin = file.tell()
    _check_fields(fields)
    if "data file" in fields and names is None:
        names = _file_names(fields["data file"])
    if names is not None and not (names and all(names)):
        raise ValueError("expected the names of files of samples, got none")
    return Header(fields, names, begin, values)


def _check_fields(fields):
    for name in ("type", "dimension", "sizes", "encoding"):
        if name not in fields:
            raise ValueError(f"expected the field {name} in the header")
    dimension = integer_of(fields, "dimension")
    words = fields["sizes"].split()
    if not 1 <= dimension <= DIMENSION_LIMIT:
        raise ValueError(f"expected a dimension from 1 to {DIMENSION_LIMIT}, got {dimension}")
    if len(words) != dimension or not all(re.fullmatch(r"\d{1,18}", word) for word in words):
        raise ValueError(f"expected sizes of {dimension} whole numbers, got {fields['sizes']}")
    fields["sizes"] = [int(word) for word in words]


def _file_names(value):
    """One name, or a pattern, the first and the last number, and the step: `slice%03d.raw 1 93 1`."""
    match = re.fullmatch(r"(\S*%0?\d{0,2}d\S*) +(-?\d{1,9}) +(-?\d{1,9}) +(-?\d{1,9})( +\d{1,2})?", value)
    if not match:
        return [value]
    first, last, step = (int(match[group]) for group in (2, 3, 4))
    if match[1].count("%") != 1 or step == 0 or abs(last - first) > 1_000_000:
        raise ValueError(f"expected a pattern with one number as data file, got {value}")
    return [match[1] % number for number in range(first, last + (1 if step > 0 else -1), step)]


def _parts(files, begin, header, size):
    """The files, the positions where their samples begin, and the number of bytes to skip."""
    lines, skipped = integer_of(header, "line skip", 0), integer_of(header, "byte skip", 0)
    if lines < 0 or skipped < -1:
        raise ValueError(f"expected line skip and byte skip of at least 0, got {lines} and {skipped}")
    compressed = _COMPRESSIONS[header["encoding"].lower()] is not None
    if compressed and skipped < 0:
        raise ValueError("expected byte skip of at least 0 for compressed samples, got -1")
    if compressed:
        check_skip(skipped)
    parts = []
    for file in files:
        length = check_file(file)
        with open(file, "rb") as opened:
            opened.seek(begin)
            for _ in range(lines):
                if not opened.readline():
                    break
            at = opened.tell()
        each = size // len(files)
        if skipped > length and not compressed:
            raise ValueError(f"expected a byte skip within the file, got {skipped}")
        if compressed:
            parts.append((file, at, skipped))
        else:
            at = length - each if skipped < 0 else at + skipped
            if at < 0 or length - at < each:
                raise ValueError(
                    f"expected {each} bytes of samples, got {max(length - at, 0)} bytes: the file is truncated"
                )
            parts.append((file, at, 0))
    return parts


# What follows runs in the process of its own.


def load_hex(path, begin, shape, dtype):
    """Samples as pairs of hexadecimal digits, a byte each."""
    dtype = np.dtype(dtype)
    with open(path, "rb") as opened:
        opened.seek(begin)
        words = opened.read().decode("latin-1")
    try:
        content = bytes.fromhex(words)
    except ValueError:
        raise ValueError("expected hexadecimal digits: the file is damaged") from None
    size = math.prod(shape) * dtype.itemsize
    if len(content) != size:
        raise ValueError(f"expected {size} bytes of samples, got {len(content)}: the file is truncated or damaged")
    return np.frombuffer(content, dtype).reshape(shape).astype(dtype.newbyteorder("="), copy=False)
