"""Images of nibabel: NIfTI, MGH and others."""

from __future__ import annotations

from ..base.parameters import check_type
from ..io import nifti
from .checks import errors_name, library_of, to_volume


def volume_from_nibabel(cls, image, **options):
    """See `Volume.from_nibabel`."""
    with library_of("Volume.from_nibabel"):
        import nibabel
    check_type(image, "image", nibabel.spatialimages.SpatialImage, "an image of nibabel")
    with errors_name("image"):
        data = nifti.to_volume_data(image)
    return to_volume(cls, data, "image", options)
