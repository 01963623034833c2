"""Samples of a volume that are read box by box, from any storage."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...io.checks import check_samples
from ...io.read import check_nan, without_nan
from ..layout import slices_of

#: Identifies a source, so that a continued conversion can check that it is still the same.
Identity = dict[str, Any]


class Source:
    """Samples [z, y, x], and their place in the world.

    Attributes
    ----------
    shape : (int, int, int)
        Samples along z, y and x.
    dtype : dtype
        Type of the samples that `read` returns.
    spacing, origin, direction
        As in a `Volume`.
    unit : str or None
        Of lengths, by its name in OME-Zarr.
    patient : bool
        Whether the world is a patient's, as of a `VolumeData`.
    identity : dict
        Distinguishes this source from others: names, sizes and times of files, the first one as `path`, and how their
        samples are read, such as byte order, offset and axes. Without a `path`, the samples are compared.
    """

    def __init__(self, shape: Any, dtype: Any, identity: Identity | None = None) -> None:
        check_samples(tuple(shape), dtype, mapped=True)
        self.shape: tuple[int, int, int] = tuple(map(int, shape))  # type: ignore[assignment]
        self.dtype = samples_type(np.dtype(dtype))
        self.spacing: ArrayLike = (1.0, 1.0, 1.0)
        self.origin: ArrayLike = (0.0, 0.0, 0.0)
        self.direction: ArrayLike = np.eye(3)
        self.unit: str | None = None
        self.patient = False
        self.identity: Identity = {"shape": list(self.shape), "dtype": self.dtype.str, **(identity or {})}

    @property
    def frame(self) -> dict[str, ArrayLike]:
        """The place of the samples: spacing, origin and direction."""
        return {"spacing": self.spacing, "origin": self.origin, "direction": self.direction}

    @property
    def path(self) -> str | os.PathLike[str] | None:
        """The file or the folder of the samples, if it is known."""
        return self.identity.get("path")

    def read(self, box: Any) -> NDArray[Any]:
        """The samples of a box, ((first, one after the last) along z, y and x)."""
        raise NotImplementedError

    def working_memory(self, shape: Any) -> int:
        """Bytes needed to read a box of this shape, including its samples."""
        return math.prod(shape) * self.dtype.itemsize

    def stage(self, path: Any, report: Callable[[float], None]) -> Source:
        """A source of the same samples whose boxes can be read in any order; a subclass may write a file for it."""
        del path, report
        return self

    def move(self, **frame: Any) -> Source:
        """Put the samples elsewhere: spacing, origin, direction, unit and patient, those that are given."""
        for field, value in frame.items():
            setattr(self, field, value)
        return self


class ArraySource(Source):
    """An array in memory, or any object with a shape and a dtype that returns arrays when it is sliced."""

    def __init__(self, array: Any, axes: str = "zyx") -> None:
        self._array, self._axes = array, axes
        shape = tuple(array.shape)
        super().__init__(shape[::-1] if axes == "xyz" else shape, array.dtype)

    @property
    def path(self) -> str | os.PathLike[str] | None:
        owner = owner_of(self._array)
        if isinstance(owner, np.memmap):
            return owner.filename
        return getattr(getattr(owner, "store", None), "root", None)  # of an array of zarr-python

    def read(self, box: Any) -> NDArray[Any]:
        if self._axes == "xyz":
            return as_samples(np.asarray(self._array[slices_of(box[::-1])]).T)
        return as_samples(np.asarray(self._array[slices_of(box)]))


class WithoutNan(Source):
    """The samples of another source, with a number in place of NaN."""

    def __init__(self, source: Source, nan: float) -> None:
        check_nan(nan, source.dtype)
        self._source, self._nan = source, float(nan)
        super().__init__(source.shape, source.dtype, {**source.identity, "nan": self._nan})
        self.move(**source.frame, unit=source.unit, patient=source.patient)

    @property
    def path(self) -> str | os.PathLike[str] | None:
        return self._source.path

    def read(self, box: Any) -> NDArray[Any]:
        samples = self._source.read(box)
        return without_nan(samples, self._nan) if samples.dtype.kind == "f" else samples

    def working_memory(self, shape: Any) -> int:
        return self._source.working_memory(shape) + math.prod(shape) * (self.dtype.itemsize + 1)

    def stage(self, path: Any, report: Callable[[float], None]) -> Source:
        return WithoutNan(self._source.stage(path, report), self._nan)


class RawSource(Source):
    """Headerless samples in a file, x fastest. The file is not mapped, because mapped pages would count as memory."""

    def __init__(self, path: Any, shape: Any, dtype: Any, offset: int = 0) -> None:
        self._path, self._offset = os.fspath(path), int(offset)
        self._stored_type = np.dtype(dtype)
        identity = identity_of(path, stored=self._stored_type.str, offset=self._offset)
        super().__init__(shape, dtype, identity)

    def read(self, box: Any) -> NDArray[Any]:
        (z_first, z_last), (y_first, y_last), (x_first, x_last) = box
        _, ny, nx = self.shape
        itemsize = self._stored_type.itemsize
        result = np.empty([last - first for first, last in box], self._stored_type)
        rows = y_last - y_first
        with open(self._path, "rb", buffering=0) as file:
            for z in range(z_first, z_last):
                file.seek(self._offset + (z * ny + y_first) * nx * itemsize)
                content = file.read(rows * nx * itemsize)
                if len(content) < rows * nx * itemsize:
                    raise ValueError(f"{self._path}: expected samples of slice {z}, got the end of the file")
                lines = np.frombuffer(content, self._stored_type).reshape(rows, nx)
                result[z - z_first] = lines[:, x_first:x_last]
        return as_samples(result)

    def working_memory(self, shape: Any) -> int:
        return super().working_memory(shape) + shape[1] * self.shape[2] * self.dtype.itemsize


def identity_of(*paths: Any, **read: Any) -> Identity:
    """Sizes and modification times of files, their order, and how they are read, as of types that JSON supports."""
    status = [os.stat(path) for path in paths]
    names = "\0".join(map(os.path.realpath, paths))
    return {
        "path": os.path.realpath(paths[0]),
        "files": hashlib.sha256(os.fsencode(names)).hexdigest()[:16],
        "bytes": sum(each.st_size for each in status),
        "changed": max(each.st_mtime_ns for each in status),
        **read,
    }


def owner_of(array: Any) -> Any:
    """The array of NumPy of which another one is a view, or the array itself."""
    while isinstance(array, np.ndarray) and isinstance(array.base, np.ndarray):
        array = array.base
    return array


def samples_type(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """The type in which the core reads samples of a given type."""
    if dtype.kind == "b":
        return np.dtype(np.uint8)
    return np.dtype(np.float64) if dtype.kind == "f" and dtype.itemsize > 8 else dtype.newbyteorder("=")


def as_samples(array: NDArray[Any]) -> NDArray[Any]:
    """Samples converted to that type."""
    return array.astype(samples_type(array.dtype), copy=False)
