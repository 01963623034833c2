"""Images of SimpleITK."""

from __future__ import annotations

from ..base.parameters import check_type
from ..io import itk
from .checks import errors_name, library_of, to_volume


def volume_from_sitk(cls, image, **options):
    """Model the samples of a SimpleITK image, at the positions of ``TransformContinuousIndexToPhysicalPoint``.

    Parameters
    ----------
    image : SimpleITK.Image
        With three axes and one real number a sample. Further axes of length one are dropped.
    **options
        Options of `Volume`, except the place: ``degree=3``.

    Returns
    -------
    Volume

    Raises
    ------
    TypeError
        If `image` is something else, and for an option that would change the place.
    ValueError
        If it has two axes or is a series, has colours, or has complex numbers or numbers that are not finite.
    ImportError
        If SimpleITK is not installed: ``pip install isospline[io]``.

    Examples
    --------
    >>> import SimpleITK, isospline
    >>> image = SimpleITK.Image(5, 4, 3, SimpleITK.sitkFloat32)
    >>> image.SetSpacing((0.5, 0.5, 2))
    >>> isospline.Volume.from_sitk(image, degree=3).spacing
    array([0.5, 0.5, 2. ])
    """
    with library_of("Volume.from_sitk"):
        import SimpleITK
    check_type(image, "image", SimpleITK.Image, "a SimpleITK.Image")
    with errors_name("image"):
        itk.check_image(image)
        data = itk.to_volume_data(image)
    return to_volume(cls, data, "image", options)
