"""Images of nibabel: NIfTI, MGH and others."""

from __future__ import annotations

from ..base.parameters import check_type
from ..io import nifti
from .checks import errors_name, library_of, to_volume


def volume_from_nibabel(cls, image, **options):
    """Model the samples of a nibabel image, at the positions given by its affine, in LPS.

    In the world of nibabel, x and y run to the patient's right and front (RAS). Both are negated here, as in
    `read_volume`, so that the volume has the same place as one from SimpleITK or DICOM:
    ``volume.affine == diag(-1, -1, 1, 1) @ image.affine``.

    Parameters
    ----------
    image : nibabel.spatialimages.SpatialImage
        With three axes and one real number a sample. Further axes of length one are dropped. Samples are scaled by the
        scaling in its header.
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
        If it is a series, has colours, has no affine, or has numbers that are not finite.
    ImportError
        If nibabel is not installed: ``pip install isospline[io]``.

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
