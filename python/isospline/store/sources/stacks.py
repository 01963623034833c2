"""Samples that are read slice by slice: compressed files, and folders with a file for each slice.

A block of a volume needs a part of many slices. To decode each slice only once, all slices are first written next to
the store's arrays, uncompressed, and removed at the end.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...io import dicom, packed, tiff
from ...io.checks import check_file
from ...io.read import errors_name
from ...io.told import warn_of_place
from ..layout import writing
from ..ome import name_of_unit
from .source import RawSource, Source, as_samples, identity_of, samples_type

#: Bytes of the pages of a TIFF file that are decoded at a time.
_PAGES_BYTES = 1 << 26


class StackSource(Source):
    """Slices [y, x] that can be read in order."""

    def slices(self, first: int) -> Iterator[NDArray[Any]]:
        """All slices beginning at `first`, of type `dtype`."""
        raise NotImplementedError

    def stage(self, path: Any, report: Callable[[float], None]) -> Source:
        size = int(np.prod(self.shape[1:])) * self.dtype.itemsize
        begun = os.path.getsize(path) // size if os.path.exists(path) else 0
        with writing(path), open(path, "ab") as file:
            file.truncate(begun * size)
        for number, samples in enumerate(self.slices(begun) if begun < self.shape[0] else (), begun):
            if samples.shape != self.shape[1:] or samples.dtype != self.dtype:
                raise ValueError(
                    f"slice {number}: expected {self.shape[1:]} samples of {self.dtype}, as in the first one, got "
                    f"{samples.shape} of {samples.dtype}"
                )
            with writing(path), open(path, "ab") as file:  # closed here: what is buffered is written
                file.write(np.ascontiguousarray(samples).data)
            report((number + 1) / self.shape[0])
        staged = RawSource(path, self.shape, self.dtype)
        staged.identity = self.identity
        return staged.move(**self.frame, unit=self.unit, patient=self.patient)


class FilesSource(StackSource):
    """A file for each slice."""

    def __init__(self, files: list[Path], shape: Any, dtype: Any, read: Callable[[Path], NDArray[Any]]) -> None:
        self._files, self._read = files, read
        super().__init__((len(files), *shape), dtype, identity_of(*files))

    def slices(self, first: int) -> Iterator[NDArray[Any]]:
        for file in self._files[first:]:
            with errors_name(file, "a slice"):
                samples = self._read(file)
            yield as_samples(samples)


class PagesSource(StackSource):
    """The pages of a TIFF file."""

    def __init__(self, path: Path, shape: Any, dtype: Any) -> None:
        self._path = path
        super().__init__(shape, dtype, identity_of(path, *tiff.sample_files(path)))

    def slices(self, first: int) -> Iterator[NDArray[Any]]:
        size = int(np.prod(self.shape[1:])) * self.dtype.itemsize
        count = max(1, _PAGES_BYTES // size)
        for begin in range(first, self.shape[0], count):
            with errors_name(self._path, "TIFF"):
                pages = tiff.read_pages(self._path, begin, min(begin + count, self.shape[0]))
            yield from map(as_samples, pages)


class PackedSource(StackSource):
    """A stream of samples, x fastest, in one or several files, compressed or not, with an optional scaling."""

    def __init__(self, parts: Any, shape: Any, dtype: Any, compression: str | None, scaling: Any = None) -> None:
        self._parts, self._compression, self._scaling = parts, compression, scaling
        self._stored_type = np.dtype(dtype)
        scaled = self._scaled(np.zeros(1, dtype)).dtype
        files, *begins = zip(*parts)
        read = {
            "stored": self._stored_type.str,
            "compression": compression,
            "begins": [[*map(int, each)] for each in begins],
        }
        super().__init__(shape, scaled, identity_of(*files, **read))

    def _scaled(self, samples):
        return samples if self._scaling is None else self._scaling(samples)

    def slices(self, first: int) -> Iterator[NDArray[Any]]:
        size = int(np.prod(self.shape[1:])) * self._stored_type.itemsize
        whole, rest = divmod(self.shape[0] * size, len(self._parts))
        if rest or whole % size:
            raise ValueError(f"expected files of whole slices, got {len(self._parts)} for {self.shape[0]} slices")
        each = whole // size
        for number, (path, begin, skipped) in enumerate(self._parts):
            start = max(first - number * each, 0)
            if start >= each:
                continue
            left = (each - start) * size
            with packed.opened(path, begin, self._compression, skipped + start * size, left) as stream:
                for _ in range(start, each):
                    content = bytearray(size)
                    packed.fill(stream, memoryview(content))
                    samples = np.frombuffer(content, self._stored_type).reshape(self.shape[1:])
                    yield as_samples(self._scaled(samples))


class ScaledSource(RawSource):
    """Headerless samples with a scaling."""

    def __init__(self, path: Any, shape: Any, dtype: Any, offset: int, scaling: Any) -> None:
        super().__init__(path, shape, dtype, offset)
        self._scaling = scaling
        self.dtype = samples_type(scaling(np.zeros(1, dtype)).dtype)

    def read(self, box: Any) -> NDArray[Any]:
        return as_samples(self._scaling(super().read(box)))

    def working_memory(self, shape: Any) -> int:
        return 2 * super().working_memory(shape)


def open_packed(parts: Any, shape: Any, dtype: Any, compression: str | None) -> Source:
    """A source of the samples that `packed.read_samples` would read."""
    if compression is None and len(parts) == 1:
        path, begin, skipped = parts[0]
        return RawSource(path, shape, dtype, begin + skipped)
    return PackedSource(parts, shape, dtype, compression)


def open_nifti(path: Any, begin: int, shape: Any, dtype: Any, compression: str | None, scaling: Any) -> Source:
    """A source of the samples that `nifti.read` would read."""
    if compression is not None:
        return PackedSource([(path, 0, begin)], shape, dtype, compression, scaling)
    return ScaledSource(path, shape, dtype, begin, scaling) if scaling else RawSource(path, shape, dtype, begin)


def open_tiff(path: Path) -> Source:
    """A source of the pages of a file."""
    layout = tiff.read_layout(path)
    shape, dtype, stored = tuple(layout["shape"]), np.dtype(layout["dtype"]), np.dtype(layout["stored"])
    begin, pages = layout["begin"], layout["pages"]
    source: Source
    if begin is not None:
        source = RawSource(path, shape, stored, begin)
    elif pages == shape[0]:
        source = PagesSource(path, shape, dtype)
    else:
        raise ValueError(f"expected a page for each of {shape[0]} slices, got {pages}")
    return _placed(source, path, layout["place"])


def open_tiff_folder(path: Path) -> Source:
    """A source of a folder of files of one page each."""
    found = tiff.find_slices(path)
    source = FilesSource([Path(file) for file in found["files"]], found["shape"], found["dtype"], tiff.read_slice)
    return _placed(source, path, found["place"])


def _placed(source, path, place):
    """A source of TIFF with its place; warns if the files lack some of it."""
    warn_of_place(path, place)
    if "spacing" in place:
        source.move(spacing=tuple(place["spacing"]), unit=name_of_unit(place["unit"]))
    return source


def open_dicom(path: Path, name: str | None) -> Source | None:
    """A source of a series with a file for each slice; None if a file has several."""
    found = dicom.find_slices(path, name)
    if found is None:
        return None
    source = FilesSource(found.files, found.shape, found.dtype, functools.partial(read_dicom_slice, found.dtype))
    return source.move(**found.frame, unit="millimeter")


def read_dicom_slice(dtype: np.dtype[Any], path: Path) -> NDArray[Any]:
    """The samples of a file with one slice, as the type of all slices."""
    check_file(path)
    return dicom.read_slice(path, dtype)
