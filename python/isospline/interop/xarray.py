"""Arrays of xarray, whose coordinates give the place of the samples."""

from __future__ import annotations

import numpy as np

from ..base.parameters import check_type
from ..io.checks import check_samples
from ..io.volume_data import VolumeData
from .checks import errors_name, library_of, to_volume

# The largest deviation of a coordinate from an even series, as a fraction of a step; many are stored as decimal text.
TOLERANCE = 0.01


def volume_from_xarray(cls, array, dims=None, **options):
    """See `Volume.from_xarray`."""
    with library_of("Volume.from_xarray"):
        import xarray
    check_type(array, "array", xarray.DataArray, "an xarray.DataArray")
    dims = _spatial(array.dims) if dims is None else _given(array.dims, dims)
    with errors_name("array"):
        others = {dim: 0 for dim in array.dims if dim not in dims and array.sizes[dim] == 1}
        array = array.isel(others).transpose(..., *reversed(dims))
        check_samples(array.shape, array.dtype, mapped=True)
        first, step = np.transpose([_even(dim, array[dim].values) for dim in dims])
    # Descending coordinates mirror the axis.
    direction = _direction(array.attrs) * np.where(step < 0, -1.0, 1.0)
    data = VolumeData(array.values, tuple(np.abs(step).tolist()), tuple(first.tolist()), direction)
    return to_volume(cls, data, "array", options)


def _spatial(dims):
    """The dimensions called x, y and z."""
    by_name = {str(dim).lower(): dim for dim in dims}
    if not {"x", "y", "z"} <= set(by_name):
        raise ValueError(f"dims: expected the names of the dimensions along x, y and z, one of {dims} each, got none")
    return [by_name[name] for name in "xyz"]


def _given(dims, given):
    given = [given] if isinstance(given, str) else list(given)
    if len(given) != 3 or len(set(given)) != 3 or not set(given) <= set(dims):
        raise ValueError(f"dims: expected three dimensions of {dims}, along x, y and z, got {given}")
    return given


def _even(dim, coordinates):
    """First coordinate of a dimension, and the step from one to the next."""
    if coordinates.dtype.kind not in "iuf":
        raise ValueError(f"expected numbers as coordinates of {dim}, got {coordinates.dtype}")
    coordinates = coordinates.astype(float)
    count, finite = len(coordinates), np.isfinite(coordinates).all()
    step = (coordinates[-1] - coordinates[0]) / (count - 1) if finite and count > 1 else 1.0
    off = np.abs(coordinates - (coordinates[0] + np.arange(count) * step)) if finite else np.inf
    if step == 0 or np.max(off) > TOLERANCE * abs(step):
        got = np.array2string(coordinates, threshold=8)
        raise ValueError(f"expected finite and evenly spaced coordinates of {dim}, got {got}")
    return coordinates[0], step


def _direction(attributes):
    """ITK's direction matrix. Its rows and columns in xarray are in the order of the array's axes."""
    direction = attributes.get("direction")
    if np.shape(direction) not in ((3, 3), (4, 4)):
        return np.eye(3)
    return np.flip(np.asarray(direction, dtype=float))[:3, :3]
