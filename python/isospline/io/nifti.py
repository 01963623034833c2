"""NIfTI, by nibabel.

ITK's reader is not used here: it fills up truncated files with zeros, prefers name.nii where it is asked for
name.nii.gz, and refuses sheared axes.
"""

from __future__ import annotations

import numpy as np

from .checks import check_components, check_samples
from .volume_data import VolumeData

# NIfTI's world is RAS, that of DICOM and ITK is LPS.
LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])


def read(path):
    """Read a NIfTI file; its sform, or else its qform, is the place of the samples."""
    import nibabel

    image = nibabel.load(path)
    if not isinstance(image, (nibabel.Nifti1Image, nibabel.Nifti2Image)):
        raise ValueError(f"expected a NIfTI file, got a {type(image).__name__}")
    dtype = image.get_data_dtype()
    check_components(len(dtype.names or "1"))
    # A single volume may be stored as a series of one.
    shape = image.shape[:3] if all(count == 1 for count in image.shape[3:]) else image.shape
    scaled = (image.dataobj.slope, image.dataobj.inter) != (1, 0)
    check_samples(shape[::-1], float if scaled else dtype, mapped=not scaled and path.suffix.lower() != ".gz")

    data = np.asanyarray(image.dataobj).reshape(shape, order="F").T
    return VolumeData.from_affine(data, LPS_FROM_RAS @ image.affine)
