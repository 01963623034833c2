"""Opens a path or an array as a source."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path
from typing import Any

import numpy as np

from ...base.mistakes import sentence
from ...base.parameters import check_path, check_plain, printable
from ...interop import checks
from ...io import VolumeData, metaimage, nifti, nrrd, read_volume, tiff
from ...io.checks import check_file
from ...io.folders import tiff_slices
from ...io.read import check_used, errors_name
from ..ome import name_of_unit
from . import ome_zarr, stacks
from .chunked import ORDERS, ChunkedSource, load
from .source import ArraySource, RawSource, Source, owner_of

#: Formats whose readers can return the samples' places in the file instead of the samples.
_LAZY = {
    nifti.SUFFIXES: ("NIfTI", lambda path: nifti.read(path, stacks.open_nifti)),
    nrrd.SUFFIXES: ("NRRD", lambda path: nrrd.read(path, stacks.open_packed)),
    metaimage.SUFFIXES: ("MetaImage", lambda path: metaimage.read(path, stacks.open_packed)),
}

_HDF5 = (".h5", ".hdf5", ".hdf", ".he5")


def open_source(given: Any, axes: str, reading: dict[str, Any]) -> Source:
    """The source for a path, for a result of `read_volume`, or for an array.

    Parameters
    ----------
    given : path, VolumeData or array-like
        The samples.
    axes : {"zyx", "xyz"}
        Order of the axes of an array, in memory or in a format that does not store it.
    reading : dict
        Options of `read_volume` for paths.
    """
    if isinstance(given, (str, os.PathLike)):
        return _of_path(given, axes, reading)
    if isinstance(given, VolumeData):
        with checks.errors_name("source"):
            return _of_volume_data(given)
    if not (hasattr(given, "shape") and hasattr(given, "dtype") and hasattr(given, "__getitem__")):
        raise TypeError(sentence("source", "a path, a VolumeData or an array with shape, dtype and slices", given))
    check_plain(given, "source")
    with checks.errors_name("source"):
        return _of_array(given, axes)


def _of_path(given, axes, reading):
    check_path(given)
    path, name = Path(given), reading["name"]
    within = re.fullmatch(rf"(.+({'|'.join(map(re.escape, _HDF5))})):/*(.*)", os.fspath(given), re.IGNORECASE)
    if within and not path.exists():
        check_used(given, **reading)
        path, name = Path(within[1]), within[3]
    if path.is_dir():
        return _of_folder(path, axes, reading)
    check_file(path)
    suffix = path.name.lower()
    if suffix.endswith(_HDF5) and reading["shape"] is None:
        check_used(path, **reading, has_names=True)
        with errors_name(path, "HDF5", "store"):
            return ChunkedSource(path, "hdf5", _dataset(path, name), ORDERS[axes])
    if suffix.endswith(".npy") and reading["shape"] is None:
        return _of_array(read_volume(path, **reading).data, axes)
    _check_axes(given, axes)
    if suffix.endswith(tiff.SUFFIXES) and reading["shape"] is None:
        check_used(path, **reading)
        with errors_name(path, "TIFF"):
            return stacks.open_tiff(path)
    for suffixes, (format, read) in _LAZY.items():
        if suffix.endswith(suffixes) and reading["shape"] is None:
            check_used(path, **reading)
            with errors_name(path, format):
                return _of_volume_data(read(path))
    return _of_volume_data(read_volume(path, **reading))


def _of_folder(path, axes, reading):
    name = reading["name"]
    check_used(path, **reading, has_names=True)
    if ome_zarr.is_zarr(path):
        with errors_name(path, "Zarr", "store"):
            return ome_zarr.open_zarr(path, name, axes)[0]
    _check_axes(path, axes)
    if ome_zarr.is_n5(path):
        with errors_name(path, "N5", "store"):
            return ome_zarr.open_n5(path, name)
    if tiff_slices(path):
        check_used(path, **reading)
        with errors_name(path, "TIFF slices"):
            return stacks.open_tiff_folder(path)
    with errors_name(path, "DICOM series"):
        series = stacks.open_dicom(path, name)
    return series or _of_volume_data(read_volume(path, **reading))


def _check_axes(path, axes):
    if axes != "zyx":
        raise ValueError(f'axes: expected "zyx" for {printable(path)}, a format that stores its axes, got "{axes}"')


def _dataset(path, name):
    """The dataset of a file with this name, or the only one of three dimensions."""
    if name:
        return name.strip("/")
    found = load("load_node", path, "hdf5", key="/")["arrays"]
    if len(found) != 1:
        raise ValueError(
            f"expected one dataset of three dimensions, or its name, {printable(path)}:/NAME, got "
            f"{', '.join(found) or 'none'}"
        )
    return found[0]


def _of_volume_data(data):
    source = data.data if isinstance(data.data, Source) else _of_array(data.data, "zyx")
    place = dict(spacing=data.spacing, origin=data.origin, direction=data.direction)
    return source.move(**place, unit=name_of_unit(data.unit), patient=data.patient)


def _of_array(array, axes):
    place = _place_in_file(array)
    if place is not None and axes == "zyx" and array.ndim == 3:
        return RawSource(place[0], array.shape, array.dtype, place[1])
    return ArraySource(array, axes)


def _place_in_file(array):
    """The file of a read-only memory-mapped array, and the array's offset in the file; None for other arrays."""
    owner = owner_of(array)
    if not (isinstance(owner, np.memmap) and owner.filename and owner.mode == "r" and array.flags.c_contiguous):
        return None
    within = array.__array_interface__["data"][0] - owner.__array_interface__["data"][0]
    if not 0 <= within <= owner.nbytes - math.prod(array.shape) * array.itemsize:
        return None
    return owner.filename, owner.offset + within
