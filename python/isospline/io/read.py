"""Reading volumes of any format."""

from __future__ import annotations

import errno
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from ..parameters import check_path, printable
from ..signatures import explained
from . import arrays, dicom, metaimage, nifti, nrrd, tiff, vtk
from .checks import check_file
from .volume_data import VolumeData

#: Formats by the suffix of the file name: name, reader, and whether it takes the name of a part of the file.
FORMATS = {
    ".nii": ("NIfTI", nifti.read, False),
    ".nii.gz": ("NIfTI", nifti.read, False),
    ".nrrd": ("NRRD", nrrd.read, False),
    ".nhdr": ("NRRD", nrrd.read, False),
    ".mha": ("MetaImage", metaimage.read, False),
    ".mhd": ("MetaImage", metaimage.read, False),
    ".dcm": ("DICOM", dicom.read_file, False),
    ".tif": ("TIFF", tiff.read_file, False),
    ".tiff": ("TIFF", tiff.read_file, False),
    ".vtk": ("legacy VTK", vtk.read_legacy, True),
    ".vti": ("VTK XML", vtk.read_xml, True),
    ".npy": ("NPY", arrays.read_npy, False),
}


@explained
def read_volume(
    path: str | os.PathLike[str],
    *,
    shape: Sequence[int] | None = None,
    dtype: DTypeLike | None = None,
    offset: int = 0,
    spacing: ArrayLike | None = None,
    origin: ArrayLike | None = None,
    direction: ArrayLike | None = None,
    name: str | None = None,
) -> VolumeData:
    """Read a volume from a file or a folder.

    ============================  =========================================================  ===========
    path                          format                                                     read by
    ============================  =========================================================  ===========
    ``.nii``, ``.nii.gz``         NIfTI                                                      nibabel
    ``.nrrd``, ``.nhdr``          NRRD                                                       SimpleITK
    ``.mha``, ``.mhd``            MetaImage                                                  SimpleITK
    folder, ``.dcm``              DICOM series, DICOM file                                   SimpleITK
    ``.tif``, ``.tiff``, folder   TIFF of several pages, a folder of slices                  tifffile
    ``.vtk``, ``.vti``            VTK image data, legacy and XML                             VTK
    ``.npy``                      NumPy array [z, y, x]                                      NumPy
    ``.raw``, any with a shape    headerless samples, x fastest                              NumPy
    ============================  =========================================================  ===========

    Spacing, origin and direction are those of the file. The world of medical formats is that of DICOM and ITK, in
    which x, y and z run to the patient's left, back (posterior) and head (superior): LPS. NIfTI's world, as nibabel
    reports it, is RAS; its x and y change sign here, so that all formats agree, as in SimpleITK and in files that 3D
    Slicer saves. Other formats have whatever world their writer meant. Units are those of the file, in medicine
    millimetres.

    Parameters
    ----------
    path : str or path-like
        A file, or a folder that holds one DICOM series or one stack of TIFF slices.
    shape : (int, int, int), optional
        Of the array, (nz, ny, nx): the file is read as raw, whatever its suffix. A name such as
        ``tooth_103x94x161_uint16.raw`` tells shape and type by itself, x first, as the command line's ``--shape`` does.
    dtype : dtype, optional
        Of the samples of a raw file, with its byte order: ``"<u2"`` is little-endian, ``">u2"`` big-endian.
    offset : int
        Bytes before the samples of a raw file.
    spacing, origin : (3,) float, optional
        Instead of the file's, (x, y, z); one number is the spacing along all of them.
    direction : (3, 3) float, optional
        Instead of the file's; its columns are the directions of x, y and z.
    name : str, optional
        Which of several things to read: the array of a VTK file, the Series Instance UID in a folder of DICOM files.

    Returns
    -------
    VolumeData
        ``read_volume(path).to_volume()`` makes the model. Uncompressed NIfTI, .npy and raw files are mapped into memory
        instead of read.

    Warns
    -----
    UserWarning
        Where neighbouring slices of a raw file have so little in common that its shape is likely another.

    Raises
    ------
    OSError
        Where the file is missing or the system does not let it be read.
    ValueError
        Where the file is none of the formats, truncated or otherwise broken, or holds no volume of real numbers:
        colours, vectors, a flat picture, a time series. The message names the path.
    MemoryError
        Where the samples would not fit into memory, before they are read.
    ImportError
        Where the library that reads the format is not installed; ``pip install isospline[io]`` brings all of them.

    Examples
    --------
    >>> import tempfile, numpy as np, isospline
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     np.arange(60, dtype="<u2").tofile(f"{folder}/ramp.raw")
    ...     isospline.read_volume(f"{folder}/ramp.raw", shape=(3, 4, 5), dtype="<u2", spacing=(1, 1, 2.5))
    VolumeData(shape=(3, 4, 5), dtype=uint16, spacing=(1.0, 1.0, 2.5), ..., format='raw')
    """
    given = {
        "spacing": None if spacing is None else _positive(_spacing(spacing), "spacing"),
        "origin": None if origin is None else _numbers(origin, "origin", (3,)),
        "direction": None if direction is None else _spanning(_numbers(direction, "direction", (3, 3)), "direction"),
    }
    check_path(path)
    path = Path(path)
    format, read = _reader(path, shape, dtype, offset, name)
    try:
        volume = read(path)
        volume = volume.replace(format=volume.format or format)
        volume = volume.replace(**{field: value for field, value in given.items() if value is not None})
        _positive(_numbers(volume.spacing, "spacing", (3,)), "spacing")
        _numbers(volume.origin, "origin", (3,))
        _spanning(_numbers(volume.direction, "direction", (3, 3)), "direction")
        return volume
    except MemoryError as error:
        raise MemoryError(f"{printable(path)}: {error}") from error
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{printable(path)}: reading {format} needs the package {error.name}: pip install isospline[io]",
            name=error.name,
        ) from error
    except Exception as error:
        if isinstance(error, OSError) and error.filename is not None:
            raise
        # A place before or after all of the file, which its header names, is no failure of the system.
        if isinstance(error, OSError) and error.errno not in (None, errno.EINVAL):
            raise OSError(error.errno, error.strerror, str(path)) from error
        # The libraries raise what they like for a broken file.
        raise ValueError(f"{printable(path)}: cannot be read as {format}: {_reason(error)}") from error


