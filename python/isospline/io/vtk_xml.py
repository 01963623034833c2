"""Checks of VTK's XML files before VTK reads them: VTK allocates any count in a file before it checks the data."""

from __future__ import annotations

import base64
import binascii
import mmap
import os
import re

import numpy as np

# The largest number of bytes that deflate can make from one byte.
MOST_INFLATED = 1100
# Bytes of the block header at the beginning of an array.
HEADER_LIMIT = 1 << 16
_COUNT = re.compile(rb"""\b(NumberOf\w+)\s*=\s*["']\s*([^"']*)["']""")
_EXTENT = re.compile(rb"""\b(Whole)?Extent\s*=\s*["']([^"']*)["']""")
_ARRAY = re.compile(rb"<(?:DataArray|Array)\b([^>]*[^/>])>")
_APPENDED = re.compile(rb"<AppendedData\b([^>]*)>\s*_")


def check_vtk_xml(path):
    """Check that a file is complete, and that its counts are consistent with its size."""
    size = os.path.getsize(path)
    with open(path, "rb") as file:
        file.seek(-min(size, 256), os.SEEK_END)
        if b"</VTKFile>" not in file.read():
            raise ValueError("expected </VTKFile> at the end: the file is truncated, or not a VTK file")
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            appended = _APPENDED.search(content)
            end = appended.start() if appended else size
            for match in _COUNT.finditer(content, 0, end):
                if re.fullmatch(rb"\d{1,18}\s*", match[2]) is None or int(match[2]) > size * MOST_INFLATED:
                    what = f"{match[1].decode()} that fits into the file"
                    raise ValueError(f"expected {what}, got {match[2].decode('latin-1')[:30]}")
            _check_extents(content, end)
            _check_arrays(content, end, appended, size)


def _check_extents(content, end):
    """Check that the pieces of a grid are inside the whole extent."""
    whole = None
    for match in _EXTENT.finditer(content, 0, end):
        words = match[2].split()
        if len(words) != 6 or not all(re.fullmatch(rb"[+-]?\d{1,9}", word) for word in words):
            raise ValueError(f"expected an extent of six whole numbers, got {match[2].decode('latin-1')[:60]}")
        numbers = [int(word) for word in words]
        if match[1]:
            whole = numbers
        elif whole and not all(whole[i] <= numbers[i] and numbers[i + 1] <= whole[i + 1] for i in (0, 2, 4)):
            raise ValueError(f"expected pieces within the extent {whole}, got {numbers}")


def _check_arrays(content, end, appended, size):
    """Check the lengths at the beginning of each array that is not text."""
    root = re.search(rb"<VTKFile\b([^>]*)>", content[:HEADER_LIMIT])
    attributes = root[1] if root else b""
    wide = _attribute(attributes, b"header_type") == b"UInt64"
    order = ">" if _attribute(attributes, b"byte_order") == b"BigEndian" else "<"
    dtype = np.dtype(f"{order}u{8 if wide else 4}")
    compressed = _attribute(attributes, b"compressor") is not None
    for match in _ARRAY.finditer(content, 0, end):
        form = _attribute(match[1], b"format")
        if form == b"ascii" and _attribute(match[1], b"Name") == b"offsets":
            _check_offsets(content[match.end() : content.find(b"<", match.end())].split(), size)
        if form == b"binary":
            header = _decoded(content[match.end() : match.end() + HEADER_LIMIT].partition(b"<")[0])
        elif form == b"appended" and appended is not None:
            offset = _attribute(match[1], b"offset") or b"0"
            if not offset.isdigit() or appended.end() + int(offset) > size:
                raise ValueError("expected arrays that begin within the file: the file is truncated or damaged")
            begin = appended.end() + int(offset)
            header = content[begin : begin + HEADER_LIMIT]
            header = header if _attribute(appended[1], b"encoding") == b"raw" else _decoded(header)
        else:
            continue
        numbers = np.frombuffer(header[: len(header) // dtype.itemsize * dtype.itemsize], dtype)
        _check_lengths(numbers.astype(object), compressed, size)


def _check_offsets(words, size):
    """Check that cell offsets ascend and are consistent with the size of the file."""
    before = 0
    for word in words:
        if not re.fullmatch(rb"\d{1,18}", word) or not before <= int(word) <= size:
            text = word.decode("latin-1")[:30]
            raise ValueError(f"expected offsets of cells that ascend within the file, got {text}")
        before = int(word)


def _check_lengths(numbers, compressed, size):
    """Check an array's number of bytes, or its block header: block count, block sizes and compressed sizes."""
    if len(numbers) == 0:
        raise ValueError("expected the length of an array: the file is truncated or damaged")
    fits = numbers[0] <= size
    if compressed and numbers[0] == 0:
        fits = len(numbers) < 3 or numbers[2] == 0
    if compressed and numbers[0] > 0:
        fits = (
            fits
            and len(numbers) >= 3
            and max(numbers[0] * numbers[1], numbers[2]) <= size * MOST_INFLATED
            and sum(numbers[3 : 3 + int(numbers[0])]) <= size
        )
    if not fits:
        raise ValueError("expected arrays whose lengths fit into the file: the file is truncated or damaged")


def _decoded(text):
    """The first bytes of base64 text, up to the padding, as after the lengths of compressed arrays."""
    text = bytes(text).strip()
    match = re.match(rb"[A-Za-z0-9+/]*={0,2}", text)
    words = match[0] if match else b""
    try:
        return base64.b64decode(words[: len(words) // 4 * 4])
    except binascii.Error:
        raise ValueError("expected arrays in base64: the file is damaged") from None


def _attribute(attributes, name):
    """The value of an attribute of an XML element, or None."""
    match = re.search(rb"\b" + name + rb"""\s*=\s*["']([^"']*)["']""", attributes)
    return match[1] if match else None
