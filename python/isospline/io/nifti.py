"""NIfTI, and what nibabel reads beside it, by nibabel.

ITK's reader is not used here: it fills up truncated files with zeros, prefers name.nii where it is asked for
name.nii.gz, and refuses sheared axes.
"""

from __future__ import annotations

import gzip
import math
import os

import numpy as np

from .checks import check_components, check_samples
from .packed import drain
from .volume_data import VolumeData

# NIfTI's world is RAS, that of DICOM and ITK is LPS.
LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])
# Suffixes of files that cannot be mapped into memory.
COMPRESSED = (".gz", ".mgz", ".bz2", ".zst")
# Bytes that the longer one of both headers has.
_HEADER = 540


def read(path):
    """Read a NIfTI file; its sform, or else its qform, is the place of the samples."""
    import nibabel

    if str(path).lower().endswith(".gz"):
        return _read_gzip(path)
    image = nibabel.load(path)
    if not isinstance(image, _nifti_types()):
        raise ValueError(f"expected a NIfTI file, got a {type(image).__name__}")
    # nibabel takes memory for all that the header tells of before it looks for it.
    expected = image.dataobj.offset + math.prod(image.shape) * image.get_data_dtype().itemsize
    if (size := os.path.getsize(path)) < expected:
        raise ValueError(f"expected {expected} bytes, got {size} bytes: the file is truncated")
    return to_volume_data(image)


def _read_gzip(path):
    """Read a compressed file to its end, where its checksum is: nibabel stops after the last sample."""
    import nibabel

    with gzip.open(path) as stream:
        beginning = stream.read(_HEADER)
        kind = next((kind for kind in _nifti_types() if kind.header_class.may_contain_header(beginning)), None)
        if kind is None:
            raise ValueError("expected a NIfTI file")
        stream.seek(0)
        data = to_volume_data(kind.from_file_map({"image": nibabel.FileHolder(str(path), stream)}))
        drain(stream)
    return data


def _nifti_types():
    import nibabel

    return nibabel.Nifti1Image, nibabel.Nifti2Image


def to_volume_data(image):
    """The samples and the place, in LPS, of any image of nibabel: its world is RAS whatever its format."""
    import nibabel

    stored = image.dataobj
    in_file = nibabel.is_proxy(stored)
    dtype = image.get_data_dtype() if in_file else stored.dtype
    check_components(len(dtype.names or "1"))
    if image.affine is None:
        raise ValueError("expected an affine, the place of the samples, got None")
    # A single volume may be stored as a series of one.
    shape = image.shape[:3] if all(count == 1 for count in image.shape[3:]) else image.shape
    scaled = in_file and (getattr(stored, "slope", 1), getattr(stored, "inter", 0)) != (1, 0)
    compressed = in_file and str(image.get_filename()).lower().endswith(COMPRESSED)
    check_samples(shape[::-1], float if scaled else dtype, mapped=not scaled and not compressed)

    data = np.asanyarray(stored).reshape(shape, order="F").T
    return VolumeData.from_affine(data, LPS_FROM_RAS @ image.affine)
