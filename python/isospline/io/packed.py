"""Samples as a file stores them, compressed or not, read to the end and to the checksum."""

from __future__ import annotations

import bz2
import contextlib
import gzip
import zlib

import numpy as np

_BLOCK = 1 << 20


def read_samples(parts, shape, dtype, compression=None):
    """Fill an array of this shape from files, each of which holds an equal part of it from a byte on.

    Parameters
    ----------
    parts : sequence of (path, int, int)
        Files, where their stream begins, and bytes of the stream, once decompressed, to leave out.
    shape, dtype
        Of the array.
    compression : {None, "gzip", "bzip2", "zlib"}
        How the stream is compressed.
    """
    data = np.empty(shape, dtype)
    content = memoryview(data.reshape(-1).view(np.uint8))
    size, rest = divmod(len(content), len(parts))
    if rest:
        raise ValueError(f"expected files of equal size, got {len(parts)} for {len(content)} bytes of samples")
    for number, (path, begin, skipped) in enumerate(parts):
        with opened(path, begin, compression) as stream:
            skip(stream, skipped)
            fill(stream, content[number * size : (number + 1) * size])
            if compression is not None:
                drain(stream)
    return data


@contextlib.contextmanager
def opened(path, begin, compression):
    """The stream that begins at a byte of a file, decompressed."""
    with open(path, "rb") as file:
        file.seek(begin)
        yield _STREAMS[compression](file)


def fill(stream, content):
    """Read as many bytes as there is room for."""
    done = 0
    while done < len(content):
        count = stream.readinto(content[done : done + _BLOCK])
        if not count:
            raise ValueError(f"expected {len(content)} bytes of samples, got {done} bytes: the file is truncated")
        done += count


def skip(stream, count):
    """Leave out as many bytes."""
    while count > 0:
        content = stream.read(min(count, _BLOCK))
        if not content:
            raise ValueError("expected samples after the bytes to skip: the file is truncated")
        count -= len(content)


def drain(stream):
    """Read a compressed stream to its end, where its checksum is."""
    while stream.read(_BLOCK):
        pass


class _Inflated:
    """A stream that zlib has compressed, or gzip: MetaImage allows both."""

    def __init__(self, file):
        self._file = file
        self._inflate = zlib.decompressobj(wbits=32 + zlib.MAX_WBITS)

    def readinto(self, content):
        """Read at most as many bytes as there is room for; 0 at the end."""
        data = self.read(len(content))
        content[: len(data)] = data
        return len(data)

    def read(self, count):
        """At most as many bytes; none at the end, which must be where the stream says, and right by its checksum."""
        while not self._inflate.eof:
            packed = self._inflate.unconsumed_tail or self._file.read(_BLOCK)
            if not packed:
                raise ValueError("expected compressed samples to their end: the file is truncated")
            data = self._inflate.decompress(packed, count)
            if data:
                return data
        return b""


_STREAMS = {
    None: lambda file: file,
    "gzip": lambda file: gzip.GzipFile(fileobj=file, mode="rb"),
    "bzip2": bz2.BZ2File,
    "zlib": _Inflated,
}
