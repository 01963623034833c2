"""Arrays in chunks: Zarr 2 and 3, OME-Zarr, HDF5 and N5. They are read box by box, in a process of its own each."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.parameters import printable
from ...io import isolated
from . import chunk_reader
from .source import Identity, Source, as_samples

#: Chunks that are decoded at a time: zarr-python's default.
_CONCURRENCY = 10

#: The positions of z, y and x among the axes of an array.
ORDERS = {"zyx": (0, 1, 2), "xyz": (2, 1, 0)}


class ChunkedSource(Source):
    """An array of chunks with three spatial axes in any order. One item of each other axis is used.

    Parameters
    ----------
    path : Path
        The file or folder.
    format : {"zarr", "hdf5", "n5"}
        How it is stored.
    key : str
        Key of the array in it.
    axes : sequence of int
        Which axes of the array are z, y and x.
    fixed : dict of int to int
        The item of each other axis.
    """

    def __init__(self, path: Any, format: str, key: str = "", axes: Any = (0, 1, 2), fixed: Any = None) -> None:
        self._path, self._format, self._key = Path(path), format, key
        self._axes, self._fixed = tuple(axes), dict(fixed or {})
        node = load("load_node", self._path, format, key=key)
        if "shape" not in node:
            raise ValueError(f"{self.name}: expected an array, got a group")
        shape, self._chunks = node["shape"], node["chunks"]
        if sorted((*self._axes, *self._fixed)) != list(range(len(shape))):
            raise ValueError(f"{self.name}: expected an array of three dimensions, got shape {tuple(shape)}")
        super().__init__([shape[axis] for axis in self._axes], node["dtype"], self._identify())

    @property
    def name(self) -> str:
        """The name in messages."""
        return f"{printable(self._path)}{':/' + self._key if self._key else ''}"

    def _identify(self) -> Identity:
        # A folder has too many chunks to look at; its metadata show whether the array was written again.
        metadata = [self._path / self._key / name for name in ("zarr.json", ".zarray", "attributes.json")]
        status = [os.stat(file) for file in (self._path, *metadata) if file.is_file()]
        return {
            "path": os.path.realpath(self._path),
            "key": self._key,
            "axes": list(self._axes),
            "item": [list(each) for each in sorted(self._fixed.items())],
            "bytes": sum(each.st_size for each in status),
            "changed": max(each.st_mtime_ns for each in status),
        }

    def read(self, box: Any) -> NDArray[Any]:
        index: list[Any] = [self._fixed.get(axis) for axis in range(len(self._chunks))]
        for axis, (first, last) in zip(self._axes, box):
            index[axis] = (int(first), int(last))
        size = math.prod(last - first for first, last in box) * self.dtype.itemsize
        try:
            samples = load("load_box", self._path, self._format, size=size, key=self._key, index=index)
        except ValueError as error:
            raise ValueError(f"{self.name}: {error}") from error
        return as_samples(samples.transpose(np.argsort(np.argsort(self._axes))))

    def working_memory(self, shape: Any) -> int:
        chunks = math.prod(math.ceil(edge / self._chunks[axis]) + 1 for edge, axis in zip(shape, self._axes))
        at_a_time = min(chunks, _CONCURRENCY) * math.prod(self._chunks) * self.dtype.itemsize
        return 2 * (super().working_memory(shape) + at_a_time)


def load(function: str, path: Path, format: str, *, size: int = 0, **arguments: Any) -> Any:
    """Call a function of `chunk_reader` in a process of its own; `size` is that of the samples in bytes."""
    # A virtual dataset of HDF5 consists of other files.
    readable = isolated.referenced(None) if format == "hdf5" else None
    name, library = f"{chunk_reader.__name__}:{function}", chunk_reader.LIBRARIES[format]
    return isolated.call(name, path, library, readable=readable, size=size, format=format, **arguments)


def read_json(path: Path) -> dict[str, Any]:
    """The object in a JSON file, or an empty one if there is no file."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f"{printable(path)}: expected JSON, got text that cannot be parsed: {error}") from error
    return content if isinstance(content, dict) else {}
