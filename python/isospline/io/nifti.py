"""NIfTI and the other formats of nibabel, read by nibabel.

ITK's reader is not used here: it pads truncated files with zeros, reads name.nii instead of name.nii.gz if both exist,
and refuses sheared axes.
"""

from __future__ import annotations

import gzip
import math
import os

import numpy as np

from .checks import check_components, check_samples
from .packed import drain
from .volume_data import VolumeData

# The world of NIfTI is RAS, the world of DICOM and ITK is LPS.
LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])
# Suffixes of files that cannot be mapped into memory.
COMPRESSED = (".gz", ".mgz", ".bz2", ".zst")
# Units of NIfTI, by their names in nibabel.
_UNITS = {"meter": "m", "mm": "mm", "micron": "µm"}
# Bytes of the longer one of both headers.
_HEADER = 540


def read(path, load=None):
    """Read a NIfTI file; its sform, or otherwise its qform, gives the place of the samples.

    `load`, if given, gets nibabel's proxy of the samples and their shape [x, y, z], and returns the data.
    """
    import nibabel

    if str(path).lower().endswith(".gz"):
        return _read_gzip(path, load)
    image = nibabel.load(path)
    if not isinstance(image, _nifti_types()):
        raise ValueError(f"expected a NIfTI file, got a {type(image).__name__}")
    # A pair's header without its samples; nibabel would read the header's bytes as samples.
    if image.dataobj.offset < image.header.template_dtype.itemsize:
        raise ValueError("expected samples after the header, got the header of a pair of files")
    # nibabel allocates memory for all samples in the header before it checks that they exist.
    expected = image.dataobj.offset + math.prod(image.shape) * image.get_data_dtype().itemsize
    if (size := os.path.getsize(path)) < expected:
        raise ValueError(f"expected {expected} bytes, got {size} bytes: the file is truncated")
    return to_volume_data(image, load)


def _read_gzip(path, load):
    """Read a compressed file to its end, where its checksum is: nibabel stops after the last sample."""
    import nibabel

    with gzip.open(path) as stream:
        beginning = stream.read(_HEADER)
        kind = next((kind for kind in _nifti_types() if kind.header_class.may_contain_header(beginning)), None)
        if kind is None:
            raise ValueError("expected a NIfTI file")
        stream.seek(0)
        data = to_volume_data(kind.from_file_map({"image": nibabel.FileHolder(str(path), stream)}), load)
        if load is None:
            drain(stream)
    return data


def _nifti_types():
    import nibabel

    return nibabel.Nifti1Image, nibabel.Nifti2Image


def to_volume_data(image, load=None):
    """The samples and the place, in LPS, of any nibabel image; nibabel's world is RAS for all formats."""
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
    check_samples(shape[::-1], float if scaled else dtype, mapped=load or not (scaled or compressed))

    data = load(stored, shape) if load else np.asanyarray(stored).reshape(shape, order="F").T
    patient, unit = _is_patient(image), ""
    if isinstance(image, _nifti_types()):
        unit = _UNITS.get(image.header.get_xyzt_units()[0], "")
    return VolumeData.from_affine(data, LPS_FROM_RAS @ image.affine).replace(patient=patient, unit=unit)


def _is_patient(image):
    """Whether the world is a patient's: by NIfTI's codes; always for the other formats that nibabel reads."""
    if not isinstance(image, _nifti_types()):
        return True
    return int(image.header["sform_code"]) > 0 or int(image.header["qform_code"]) > 0
