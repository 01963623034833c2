"""Images of SimpleITK."""

from __future__ import annotations

from ..base.parameters import check_type
from ..io import itk
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
