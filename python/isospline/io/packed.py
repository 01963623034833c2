"""Reads samples as a file stores them, compressed or not, to the end and including the checksum."""

from __future__ import annotations

import bz2
import contextlib
import gzip
import zlib
from typing import Any

import numpy as np

_BLOCK = 1 << 20


def read_samples(parts, shape, dtype, compression=None):
    """Fill an array of this shape from files. Each file has an equal part of it, which begins at a given byte.

    Parameters
    ----------
    parts : sequence of (path, int, int)
        Files, the byte where their stream begins, and the number of bytes to skip in the decompressed stream.
    shape, dtype
        Of the array.
    compression : {None, "gzip", "bzip2", "zlib"}
        How the stream is compressed.

    Returns
    -------
    ndarray
        In the machine's byte order.
    """
    data = np.empty(shape, dtype)
    content = data.reshape(-1).view(np.uint8).data
    size, rest = divmod(len(content), len(parts))
    if rest:
        raise ValueError(f"expected files of equal size, got {len(parts)} for {len(content)} bytes of samples")
    for number, (path, begin, skipped) in enumerate(parts):
        with opened(path, begin, compression) as stream:
            skip(stream, skipped)
            fill(stream, content[number * size : (number + 1) * size])
            if compression is not None:
                drain(stream)
    return data.astype(data.dtype.newbyteorder("="), copy=False)


@contextlib.contextmanager
def opened(path, begin, compression):
    """The stream that begins at a byte of a file, decompressed."""
    with open(path, "rb") as file:
        file.seek(begin)
        yield _STREAMS[compression](file)


def fill(stream, content):
    """Fill a buffer completely."""
    done = 0
    while done < len(content):
        count = stream.readinto(content[done : done + _BLOCK])
        if not count:
            raise ValueError(f"expected {len(content)} bytes of samples, got {done} bytes: the file is truncated")
        done += count


def skip(stream, count):
    """Skip this number of bytes."""
    while count > 0:
        content = stream.read(min(count, _BLOCK))
        if not content:
            raise ValueError("expected samples after the bytes to skip: the file is truncated")
        count -= len(content)


def drain(stream):
    """Read a compressed stream to its end, where the checksum is."""
    while stream.read(_BLOCK):
        pass


class _Inflated:
    """A stream compressed by zlib or gzip: MetaImage allows both."""

    def __init__(self, file):
        self._file = file
        self._inflate = zlib.decompressobj(wbits=32 + zlib.MAX_WBITS)

    def readinto(self, content):
        """Read into a buffer; returns the number of bytes, 0 at the end."""
        data = self.read(len(content))
        content[: len(data)] = data
        return len(data)

    def read(self, count):
        """At most `count` bytes; none at the end of the stream, where its length and checksum are checked."""
        while not self._inflate.eof:
            packed = self._inflate.unconsumed_tail or self._file.read(_BLOCK)
            if not packed:
                raise ValueError("expected compressed samples to their end: the file is truncated")
            data = self._inflate.decompress(packed, count)
            if data:
                return data
        return b""


_STREAMS: dict[str | None, Any] = {
    None: lambda file: file,
    "gzip": lambda file: gzip.GzipFile(fileobj=file, mode="rb"),
    "bzip2": bz2.BZ2File,
    "zlib": _Inflated,
}
