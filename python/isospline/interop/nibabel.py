"""Images of nibabel: NIfTI, MGH and others."""

from __future__ import annotations

from ..io import nifti
from ..parameters import check_type
from .checks import errors_name, library_of, to_volume


def volume_from_nibabel(cls, image, **options):
    """Model the samples of a nibabel image, where its affine puts them, in LPS.

    The affine of nibabel leads to a world whose x and y run to the patient's right and front (RAS). As `read_volume`
    does, this negates both, so that the volume lies where one from SimpleITK or DICOM lies:
    ``volume.affine == diag(-1, -1, 1, 1) @ image.affine``.

    Parameters
    ----------
    image : nibabel.spatialimages.SpatialImage
        Of three axes and one real number a sample. Later axes of length one are dropped. Samples are scaled as its
        header says.
    **options
        Of `Volume`, but for the place: ``degree=3``.

    Returns
    -------
    Volume

    Raises
    ------
    TypeError
        Where `image` is something else.
    ValueError
        Where it is a series or in colours, has no affine, or holds numbers that are not finite.
    ImportError
        Where nibabel is not installed: ``pip install isospline[io]``.

    Examples
    --------
    >>> import nibabel, numpy as np, isospline
    >>> image = nibabel.Nifti1Image(np.zeros((5, 4, 3), np.float32), np.diag([2, 2, 3, 1]))
    >>> isospline.Volume.from_nibabel(image).affine.diagonal()
    array([-2., -2.,  3.,  1.])
    """
    with library_of("Volume.from_nibabel"):
        import nibabel
    check_type(image, "image", nibabel.spatialimages.SpatialImage, "an image of nibabel")
    with errors_name("image"):
        data = nifti.to_volume_data(image)
    return to_volume(cls, data, "image", options)
