"""Volumes of other libraries."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import TYPE_CHECKING, Any

from .. import _core
from ..base.signatures import methods_of
from ..interop.images import volume_from_nibabel, volume_from_sitk
from ..interop.pyvista import volume_from_pyvista, volume_to_pyvista
from ..interop.vtk import volume_from_vtk
from ..interop.xarray import volume_from_xarray

if TYPE_CHECKING:
    from typing_extensions import Self, Unpack

    from ..base.types import ModelOptions


@methods_of("Volume")
class VolumeConversions(_core.Volume):
    """The part of `Volume` about other libraries."""

    __slots__ = ()

    @classmethod
    def from_nibabel(cls, image: object, **options: Unpack[ModelOptions]) -> Self:
        """Model the samples of a nibabel image, at the positions given by its affine, in LPS.

        In the world of nibabel, x and y run to the patient's right and front (RAS). Both are negated here, as in
        `read_volume`, so that the volume has the same place as one from SimpleITK or DICOM:
        ``volume.affine == diag(-1, -1, 1, 1) @ image.affine``.

        Parameters
        ----------
        image : nibabel.spatialimages.SpatialImage
            With three axes and one real number a sample. Further axes of length one are dropped. Samples are scaled by
            the scaling in its header.
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
        return volume_from_nibabel(cls, image, **options)

    @classmethod
    def from_pyvista(cls, image_data: object, scalars: str | None = None, **options: Unpack[ModelOptions]) -> Self:
        """Model an array of PyVista's ImageData, at the positions ``points``, or ``cell_centers()`` for cell data.

        Parameters
        ----------
        image_data : pyvista.ImageData
            With any offset, spacing, origin and direction matrix.
        scalars : str, optional
            Name of the array; by default ``image_data.active_scalars_name``.
        **options
            Options of `Volume`, except the place: ``degree=3``.

        Returns
        -------
        Volume

        Raises
        ------
        TypeError, ValueError, ImportError
            As in `Volume.from_vtk`.

        Examples
        --------
        >>> import pyvista, isospline
        >>> image = pyvista.ImageData(dimensions=(5, 4, 3), spacing=(0.5, 0.5, 2))
        >>> image["density"] = range(60)
        >>> float(isospline.Volume.from_pyvista(image).sample([0.5, 0, 2]).round(3))
        21.0
        """
        return volume_from_pyvista(cls, image_data, scalars, **options)

    @classmethod
    def from_sitk(cls, image: object, **options: Unpack[ModelOptions]) -> Self:
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
        return volume_from_sitk(cls, image, **options)

    @classmethod
    def from_vtk(cls, image_data: object, scalars: str | None = None, **options: Unpack[ModelOptions]) -> Self:
        """Model an array of VTK's image data, at the positions of ``GetPoint``.

        Parameters
        ----------
        image_data : vtkImageData
            With any extent, spacing, origin and direction matrix.
        scalars : str, optional
            Name of an array of point data or cell data; samples of cells are in their middle. By default the active
            scalars, otherwise the only array.
        **options
            Options of `Volume`, except the place: ``degree=3``.

        Returns
        -------
        Volume

        Raises
        ------
        TypeError
            If `image_data` is something else, and for an option that would change the place.
        ValueError
            If it has no such array, or the array has vectors or numbers that are not finite.
        ImportError
            If VTK is not installed: ``pip install isospline[io]``.

        Examples
        --------
        >>> import isospline
        >>> from vtkmodules.vtkCommonDataModel import vtkImageData
        >>> image = vtkImageData()
        >>> image.SetDimensions(5, 4, 3)
        >>> image.AllocateScalars(10, 1)
        >>> image.GetPointData().GetScalars().Fill(0)
        >>> isospline.Volume.from_vtk(image).shape
        (3, 4, 5)
        """
        return volume_from_vtk(cls, image_data, scalars, **options)

    @classmethod
    def from_xarray(
        cls, array: object, dims: Sequence[Hashable] | None = None, **options: Unpack[ModelOptions]
    ) -> Self:
        """Model an array of xarray, at the positions given by its coordinates.

        Coordinates may be ascending or descending; dimensions without coordinates count from 0. An attribute
        ``direction``, which ``itk.xarray_from_image`` stores in the order of the array's axes, rotates the axes about
        the first sample, as in ITK.

        Parameters
        ----------
        array : xarray.DataArray
            An array of real numbers. Dimensions other than x, y and z must have length one.
        dims : (str, str, str), optional
            Names of the dimensions along x, y and z; by default x, y and z in lower or upper case.
        **options
            Options of `Volume`, except the place: ``degree=3``.

        Returns
        -------
        Volume

        Raises
        ------
        TypeError
            If `array` is something else, such as a Dataset, and for an option that would change the place.
        ValueError
            If it lacks one of the dimensions or has more, if coordinates are not evenly spaced numbers, or if samples
            are complex or not finite.
        ImportError
            If xarray is not installed: ``pip install isospline[interop]``.

        Examples
        --------
        >>> import numpy as np, xarray, isospline
        >>> array = xarray.DataArray(np.zeros((3, 4, 5)), {"z": [10, 12, 14]}, ("z", "y", "x"))
        >>> volume = isospline.Volume.from_xarray(array)
        >>> volume.spacing, volume.origin
        (array([1., 1., 2.]), array([ 0.,  0., 10.]))
        """
        return volume_from_xarray(cls, array, dims, **options)

    def to_pyvista(self) -> Any:
        """Convert to PyVista's ImageData: the values at the samples, as the point data "values".

        Of a `Volume`, these are the values of its model. They equal the samples if it interpolates them.

        Returns
        -------
        pyvista.ImageData

        Raises
        ------
        ImportError
            If PyVista is not installed: ``pip install isospline[interop]``.

        Examples
        --------
        >>> import isospline
        >>> field = isospline.volumes.torus()
        >>> grid = field.volume(8).to_pyvista()
        >>> grid.dimensions, round(grid.spacing[0], 3)
        ((8, 8, 8), 0.25)
        """
        return volume_to_pyvista(self)
