"""Reading volumes of any format."""

from __future__ import annotations

import contextlib
import errno
import math
import numbers
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from ..base.mistakes import sentence
from ..base.parameters import check_integer, check_path, check_plain, number, printable
from ..base.signatures import explained
from . import arrays, dicom, metaimage, nifti, nrrd, tiff, vtk
from .checks import check_file
from .confinement import check_within
from .folders import tiff_slices
from .told import spacing_given
from .volume_data import VolumeData

#: Formats by the suffix of the file name: name, reader, and which options of `read_volume` the reader accepts.
FORMATS: dict[str, tuple[str, Any, tuple[str, ...]]] = {
    **dict.fromkeys(nifti.SUFFIXES, ("NIfTI", nifti.read, ())),
    **dict.fromkeys(nrrd.SUFFIXES, ("NRRD", nrrd.read, ("within",))),
    **dict.fromkeys(metaimage.SUFFIXES, ("MetaImage", metaimage.read, ("within",))),
    ".dcm": ("DICOM", dicom.read_file, ()),
    **dict.fromkeys(tiff.SUFFIXES, ("TIFF", tiff.read_file, ("within",))),
    ".vtk": ("legacy VTK", vtk.read_legacy, ("name",)),
    ".vti": ("VTK XML", vtk.read_xml, ("name",)),
    ".npy": ("NPY", arrays.read_npy, ()),
}

# Volumes that nibabel opens: of FreeSurfer, and pairs of Analyze and NIfTI.
_OF_NIBABEL = (".mgz", ".mgh", ".hdr", ".img", ".hdr.gz", ".img.gz")


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
    nan: float | None = None,
    within: str | os.PathLike[str] | None = None,
) -> VolumeData:
    """Read a volume from a file or a folder.

    ============================  =========================================================  ===========
    path                          format                                                     read by
    ============================  =========================================================  ===========
    ``.nii``, ``.nii.gz``         NIfTI                                                      nibabel
    ``.nrrd``, ``.nhdr``          NRRD                                                       SimpleITK
    ``.mha``, ``.mhd``            MetaImage                                                  SimpleITK
    folder, ``.dcm``              DICOM series, DICOM file                                   pydicom
    ``.tif``, ``.tiff``, folder   TIFF of several pages, a folder of slices                  tifffile
    ``.vtk``, ``.vti``            VTK image data, legacy and XML                             VTK
    ``.npy``                      NumPy array [z, y, x]                                      NumPy
    ``.raw``, any with a shape    headerless samples, x fastest                              NumPy
    ============================  =========================================================  ===========

    `Volume.from_nibabel` takes what nibabel reads besides: ``.mgz``, ``.mgh``, and pairs of ``.hdr`` and ``.img``.

    Spacing, origin and direction are those of the file. Medical formats have the world of DICOM and ITK, LPS: x, y and
    z run to the patient's left, back (posterior) and head (superior). NIfTI's world, as in nibabel, is RAS; the signs
    of its x and y change here, so that all formats agree, as in SimpleITK and 3D Slicer. Other formats have the world
    that their writer intended. Units are those of the file; in medicine, these are millimetres.

    Slices and frames of DICOM are sorted by their positions along their normal, and must be evenly spaced on a line.
    Each is scaled by its own slope and intercept: in float64, or as integers if all have the same whole numbers.
    Samples of MONOCHROME1, where small numbers are bright, are not inverted. Neither windows nor real-world value maps
    are applied.

    Parameters
    ----------
    path : str or path-like
        A file, or a folder that holds one DICOM series or one stack of TIFF slices. Beside DICOM files, one TIFF file
        is a stray picture and not read, and several are an error.
    shape : (int, int, int), optional
        Shape of the array, (nz, ny, nx). With a shape, a file with any suffix is read as raw. A name such as
        ``tooth_103x94x161_uint16.raw`` has the shape and the type, x first as in the command line's ``--shape``.
    dtype : dtype, optional
        Type of the samples of a raw file, with byte order: ``"<u2"`` is little-endian, ``">u2"`` big-endian.
    offset : int
        Bytes before the samples of a raw file.
    spacing, origin : (3,) float, optional
        Replace those of the file, (x, y, z); one number is the spacing along all axes.
    direction : (3, 3) float, optional
        Replaces that of the file; its columns are the directions of x, y and z.
    name : str, optional
        Name of the part to read: an array of a VTK file, or a Series Instance UID in a folder of DICOM files. Other
        formats have one array, and refuse a name.
    nan : float, optional
        Finite number in place of samples that are NaN, as outside of a mask; by default they stay, and models refuse
        them.
    within : str or path-like, optional
        A folder. The path, and every file that it refers to, must be in this folder after symbolic links are resolved;
        otherwise nothing of them is read. Set it for files from others, whose headers may name any file of yours. By
        default, a file may refer to any file.

    Returns
    -------
    VolumeData
        ``read_volume(path).to_volume()`` makes the model. Uncompressed NIfTI, .npy and raw files are mapped into
        memory.

    Warns
    -----
    UserWarning
        If neighbouring slices of a raw file differ so much that the shape is probably wrong, and if numbers are missing
        in the names of TIFF slices. Without `spacing`, also if DICOM has no spacing of pixels, or that of a detector,
        or neither positions nor a distance of frames; and if TIFF of OME, or slices of ImageJ, have no spacing along z,
        or other TIFF has resolution tags, which are not used.

    Raises
    ------
    OSError
        If the file is missing or cannot be read.
    ValueError
        If the file has none of these formats, is truncated or otherwise broken, or does not contain a volume of real
        numbers but colours, vectors, a flat picture or a time series. Also if a file is not `within` the folder, and
        for an invalid shape, place or `nan`. The message names the path or the parameter.
    MemoryError
        If the samples would not fit into memory; raised before they are read.
    ImportError
        If the library for the format is not installed; ``pip install isospline[io]`` installs all of them.

    Examples
    --------
    >>> import tempfile, numpy as np, isospline
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     np.arange(60, dtype="<u2").tofile(f"{folder}/ramp.raw")
    ...     isospline.read_volume(f"{folder}/ramp.raw", shape=(3, 4, 5), dtype="<u2", spacing=(1, 1, 2.5))
    VolumeData(shape=(3, 4, 5), dtype=uint16, spacing=(1.0, 1.0, 2.5), ..., format='raw', patient=False, unit='')
    """
    given = check_frame(spacing, origin, direction)
    check_nan(nan)
    shape = None if shape is None else arrays.check_shape(shape)
    check_integer(offset, "offset")
    check_path(path)
    if within is not None:
        check_path(within, "within")
    path = Path(path)
    check_within(path, within, "a path")
    format, read = _reader(path, shape, dtype, int(offset), {"name": name, "within": within})
    with errors_name(path, format):
        with spacing_given(spacing):
            volume = read(path)
        volume = volume.replace(format=volume.format or format)
        volume = volume.replace(**{field: value for field, value in given.items() if value is not None})
        _positive(_numbers(volume.spacing, "spacing", (3,)), "spacing")
        _numbers(volume.origin, "origin", (3,))
        _spanning(_numbers(volume.direction, "direction", (3, 3)), "direction")
    if nan is not None and volume.data.dtype.kind == "f":
        volume = volume.replace(data=without_nan(volume.data, nan))
    return volume


