"""Functions of SimpleITK that NRRD and MetaImage share."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from . import isolated
from .checks import check_components, check_samples, utf8, without_series
from .volume_data import VolumeData

_TYPES = {
    "sitkUInt8": "u1",
    "sitkInt8": "i1",
    "sitkUInt16": "u2",
    "sitkInt16": "i2",
    "sitkUInt32": "u4",
    "sitkInt32": "i4",
    "sitkUInt64": "u8",
    "sitkInt64": "i8",
    "sitkFloat32": "f4",
    "sitkFloat64": "f8",
}


def open_header(path, image_io):
    """A reader that has read the header of a file."""
    import SimpleITK

    reader = SimpleITK.ImageFileReader()
    reader.SetImageIO(image_io)
    reader.SetFileName(utf8(path))
    reader.ReadImageInformation()
    return reader


class Header(NamedTuple):
    """What a header tells of an image: numbers of samples, their dtype, and its place; x first."""

    size: list[int]
    dtype: str
    spacing: list[float]
    origin: list[float]
    direction: list[float]

    def to_volume_data(self, data: Any) -> VolumeData:
        """Samples at the place of the first three axes."""
        dimension = len(self.size)
        direction = np.reshape(self.direction, (dimension, dimension))[:3, :3]
        (sx, sy, sz), (x, y, z) = self.spacing[:3], self.origin[:3]
        return VolumeData(data, (sx, sy, sz), (x, y, z), direction)


def read_header(path, image_io, slices=1, mapped=False):
    """Read a header in a process of its own, and check the samples' shape and type.

    There are `slices` times as many samples; `mapped` ones need no memory.
    """
    fields = isolated.call(
        "isospline.io.itk:load_header", Path(path), "SimpleITK", image_io=image_io, slices=slices, mapped=mapped
    )
    return Header(**fields)


def load_header(path, image_io, slices, mapped):
    """The fields of the header of a file, for `isolated.call`."""
    import SimpleITK

    SimpleITK.ProcessObject.SetGlobalWarningDisplay(False)  # on standard error
    reader = open_header(path, image_io)
    _check(reader.GetNumberOfComponents(), reader.GetPixelID(), reader.GetSize(), slices, mapped)
    return {
        "size": list(reader.GetSize()),
        "dtype": dtype_of(reader.GetPixelID()).str,
        "spacing": list(reader.GetSpacing()),
        "origin": list(reader.GetOrigin()),
        "direction": list(reader.GetDirection()),
    }


def check_image(image):
    """Check that an image is a volume of real numbers."""
    _check(image.GetNumberOfComponentsPerPixel(), image.GetPixelID(), image.GetSize())


def dtype_of(pixel_id):
    """The dtype of real samples."""
    import SimpleITK

    dtype = next((dtype for name, dtype in _TYPES.items() if getattr(SimpleITK, name) == pixel_id), None)
    if dtype is None:
        raise ValueError(f"expected real numbers, got {SimpleITK.GetPixelIDValueAsString(pixel_id)}")
    return np.dtype(dtype)


def _check(components, pixel_id, size, slices=1, mapped=False):
    check_components(components)
    shape = without_series(size)[::-1]
    check_samples((shape[0] * slices, *shape[1:]), dtype_of(pixel_id), mapped=mapped)


def to_volume_data(image):
    """The samples and the place of an image with three axes. Further axes must have one sample each."""
    import SimpleITK

    data = SimpleITK.GetArrayFromImage(image).reshape(image.GetSize()[2::-1])
    place = image.GetSpacing(), image.GetOrigin(), image.GetDirection()
    return Header(image.GetSize(), data.dtype.str, *place).to_volume_data(data)
