"""The model of a regular volume of samples."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ..base.parameters import check_plain
from ..base.shown import Shown
from .cells import VolumeCells
from .public import attributes_of, from_state, public
from .volume_conversions import VolumeConversions

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Self

    from ..base.results import Paging
    from ..base.types import Progress


@public
class Volume(VolumeCells, VolumeConversions, Shown):
    r"""A continuous model of a regular volume of samples.

    .. math:: f(\mathbf{x}) = \sum_{\mathbf{k}} c_{\mathbf{k}} \, \beta^n(\mathbf{x} - \mathbf{k})

    A recursive filter along each axis computes the coefficients c from the samples [1]_ [2]_. They are stored as
    float32. Samples sit at the voxels' centres; a position in the world is origin + direction @ (spacing * index), with
    index = (x, y, z).

    Parameters
    ----------
    data : (nz, ny, nx) array, or (nx, ny, nz) for axes="xyz"
        Finite samples of any boolean, integer or floating type, memory order and byte order. They are read in place;
        long double is converted to float64 first. An array of xarray with coordinates needs `from_xarray`.
    spacing : float or (3,) array_like, world units
        Distance between samples along x, y and z; one number for all three. Edges of voxels may be 1e-60 to 1e60.
    origin : (3,) array_like, world units
        Position of sample (0, 0, 0).
    direction : (3, 3) array_like, optional
        Its columns are the directions of the axes x, y and z in the world, as in ITK and VTK; linearly independent. By
        default, they are those of the world.
    degree : int
        Degree n of the B-spline, 0 to 5. Isosurfaces need 1, 2 or 3.
    boundary : {"mirror", "periodic"}
        How the samples continue outside of the volume, for the filter and for the model: symmetrically about the first
        and the last sample, or periodically (scipy.ndimage's "mirror" and "grid-wrap").
    filter : {"interpolate", "none", "smoothing"}
        "interpolate": the model passes through the samples. "none": the samples are used as coefficients, which smooths
        the model. "smoothing": along each axis, the spline of degree n that minimises

        .. math:: \sum_k (f(k) - s(k))^2 + \lambda \int \left(\frac{d^m s}{dx^m}\right)^2 dx,
                  \quad m = \lfloor n/2 \rfloor + 1

        with :math:`\lambda` = `smoothing` and x in samples. For degree 0, the roughness is the sum of the squared
        differences of neighbours.
    smoothing : float
        Weight of the roughness, 0 to 1e9; 0 unless filter="smoothing".
    axes : {"zyx", "xyz"}
        Order of the axes of `data`: "zyx" as in NumPy arrays from ITK, VTK, tifffile and zarr, "xyz" as in arrays from
        nibabel. Points, directions and spacing are always (x, y, z).
    unit : str
        Unit of world coordinates, such as "mm", for scale bars and tables.
    patient : bool
        Whether the world is a patient's: x, y and z run to the left, to the back and to the head (LPS).
    progress : callable, optional
        Called with the finished fraction; cancels if it returns a false value other than None.

    Raises
    ------
    TypeError
        For samples that are complex, objects or text.
    ValueError
        For samples that are not three-dimensional, empty, or not finite (the message names the first index), for an
        array of xarray with coordinates, and for any other parameter out of range.
    MemoryError
        Raised at the beginning if the coefficients would not fit into memory.

    References
    ----------
    .. [1] P. Thévenaz, M. Unser, "High-quality isosurface rendering with exact gradient", ICIP 2001.
    .. [2] M. Unser, A. Aldroubi, M. Eden, "B-spline signal processing: Parts I and II", IEEE Transactions on Signal
       Processing 41(2), 1993.

    Examples
    --------
    >>> import numpy as np
    >>> import isospline
    >>> z, y, x = np.mgrid[0:8, 0:9, 0:10].astype(np.float32)
    >>> volume = isospline.Volume(x + 10 * y, spacing=(0.5, 1, 1))
    >>> volume.shape
    (8, 9, 10)
    >>> volume.sample([[2.0, 3.0, 4.0]]).round(3)
    array([34.])
    >>> volume.sample([[2.0, 3.0, 4.0]], derivative=1).shape
    (1, 3)
    """

    __slots__ = ()

    def __init__(
        self,
        data: ArrayLike,
        *,
        spacing: ArrayLike = (1.0, 1.0, 1.0),
        origin: ArrayLike = (0.0, 0.0, 0.0),
        direction: ArrayLike | None = None,
        degree: int = 2,
        boundary: Literal["mirror", "periodic"] = "mirror",
        filter: Literal["interpolate", "none", "smoothing"] = "interpolate",
        smoothing: float = 0.0,
        axes: Literal["zyx", "xyz"] = "zyx",
        unit: str = "",
        patient: bool = False,
        progress: Progress = None,
    ) -> None:
        check_plain(data, "data")
        super().__init__(
            data, spacing, origin, direction, degree, boundary, filter, smoothing, axes, unit, patient, progress
        )

    def sample(self, points: ArrayLike, *, derivative: int = 0, progress: Progress = None) -> NDArray[np.float64]:
        """The model, or its derivatives, at points.

        Outside of the volume the model continues by its boundary rule. Points that are not finite give NaN.

        Parameters
        ----------
        points : (..., 3) float array, world units
            Positions x, y, z.
        derivative : {0, 1, 2}
            0 for values, 1 for gradients, 2 for Hessians, by world coordinates. For degree 0 all derivatives are zero;
            for degree 1, second derivatives along one axis of the volume are zero.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        (...), (..., 3) or (..., 3, 3) float64 array
            In values, values per world unit, or values per world unit squared.

        Raises
        ------
        ValueError
            For points of another shape, and another `derivative`.

        Examples
        --------
        >>> import numpy as np
        >>> import isospline
        >>> volume = isospline.Volume(np.eye(4)[:, :, None] * np.ones(5))
        >>> float(volume.sample([[2, 1, 1]])[0].round(6))
        1.0
        """
        return super().sample(points, derivative, progress)

    @property
    def coefficients(self) -> NDArray[np.float64]:
        """float64 array of the data's shape: exactly the coefficients of the model, in a new array. The volume stores
        them in float32, minus the middle of the data's range.
        """
        return super().coefficients

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of the data, in the order of its axes."""
        return super().shape

    @property
    def affine(self) -> NDArray[np.float64]:
        """(4, 4) float64 array: index (x, y, z, 1) to world."""
        return super().affine

    @property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) float64 array: lower and upper corner of the model's box in the world. It ends at the faces of
        the outer voxels for even degrees, at their centres for odd ones.
        """
        return super().bounds

    @property
    def spacing(self) -> NDArray[np.float64]:
        """(3,) float64 array: world units between samples along x, y and z."""
        return super().spacing

    @property
    def origin(self) -> NDArray[np.float64]:
        """(3,) float64 array: world position of sample (0, 0, 0)."""
        return super().origin

    @property
    def direction(self) -> NDArray[np.float64]:
        """(3, 3) float64 array: its columns are the directions of the axes x, y and z."""
        return super().direction

    @property
    def degree(self) -> int:
        """Degree of the B-spline."""
        return super().degree

    @property
    def boundary(self) -> Literal["mirror", "periodic"]:
        """How the samples continue outside of the volume: "mirror" or "periodic"."""
        return super().boundary

    @property
    def filter(self) -> Literal["interpolate", "none", "smoothing"]:
        """How the coefficients were computed from the samples: "interpolate", "none" or "smoothing"."""
        return super().filter

    @property
    def smoothing(self) -> float:
        """Weight of the roughness."""
        return super().smoothing

    @property
    def axes(self) -> Literal["zyx", "xyz"]:
        """Order of the data's axes: "zyx" or "xyz"."""
        return super().axes

    @property
    def unit(self) -> str:
        """Unit of world coordinates, such as "mm"; empty if it is not known."""
        return super().unit

    @property
    def patient(self) -> bool:
        """Whether the world is a patient's: x, y and z run to the left, to the back and to the head (LPS)."""
        return super().patient

    @property
    def minimum(self) -> float:
        """Smallest sample."""
        return super().minimum

    @property
    def maximum(self) -> float:
        """Largest sample."""
        return super().maximum

    @property
    def memory(self) -> int:
        """Bytes held by this object."""
        return super().memory

    @property
    def paging(self) -> Paging | None:
        """None for a volume in memory. For a volume opened from a store, a `Paging`: the folder
        of its array, memory_limit and memory in bytes, and counts since it was opened:
        bytes_read, chunks_read, bricks_made and bricks_dropped.
        """
        return super().paging

    def __reduce__(self) -> Any:
        return from_state, (type(self), self.__getstate__(), attributes_of(self))

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: Any) -> Self:
        return self
