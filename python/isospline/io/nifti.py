"""NIfTI and the other formats of nibabel, read by nibabel.

ITK's reader is not used here: it pads truncated files with zeros, reads name.nii instead of name.nii.gz if both exist,
and refuses sheared axes.
"""

from __future__ import annotations

import gzip
import math
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import isolated
from .checks import check_components, check_samples, without_series
from .packed import check_skip, read_samples
from .volume_data import VolumeData

SUFFIXES = (".nii", ".nii.gz")
# The world of NIfTI is RAS, the world of DICOM and ITK is LPS.
LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])
# Suffixes of files that cannot be mapped into memory.
COMPRESSED = (".gz", ".mgz", ".bz2", ".zst")
# Units of NIfTI, by their names in nibabel.
_UNITS = {"meter": "m", "mm": "mm", "micron": "µm"}
# Bytes of the longer one of both headers, and of the beginning of a file that is searched for extensions.
_HEADER, _EXTENSIONS = 540, 1 << 20


class Header(NamedTuple):
    """What a header tells: shape [x, y, z, ...] and type of the samples, their first byte, their scaling and place."""

    shape: list[int]
    dtype: str
    begin: int
    slope: float
    inter: float
    affine: NDArray[np.float64]
    patient: bool
    unit: str


class Scaling:
    """The scaling of NIfTI, as in nibabel."""

    def __init__(self, slope: float, inter: float) -> None:
        self._slope, self._inter = np.float64(slope), np.float64(inter)

    def __call__(self, samples: NDArray[Any]) -> NDArray[Any]:
        from nibabel.volumeutils import apply_read_scaling

        return apply_read_scaling(samples, self._slope, self._inter)


def read(path, load=None):
    """Read a NIfTI file; its sform, or otherwise its qform, gives the place of the samples.

    `load`, if given, gets the path, the byte where the samples begin in the decompressed file, their shape [z, y, x]
    and type, their compression and their scaling, both None without, and returns the data.
    """
    header = Header(**isolated.call("isospline.io.nifti:load_header", Path(path), "nibabel"))
    compression = "gzip" if _is_compressed(path) else None
    scaling = Scaling(header.slope, header.inter) if (header.slope, header.inter) != (1, 0) else None
    shape, dtype = tuple(without_series(header.shape))[::-1], np.dtype(header.dtype)
    check_samples(shape, float if scaling else dtype, mapped=load or not (scaling or compression))
    if load is not None:
        data = load(path, header.begin, shape, dtype, compression, scaling)
    else:
        if compression is not None:
            data = read_samples([(path, 0, header.begin)], shape, dtype, compression)
        else:
            data = np.memmap(path, dtype, "c", header.begin, shape)
        data = data if scaling is None else scaling(data)
    data = VolumeData.from_affine(data, LPS_FROM_RAS @ header.affine)
    return data.replace(patient=header.patient, unit=header.unit)


def load_header(path):
    """The fields of a `Header`, for `isolated.call`."""
    header, _ = _beginning(path, _HEADER)
    shape, dtype, begin = header.get_data_shape(), header.get_data_dtype(), header.get_data_offset()
    # A pair's header without its samples; the header's bytes would be read as samples.
    if begin < header.template_dtype.itemsize:
        raise ValueError("expected samples after the header, got the header of a pair of files")
    check_components(len(dtype.names or "1"))
    expected = begin + math.prod(map(int, shape)) * dtype.itemsize
    if _is_compressed(path):
        check_skip(begin)
    elif (size := os.path.getsize(path)) < expected:
        raise ValueError(f"expected {expected} bytes, got {size} bytes: the file is truncated")
    slope, inter = header.get_slope_inter()
    return {
        "shape": [int(count) for count in shape],
        "dtype": dtype.str,
        "begin": int(begin),
        "slope": 1.0 if slope is None else float(slope),
        "inter": 0.0 if inter is None else float(inter),
        "affine": np.asarray(header.get_best_affine(), np.float64),
        **_about(header),
    }


def read_extensions(path):
    """The text of the extensions of a header, of at most 1 MiB."""
    return isolated.call("isospline.io.nifti:load_extensions", Path(path), "nibabel")


def load_extensions(path):
    """The same, for `isolated.call`."""
    header, content = _beginning(path, _EXTENSIONS)
    if content[:1] != b"\x01":
        return ""
    return content[4 : max(4, header.get_data_offset() - header.template_dtype.itemsize)].decode("utf-8", "replace")


def _beginning(path, count):
    """The header of a file, and what follows it in its first bytes: what comes later may expand to any size."""
    with (gzip.open if _is_compressed(path) else open)(path, "rb") as stream:
        content = stream.read(count)
    kind = next((kind.header_class for kind in _nifti_types() if kind.header_class.may_contain_header(content)), None)
    if kind is None:
        raise ValueError("expected a NIfTI file")
    size = kind.template_dtype.itemsize
    return kind(content[:size]), content[size:]


def _is_compressed(path):
    return str(path).lower().endswith(".gz")


def _nifti_types():
    import nibabel

    return nibabel.Nifti1Image, nibabel.Nifti2Image


def to_volume_data(image):
    """The samples and the place, in LPS, of any nibabel image; nibabel's world is RAS for all formats."""
    import nibabel

    stored = image.dataobj
    in_file = nibabel.is_proxy(stored)
    dtype = image.get_data_dtype() if in_file else stored.dtype
    check_components(len(dtype.names or "1"))
    if image.affine is None:
        raise ValueError("expected an affine, the place of the samples, got None")
    shape = without_series(image.shape)
    scaled = in_file and (getattr(stored, "slope", 1), getattr(stored, "inter", 0)) != (1, 0)
    compressed = in_file and str(image.get_filename()).lower().endswith(COMPRESSED)
    check_samples(shape[::-1], float if scaled else dtype, mapped=not (scaled or compressed))

    data = np.asanyarray(stored).reshape(shape, order="F").T
    # Formats that are not NIfTI have a patient's world.
    about = _about(image.header) if isinstance(image, _nifti_types()) else {"patient": True, "unit": ""}
    return VolumeData.from_affine(data, LPS_FROM_RAS @ image.affine).replace(**about)


def _about(header):
    """Whether the world is a patient's, by NIfTI's codes, and the unit of lengths."""
    patient = int(header["sform_code"]) > 0 or int(header["qform_code"]) > 0
    return {"patient": patient, "unit": _UNITS.get(header.get_xyzt_units()[0], "")}
