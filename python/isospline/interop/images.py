"""Images of SimpleITK, and of nibabel: NIfTI, MGH and others."""

from __future__ import annotations

from ..base.parameters import check_type
from ..io import itk, nifti
from .checks import errors_name, library_of, to_volume


def volume_from_sitk(cls, image, **options):
    """See `Volume.from_sitk`."""
    with library_of("Volume.from_sitk"):
        import SimpleITK
    check_type(image, "image", SimpleITK.Image, "a SimpleITK.Image")
    with errors_name("image"):
        itk.check_image(image)
        data = itk.to_volume_data(image)
    return to_volume(cls, data, "image", options)


def volume_from_nibabel(cls, image, **options):
    """See `Volume.from_nibabel`."""
    with library_of("Volume.from_nibabel"):
        import nibabel
    check_type(image, "image", nibabel.spatialimages.SpatialImage, "an image of nibabel")
    with errors_name("image"):
        data = nifti.to_volume_data(image)
    return to_volume(cls, data, "image", options)