@contextlib.contextmanager
def errors_name(path: str | os.PathLike[str], format: str, extra: str = "io") -> Iterator[None]:
    """Name the path in exceptions; for a broken file, the exception becomes a ValueError."""
    try:
        yield
    except MemoryError as error:
        raise MemoryError(f"{printable(path)}: {error}") from error
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{printable(path)}: reading {format} needs the package {error.name}: pip install isospline[{extra}]",
            name=error.name,
        ) from error
    except Exception as error:
        if isinstance(error, OSError) and error.filename is not None:
            if os.path.isdir(path) or os.path.basename(error.filename) == os.path.basename(path):
                raise
            reason = f"{error.strerror}, for a file that {printable(os.path.basename(path))} names"
            raise OSError(error.errno, reason, error.filename) from error
        # A position outside of the file comes from its header, and is not a failure of the system.
        if isinstance(error, OSError) and error.errno not in (None, errno.EINVAL):
            raise OSError(error.errno, error.strerror, str(path)) from error
        # Libraries raise many kinds of exceptions for a broken file.
        raise ValueError(f"{printable(path)}: cannot be read as {format}: {_reason(error)}") from error


def check_nan(nan: float | None, dtype: np.dtype[Any] | None = None) -> None:
    """Check a number in place of NaN, of samples of a type if that is known; None leaves them."""
    if nan is None:
        return
    if not math.isfinite(number(nan, "nan")):
        raise ValueError(f"nan: expected a finite number in place of NaN, got {nan}")
    if dtype is not None and dtype.kind == "f" and abs(nan) > float(np.finfo(dtype).max):
        raise ValueError(f"nan: expected a number that {dtype.newbyteorder('=')} holds, got {nan}")


def without_nan(samples: NDArray[Any], nan: float) -> NDArray[Any]:
    """Samples of floating point, with a number in place of NaN."""
    check_nan(nan, samples.dtype)
    return np.where(np.isnan(samples), samples.dtype.type(nan), samples)


