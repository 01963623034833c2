"""Arrays in chunks: Zarr 2 and 3, OME-Zarr, HDF5 and N5. They are reopened for each box."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.parameters import printable
from ..layout import zarr
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
    key : str
        Key of the array in it.
    axes : sequence of int
        Which axes of the array are z, y and x.
    fixed : dict of int to int
        The item of each other axis.
    """

    def __init__(self, path: Any, key: str = "", axes: Any = (0, 1, 2), fixed: Any = None) -> None:
        self._path, self._key, self._axes, self._fixed = Path(path), key, tuple(axes), dict(fixed or {})
        with self._opened() as array:
            shape, dtype = tuple(array.shape), _dtype_of(array)
            self._chunks = tuple(_chunks_of(array))
        if sorted((*self._axes, *self._fixed)) != list(range(len(shape))):
            raise ValueError(f"{self.name}: expected an array of three dimensions, got shape {shape}")
        super().__init__([shape[axis] for axis in self._axes], dtype, self._identify())

    @property
    def name(self) -> str:
        """The name in messages."""
        return f"{printable(self._path)}{':/' + self._key if self._key else ''}"

    def _opened(self) -> Any:
        raise NotImplementedError

    def _identify(self) -> Identity:
        # A folder has too many chunks to look at; its metadata show whether the array was written again.
        metadata = [self._path / self._key / name for name in ("zarr.json", ".zarray", "attributes.json")]
        status = [os.stat(file) for file in (self._path, *metadata) if file.is_file()]
        return {
            "path": os.path.realpath(self._path),
            "key": self._key,
            "item": sorted(self._fixed.items()),
            "bytes": sum(each.st_size for each in status),
            "changed": max(each.st_mtime_ns for each in status),
        }

    def read(self, box: Any) -> NDArray[Any]:
        try:
            with self._opened() as array:
                return self._read(array, box)
        except Exception as error:
            raise self._named(box, error) from error

    def _read(self, array, box):
        index: list[Any] = [self._fixed.get(axis) for axis in range(len(array.shape))]
        for axis, (first, last) in zip(self._axes, box):
            index[axis] = slice(first, last)
        samples = np.asarray(array[tuple(index)])
        return as_samples(samples.transpose(np.argsort(np.argsort(self._axes))))

    def _named(self, box, error):
        """An error that names the first chunk that cannot be read."""
        edges = [self._chunks[axis] for axis in self._axes]
        covered = [range(first // edge, math.ceil(last / edge)) for (first, last), edge in zip(box, edges)]
        for chunk in itertools.product(*covered):
            part = [
                (max(at * edge, first), min((at + 1) * edge, last))
                for at, edge, (first, last) in zip(chunk, edges, box)
            ]
            try:
                with self._opened() as array:
                    self._read(array, part)
            except Exception as cause:
                text = " ".join(str(cause).split()) or type(cause).__name__
                return ValueError(f"{self.name}: chunk {chunk} (z, y, x) cannot be read: {text}")
        return error

    def working_memory(self, shape: Any) -> int:
        chunks = math.prod(math.ceil(edge / self._chunks[axis]) + 1 for edge, axis in zip(shape, self._axes))
        at_a_time = min(chunks, _CONCURRENCY) * math.prod(self._chunks) * self.dtype.itemsize
        return super().working_memory(shape) + 2 * at_a_time


class ZarrSource(ChunkedSource):
    """An array of Zarr 2 or 3."""

    @contextlib.contextmanager
    def _opened(self) -> Iterator[Any]:
        yield zarr().open_array(str(self._path), path=self._key, mode="r")


class Hdf5Source(ChunkedSource):
    """A dataset of an HDF5 file."""

    @contextlib.contextmanager
    def _opened(self) -> Iterator[Any]:
        with open_hdf5(self._path) as file:
            yield file[self._key]


class N5Source(ChunkedSource):
    """A dataset of N5, by TensorStore; its axes are x, y, z."""

    @contextlib.contextmanager
    def _opened(self) -> Iterator[Any]:
        tensorstore = _imported("tensorstore")
        kvstore = {"driver": "file", "path": str(self._path / self._key) + "/"}
        array = tensorstore.open({"driver": "n5", "kvstore": kvstore}, open=True, read=True).result()
        yield _TensorStoreArray(array)


class _TensorStoreArray:
    """An array of TensorStore, read when it is indexed."""

    def __init__(self, array):
        self.shape, self.dtype = array.shape, array.dtype.numpy_dtype
        self.chunks = array.chunk_layout.read_chunk.shape
        self._array = array

    def __getitem__(self, index):
        return self._array[index].read().result()


def open_hdf5(path: Any) -> Any:
    """Open an HDF5 file for reading."""
    return _imported("h5py").File(path, "r")


def read_json(path: Path) -> dict[str, Any]:
    """The object in a JSON file, or an empty one if there is no file."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f"{printable(path)}: expected JSON, got text that cannot be parsed: {error}") from error
    return content if isinstance(content, dict) else {}


def _imported(name):
    import importlib

    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ModuleNotFoundError(
            f"reading this format needs the package {error.name}: pip install isospline[store]", name=error.name
        ) from error


def _dtype_of(array):
    dtype = np.dtype(array.dtype)
    if dtype.kind not in "biuf":
        raise ValueError(f"expected real numbers, got {dtype}")
    return dtype


def _chunks_of(array):
    """Edges of the chunks that are read at a time. HDF5 may store a dataset contiguously; any part can then be read."""
    return array.chunks or (1,) * len(array.shape)
