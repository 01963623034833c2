"""Reads arrays in chunks with the libraries of their formats. Its functions run in a process of their own."""

from __future__ import annotations

import contextlib
import importlib
import itertools
import math
import os
from collections.abc import Iterator
from typing import Any

import numpy as np

#: The package that reads each format.
LIBRARIES = {"zarr": "zarr", "hdf5": "h5py", "n5": "tensorstore"}


def load_node(path: str, format: str, key: str) -> dict[str, Any]:
    """An array's shape, type of samples and edges of chunks, or the names of a group's arrays; attributes of Zarr."""
    with _opened(path, format, key) as node:
        attributes = dict(node.attrs) if format == "zarr" else {}
        if not hasattr(node, "shape"):
            return {"arrays": _arrays_in(node), "attributes": attributes}
        dtype = np.dtype(node.dtype)
        if dtype.kind not in "biuf":
            raise ValueError(f"expected real numbers, got {dtype}")
        # HDF5 may store an array contiguously; any part can then be read.
        chunks = node.chunks or (1,) * len(node.shape)
        return {"shape": node.shape, "dtype": dtype.str, "chunks": chunks, "attributes": attributes}


def load_box(path: str, format: str, key: str, index: list[Any]) -> Any:
    """The samples at an index: for each axis a number, or from and to. Errors name the first broken chunk."""
    with _opened(path, format, key) as array:
        try:
            return _read(array, index)
        except Exception:
            chunks = array.chunks or (1,) * len(array.shape)
            for chunk, part in _parts(index, chunks):
                try:
                    _read(array, part)
                except Exception as cause:
                    text = " ".join(str(cause).split()) or type(cause).__name__
                    raise ValueError(f"chunk {chunk} cannot be read: {text}") from cause
            raise


def _read(array, index):
    return np.asarray(array[tuple(each if isinstance(each, int) else slice(*each) for each in index)])


def _parts(index, chunks):
    """The position of each chunk within a box, and the part of the box in it."""
    ranges = [(each, each + 1) if isinstance(each, int) else tuple(each) for each in index]
    covered = [range(first // edge, math.ceil(last / edge)) for (first, last), edge in zip(ranges, chunks)]
    for chunk in itertools.product(*covered):
        part = [(max(at * edge, a), min((at + 1) * edge, b)) for at, edge, (a, b) in zip(chunk, chunks, ranges)]
        yield chunk, part


@contextlib.contextmanager
def _opened(path: str, format: str, key: str) -> Iterator[Any]:
    library = importlib.import_module(LIBRARIES[format])
    if format == "zarr":
        yield library.open(path, path=key, mode="r")
    elif format == "hdf5":
        with library.File(path, "r") as file:
            if key not in file:
                raise ValueError(f"expected a dataset {key}, got {', '.join(_arrays_in(file)) or 'none'}")
            if isinstance(file[key], library.Dataset):
                _check_virtual(file[key], os.path.dirname(path))
            yield file[key]
    else:
        kvstore = {"driver": "file", "path": os.path.join(path, key, "")}
        yield _OfTensorStore(library.open({"driver": "n5", "kvstore": kvstore}, open=True, read=True).result())


def _arrays_in(group):
    """The names of a group's arrays: of Zarr those directly in it, of HDF5 all of three dimensions."""
    if hasattr(group, "array_keys"):
        return sorted(group.array_keys())
    names: list[str] = []
    group.visititems(lambda name, item: names.append(name) if len(getattr(item, "shape", None) or ()) == 3 else None)
    return names


def _check_virtual(dataset, folder):
    """Check that the files of a virtual dataset exist: HDF5 reads zeros in the place of those that do not."""
    for source in dataset.virtual_sources() if dataset.is_virtual else ():
        places = [os.path.join(folder, source.file_name), source.file_name]
        if source.file_name != "." and "%" not in source.file_name and not any(map(os.path.exists, places)):
            raise ValueError(f"expected the file {source.file_name}, of which {dataset.name} consists, got none")


class _OfTensorStore:
    """An array of TensorStore, read when it is indexed."""

    def __init__(self, array):
        self.shape, self.dtype = array.shape, array.dtype.numpy_dtype
        self.chunks = array.chunk_layout.read_chunk.shape
        self._array = array

    def __getitem__(self, index):
        return self._array[index].read().result()