def check_frame(
    spacing: ArrayLike | None, origin: ArrayLike | None, direction: ArrayLike | None
) -> dict[str, ArrayLike | None]:
    """Check a place that replaces that of a file; None stays None."""
    for name, value in (("spacing", spacing), ("origin", origin), ("direction", direction)):
        check_plain(value, name)
    return {
        "spacing": None if spacing is None else _positive(_spacing(spacing), "spacing"),
        "origin": None if origin is None else _numbers(origin, "origin", (3,)),
        "direction": None if direction is None else _spanning(_numbers(direction, "direction", (3, 3)), "direction"),
    }


def check_used(
    path: str | os.PathLike[str],
    *,
    shape: Any = None,
    dtype: Any = None,
    offset: int = 0,
    name: str | None = None,
    has_names: bool = False,
) -> None:
    """Refuse options of `read_volume` that have no effect: folders are not raw, and few formats have named parts."""
    raw = {"shape": shape, "dtype": dtype, "offset": offset or None}
    if os.path.isdir(path):
        for option, value in raw.items():
            if value is not None:
                raise ValueError(f"{option}: expected none for the folder {printable(path)}, got {value}")
    elif shape is None and (dtype is not None or offset):
        raise ValueError("shape: expected the shape of a raw file with dtype and offset, got None")
    if name is not None and not has_names:
        raise ValueError(f"name: expected none for {printable(path)}, which has one array, got {name!r}")


def has_names(path: Path) -> bool:
    """Whether a file or a folder may have several named arrays."""
    if path.is_dir():
        return not tiff_slices(path)
    suffix = _suffix(path)
    return suffix is not None and "name" in FORMATS[suffix][2]


def _suffix(path):
    """The longest suffix of a known format, or None."""
    name = path.name.lower()
    return next((suffix for suffix in sorted(FORMATS, key=len, reverse=True) if name.endswith(suffix)), None)


def _reader(path, shape, dtype, offset, options):
    """Name of the format of a path, and the function that reads it."""
    raw, named = {"shape": shape, "dtype": dtype, "offset": offset}, {"name": options["name"]}
    if path.is_dir():
        if tiff_slices(path):
            check_used(path, **raw, **named)
            return "TIFF slices", lambda path: tiff.read_folder(path, within=options["within"])
        if (path / "zarr.json").is_file():
            raise ValueError(
                f"{printable(path)}: expected a file or a folder of images, got a folder of Zarr: open_volume opens a "
                f"store, and convert makes one of other samples"
            )
        if not dicom.may_have_slices(path):
            raise ValueError(
                f"{printable(path)}: expected a folder with a DICOM series or TIFF slices, got one without images"
            )
        check_used(path, **raw, **named, has_names=True)
        return "DICOM series", lambda path: dicom.read_folder(path, **options)
    check_file(path)
    with open(path, "rb") as file:
        beginning = file.read(132)

    file_name = path.name.lower()
    if shape is not None or file_name.endswith(".raw"):
        check_used(path, **named)
        return "raw", lambda path: arrays.read_raw(path, shape, dtype, offset)
    check_used(path, **raw, **named, has_names=has_names(path))
    suffix = _suffix(path)
    if suffix is None:
        if beginning[128:] == b"DICM":
            return "DICOM", dicom.read_file
        if file_name.endswith(_OF_NIBABEL):
            raise ValueError(
                f"{printable(path)}: expected another format, got one that nibabel reads: "
                f"isospline.Volume.from_nibabel(nibabel.load({printable(path)!r})), or convert it to .nii.gz"
            )
        raise ValueError(
            f"{printable(path)}: expected a name that ends in {', '.join(FORMATS)} or .raw, a DICOM file, a folder of "
            f"DICOM files or TIFF slices, or the shape and dtype of raw samples"
        )
    format, read, accepted = FORMATS[suffix]
    return format, lambda path: read(path, **{option: options[option] for option in accepted})


def _numbers(values, parameter, shape):
    """Finite numbers: an array, or a tuple of three."""
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise TypeError(sentence(parameter, f"finite numbers of shape {shape}", values)) from None
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"{parameter}: expected finite numbers of shape {shape}, got {array.tolist()}")
    return array if len(shape) > 1 else tuple(array.tolist())


def _spacing(values):
    """One number for all axes, or one each."""
    is_one = isinstance(values, numbers.Real) or getattr(values, "ndim", None) == 0
    return _numbers((values,) * 3 if is_one else values, "spacing", (3,))


def _positive(values, parameter):
    if min(values) <= 0:
        raise ValueError(f"{parameter}: expected positive numbers, got {values}")
    return values


def _spanning(matrix, parameter):
    if abs(np.linalg.det(matrix)) < 1e-6:
        raise ValueError(f"{parameter}: expected three directions that span space, got {matrix.tolist()}")
    return matrix


def _reason(error):
    """The last line of a library's message, without the position in the library's source."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1].removeprefix("sitk::ERROR: ") if lines else type(error).__name__