def _reader(path, shape, dtype, offset, name):
    """Name of the format of a path, and the function that reads it."""
    if path.is_dir():
        if tiff.slices_of(path):
            return "TIFF slices", tiff.read_folder
        return "DICOM series", lambda path: dicom.read_folder(path, name)
    check_file(path)
    with open(path, "rb") as file:
        beginning = file.read(132)

    file_name = path.name.lower()
    suffix = next((suffix for suffix in sorted(FORMATS, key=len, reverse=True) if file_name.endswith(suffix)), None)
    if shape is not None or file_name.endswith(".raw"):
        return "raw", lambda path: arrays.read_raw(path, shape, dtype, offset)
    if dtype is not None or offset:
        raise ValueError("shape: expected the shape of a raw file beside dtype and offset, got None")
    if suffix is None:
        if beginning[128:] == b"DICM":
            return "DICOM", dicom.read_file
        raise ValueError(
            f"{printable(path)}: expected a name that ends in {', '.join(FORMATS)} or .raw, a DICOM file, a folder of "
            f"DICOM files or TIFF slices, or the shape and dtype of raw samples"
        )
    format, read, takes_name = FORMATS[suffix]
    return format, (lambda path: read(path, name)) if takes_name else read


def _numbers(values, parameter, shape):
    """Finite numbers: an array, or a tuple where they are three."""
    array = np.array(values, dtype=float)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"{parameter}: expected finite numbers of shape {shape}, got {array.tolist()}")
    return array if len(shape) > 1 else tuple(array.tolist())


def _spacing(values):
    """One number for all axes, or one each."""
    return _numbers(np.full(3, values) if np.ndim(values) == 0 else values, "spacing", (3,))


def _positive(values, parameter):
    if min(values) <= 0:
        raise ValueError(f"{parameter}: expected positive numbers, got {values}")
    return values


def _spanning(matrix, parameter):
    if abs(np.linalg.det(matrix)) < 1e-6:
        raise ValueError(f"{parameter}: expected three directions that span space, got {matrix.tolist()}")
    return matrix


def _reason(error):
    """The last line of a library's message, without its place in the library's source."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1].removeprefix("sitk::ERROR: ") if lines else type(error).__name__
