"""NRRD and MetaImage, and what they have in common with DICOM: by SimpleITK."""

from __future__ import annotations

import contextlib
import math
import os

import numpy as np

from .checks import check_components, check_samples
from .volume_data import VolumeData

_TYPES = {
    "sitkUInt8": "u1", "sitkInt8": "i1", "sitkUInt16": "u2", "sitkInt16": "i2", "sitkUInt32": "u4", "sitkInt32": "i4",
    "sitkUInt64": "u8", "sitkInt64": "i8", "sitkFloat32": "f4", "sitkFloat64": "f8",
}  # fmt: skip


def read_nrrd(path):
    """Read a NRRD file, with its samples within or detached."""
    return _read(path, "NrrdImageIO")


def read_metaimage(path):
    """Read a MetaImage file, with its samples within or detached."""
    _check_metaimage_size(path)
    return _read(path, "MetaImageIO")


def _read(path, image_io):
    with quiet():
        reader = open_header(path, image_io)
        check_header(reader)
        return to_volume_data(reader.Execute())


def open_header(path, image_io):
    """A reader that has read the header of a file."""
    import SimpleITK

    reader = SimpleITK.ImageFileReader()
    reader.SetImageIO(image_io)
    reader.SetFileName(str(path))
    reader.ReadImageInformation()
    return reader


def check_header(reader, slices=1):
    """Check what the header says of the samples, `slices` times as many."""
    _check(reader.GetNumberOfComponents(), reader.GetPixelID(), reader.GetSize(), slices)


def check_image(image):
    """Check that an image is a volume of real numbers."""
    _check(image.GetNumberOfComponentsPerPixel(), image.GetPixelID(), image.GetSize())


def _check(components, pixel_id, size, slices=1):
    import SimpleITK

    check_components(components)
    dtype = next((dtype for name, dtype in _TYPES.items() if getattr(SimpleITK, name) == pixel_id), None)
    if dtype is None:
        raise ValueError(f"expected real numbers, got {SimpleITK.GetPixelIDValueAsString(pixel_id)}")
    shape = _spatial(size)[::-1]
    check_samples((shape[0] * slices, *shape[1:]), dtype)


def to_volume_data(image):
    """The samples and the place of an image of three axes, or of more that have one sample each."""
    import SimpleITK

    dimension = image.GetDimension()
    data = SimpleITK.GetArrayFromImage(image).reshape(image.GetSize()[2::-1])
    direction = np.reshape(image.GetDirection(), (dimension, dimension))[:3, :3]
    return VolumeData(data, image.GetSpacing()[:3], image.GetOrigin()[:3], direction)


def _spatial(size):
    """A single volume may be stored as a series of one."""
    return size[:3] if all(count == 1 for count in size[3:]) else size


@contextlib.contextmanager
def quiet():
    """Without ITK's warnings on the standard error stream."""
    import SimpleITK

    shown = SimpleITK.ProcessObject.GetGlobalWarningDisplay()
    SimpleITK.ProcessObject.SetGlobalWarningDisplay(False)
    try:
        yield
    finally:
        SimpleITK.ProcessObject.SetGlobalWarningDisplay(shown)


def _check_metaimage_size(path):
    """Look for as many bytes as the header tells of: ITK names another reason, and prints, where they are missing."""
    header, begin = {}, 0
    with open(path, "rb") as file:
        while "ElementDataFile" not in header:
            line = file.readline(4096)
            key, equals, value = line.decode("latin-1").partition("=")
            if not equals:
                raise ValueError("expected a header of lines 'Key = Value' that ends with ElementDataFile")
            header[key.strip()] = value.strip()
        begin = file.tell()

    name = header["ElementDataFile"]
    if name.split()[:1] == ["LIST"] or "%" in name:
        return
    if name.upper() == "LOCAL":
        got = os.path.getsize(path) - begin
    else:
        got = os.path.getsize(os.path.join(os.path.dirname(path), name))
    compressed = header.get("CompressedData", "False").lower() == "true"
    if compressed and "CompressedDataSize" not in header:
        return
    if compressed:
        expected = int(header["CompressedDataSize"])
    else:
        item = {"CHAR": 1, "SHORT": 2, "INT": 4, "LONG": 4, "FLOAT": 4, "DOUBLE": 8}
        kind = header.get("ElementType", "").upper().replace("MET_", "").replace("_ARRAY", "")
        item_size = 8 if "LONG_LONG" in kind else item.get(kind.lstrip("U"), 1)
        channels = int(header.get("ElementNumberOfChannels", 1))
        expected = math.prod(int(count) for count in header["DimSize"].split()) * item_size * channels
    if got < expected:
        raise ValueError(f"expected {expected} bytes of samples, got {got} bytes: the file is truncated")
