"""Reads samples as a file stores them, as text, compressed or not, to the end and including the checksum.

Compressed samples are decompressed, and text is read, in a process of their own.
"""

from __future__ import annotations

import bz2
import contextlib
import gzip
import math
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from . import isolated

_BLOCK = 1 << 20
#: The most bytes that are decompressed before the samples: of NIfTI's header with its extensions, NRRD's byte skip.
SKIP_LIMIT = 1 << 26


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
        with opened(path, begin, compression, skipped, size) as stream:
            fill(stream, content[number * size : (number + 1) * size])
    return data.astype(data.dtype.newbyteorder("="), copy=False)


def read_text(path, begin, shape, dtype):
    """Samples as text, separated by blanks, from a byte of a file to its end."""
    return read_as("isospline.io.packed:load_text", path, begin, shape, dtype)


def read_as(function, path, begin, shape, dtype):
    """Samples that a function reads in a process of its own, as text takes many times the memory of the file."""
    return isolated.call(function, Path(path), begin=begin, shape=shape, dtype=dtype.str)


def load_text(path, begin, shape, dtype):
    """`read_text`, for `isolated.call`. Whole numbers are exact; those like 1.5e+06, as ITK writes them, count, too."""
    dtype = np.dtype(dtype)
    with open(path, "rb") as file:
        file.seek(begin)
        words = file.read().split()
    count = math.prod(shape)
    if len(words) != count:
        raise ValueError(f"expected {count} samples, got {len(words)}: the file is truncated or damaged")
    try:
        numbers = [float(word) for word in words] if dtype.kind == "f" else [_whole(word, dtype) for word in words]
        return np.array(numbers, dtype).reshape(shape)
    except (ValueError, OverflowError):
        raise ValueError(f"expected samples of {dtype}, got others: the file is damaged") from None


def _whole(word, dtype):
    """A whole number that a type holds: some versions of NumPy would wrap others."""
    try:
        number = int(word)
    except ValueError:
        number = int(float(word))
        if number != float(word):
            raise
    limits = np.iinfo(dtype)
    if not limits.min <= number <= limits.max:
        raise OverflowError
    return number


def check_skip(count):
    """Check the number of bytes that a header promises between it and compressed samples: all are decompressed."""
    if count > SKIP_LIMIT:
        raise ValueError(f"expected at most {SKIP_LIMIT} bytes before compressed samples, got {count}")


@contextlib.contextmanager
def opened(path, begin, compression, skipped, size):
    """The stream of `size` bytes after those to skip; a process of its own decompresses it, and checks its end."""
    if compression is None:
        with open(path, "rb") as file:
            file.seek(begin + skipped)
            yield file
    else:
        about = {"begin": begin, "compression": compression, "skipped": skipped, "size": size}
        with isolated.stream("isospline.io.packed:decompress", Path(path), **about) as stream:
            yield stream


def decompress(path, output, begin, compression, skipped, size):
    """Write `size` decompressed bytes to a file, for `isolated.stream`, and check that the stream ends then.

    No more is decompressed than these, those to skip and one block: a small file may expand to any size.
    """
    with open(path, "rb") as file:
        file.seek(begin)
        stream = _STREAMS[compression](file)
        for _ in _blocks(stream, skipped, "before samples"):
            pass
        for content in _blocks(stream, size, "of samples"):
            output.write(content)
        beyond = 0
        while content := stream.read(_BLOCK):  # to the end, where the checksum is
            beyond += len(content)
            if beyond > _BLOCK:
                raise ValueError(f"expected {size} bytes of samples, got at least {size + beyond}: the file is damaged")


def _blocks(stream, count, what):
    """This number of bytes of a stream, block by block."""
    done = 0
    while done < count:
        content = stream.read(min(count - done, _BLOCK))
        if not content:
            raise ValueError(f"expected {count} bytes {what}, got {done} bytes: the file is truncated")
        done += len(content)
        yield content


def fill(stream, content):
    """Fill a buffer completely."""
    done = 0
    while done < len(content):
        count = stream.readinto(content[done : done + _BLOCK])
        if not count:
            raise ValueError(f"expected {len(content)} bytes of samples, got {done} bytes: the file is truncated")
        done += count


class _Inflated:
    """A stream compressed by zlib or gzip: MetaImage allows both."""

    def __init__(self, file):
        self._file = file
        self._inflate = zlib.decompressobj(wbits=32 + zlib.MAX_WBITS)

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


_STREAMS: dict[str, Any] = {
    "gzip": lambda file: gzip.GzipFile(fileobj=file, mode="rb"),
    "bzip2": bz2.BZ2File,
    "zlib": _Inflated,
}
