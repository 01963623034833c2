"""The contents of a volume file."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from .. import _core
from ..base.handed import known
from ..base.parameters import check_plain, describe_not_finite
from ..base.shown import Shown
from ..base.signatures import explained_methods
from . import isolated
from .label_map import warn_of_labels
from .told import warn_of_place

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ..base.types import ModelOptions
    from ..scene import Volume


def affine_of(grid: Any) -> NDArray[np.float64]:
    """The (4, 4) matrix from index (x, y, z, 1) to world of what has a spacing, an origin and a direction."""
    affine = np.eye(4)
    affine[:3, :3] = grid.direction * grid.spacing
    affine[:3, 3] = grid.origin
    return affine


@explained_methods
@dataclass(frozen=True, eq=False)
class VolumeData(Shown):
    r"""Samples, and their place in the world.

    .. math:: \mathbf{x} = \mathbf{o} + D \, \mathrm{diag}(s) \, (i, j, k)^T

    is the world position of ``data[k, j, i]``, with the origin o, the direction D and the spacing s.

    Attributes
    ----------
    data : (nz, ny, nx) array
        The samples, in the type of the file. They may be mapped from the file and read-only.
    spacing : (3,) tuple of float, world units
        Distance between samples along x, y and z; one number is that of all three.
    origin : (3,) tuple of float, world units
        Position of the first sample.
    direction : (3, 3) float64 array
        Its columns are the directions of the axes x, y and z in the world, of unit length.
    format : str
        Name of the file's format.
    patient : bool
        Whether the file declares the world to be a patient's. Then x, y and z run to the left, to the back and to the
        head (LPS), in millimetres.
    unit : str
        Unit of world coordinates, such as "mm"; empty if the file does not tell it.

    Examples
    --------
    >>> import numpy as np
    >>> from isospline.io import VolumeData
    >>> VolumeData(np.zeros((8, 9, 10), np.uint8), spacing=(0.5, 0.5, 2)).position((4, 4, 4))
    array([2., 2., 8.])
    """

    data: NDArray[Any]
    spacing: tuple[float, float, float] = (1.0, 1.0, 1.0)
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    direction: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))
    format: str = ""
    patient: bool = False
    unit: str = ""

    def __post_init__(self) -> None:
        if not hasattr(self.data, "dtype"):
            raise TypeError(f"data: expected an array, got {type(self.data).__name__}")
        check_plain(self.data, "data")
        spacing = (self.spacing,) * 3 if np.ndim(self.spacing) == 0 else self.spacing
        for name, value, shape in (
            ("spacing", spacing, (3,)),
            ("origin", self.origin, (3,)),
            ("direction", self.direction, (3, 3)),
        ):
            numbers = _core._doubles(value, name, shape)
            object.__setattr__(self, name, tuple(numbers.tolist()) if shape == (3,) else numbers)
        if self.patient and not self.unit:
            object.__setattr__(self, "unit", "mm")

    @classmethod
    def from_affine(cls, data: NDArray[Any], affine: ArrayLike, format: str = "") -> VolumeData:
        """Split a (4, 4) or (3, 4) matrix from index (x, y, z, 1) to world into spacing, direction and origin.

        Raises
        ------
        ValueError
            For a matrix of another shape, numbers that are not finite, and a column of zeros.
        """
        try:
            whole = np.asarray(affine, dtype=float)
        except (TypeError, ValueError):
            raise TypeError(f"affine: expected a (4, 4) or (3, 4) matrix, got {type(affine).__name__}") from None
        if whole.shape not in ((4, 4), (3, 4)):
            raise ValueError(f"affine: expected a matrix of shape (4, 4) or (3, 4), got shape {whole.shape}")
        matrix = whole[:3, :3]
        spacing = np.linalg.norm(matrix, axis=0)
        if not (np.isfinite(whole).all() and spacing.all()):
            raise ValueError(f"affine: expected finite numbers and no column of zeros, got {whole.tolist()}")
        return cls(data, tuple(spacing.tolist()), tuple(whole[:3, 3].tolist()), matrix / spacing, format)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the samples, (nz, ny, nx)."""
        return tuple(self.data.shape)

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type of the samples."""
        return self.data.dtype

    @property
    def range(self) -> tuple[float, float]:
        """The smallest and the largest sample. All samples are read."""
        return float(np.min(self.data)), float(np.max(self.data))

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """The samples: ``numpy.asarray(data)`` is ``data.data``."""
        if copy is False and dtype is not None and np.dtype(dtype) != self.dtype:
            raise ValueError(f"copy: expected None or True for the type {np.dtype(dtype)}, got False")
        samples: NDArray[Any] = np.asarray(self.data)
        samples = samples if dtype is None else samples.astype(dtype, copy=False)
        return samples.copy() if copy and samples is self.data else samples

    @property
    def affine(self) -> NDArray[np.float64]:
        """(4, 4) float64 array: index (x, y, z, 1) to world."""
        return affine_of(self)

    def position(self, index: ArrayLike) -> NDArray[np.float64]:
        """World positions, (..., 3) float64 array, of (..., 3) indices (x, y, z), which need not be whole."""
        affine = self.affine
        return np.asarray(index, dtype=float) @ affine[:3, :3].T + affine[:3, 3]

    def replace(self, **fields: Any) -> VolumeData:
        """A copy with other values of some attributes."""
        return replace(self, **fields)

    def to_volume(self, **options: Unpack[ModelOptions]) -> Volume:
        """Model the samples: ``isospline.Volume(data.data, **{**data.frame, **options})``.

        Warns
        -----
        UserWarning
            If the samples look like labels of segments, whose isosurfaces mean nothing: use `Labels`.

        Raises
        ------
        ValueError, TypeError, MemoryError
            As `Volume` does.
        """
        samples = _core._as_array(self.data, "data")  # of Dask and xarray, once
        warn_of_labels(samples)
        try:
            return known("Volume")(samples, **{**self.frame, **options})
        except ValueError as error:
            if found := describe_not_finite(samples):
                hint = "; read_volume(path, nan=VALUE) replaces those that are NaN" if np.isnan(samples).any() else ""
                raise ValueError(f"data: expected finite samples, got {found}{hint}") from error
            raise

    def to_pyvista(self) -> Any:
        """Convert to PyVista's ImageData: the samples, as the point data "values".

        Returns
        -------
        pyvista.ImageData

        Raises
        ------
        ImportError
            If PyVista is not installed: ``pip install isospline[interop]``.
        """
        return known("volume_to_pyvista")(self)

    @property
    def frame(self) -> dict[str, Any]:
        """What determines the world of a `Volume`: spacing, origin, direction, unit and patient."""
        return {name: getattr(self, name) for name in ("spacing", "origin", "direction", "unit", "patient")}

    def __repr__(self) -> str:
        return (
            f"VolumeData(shape={self.data.shape}, dtype={self.data.dtype}, spacing={self.spacing}, "
            f"origin={self.origin}, direction={np.asarray(self.direction).tolist()}, format={self.format!r}, "
            f"patient={self.patient}, unit={self.unit!r})"
        )


def read_isolated(function: str, path: Path, libraries: str, **arguments: Any) -> VolumeData:
    """The `VolumeData` with the attributes that a function returns, called in a process of its own."""
    return volume_of(isolated.call(function, path, libraries, **arguments), path)


def volume_of(fields: dict[str, Any], path: Path) -> VolumeData:
    """The `VolumeData` with these attributes, after warnings that are among them."""
    warn_of_place(path, fields)
    place = {name: tuple(fields[name]) for name in ("spacing", "origin")}
    return VolumeData(**{**fields, **place})
