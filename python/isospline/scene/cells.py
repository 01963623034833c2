"""The cells of a volume, and the weights of its coefficients."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..base.handed import known
from ..base.signatures import methods_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ..base.types import Progress


@methods_of("Volume")
class VolumeCells(_core.Volume):
    """The part of `Volume` about its cells."""

    __slots__ = ()

    @property
    def cell_count(self) -> int:
        """Number of cells. Primitive ids of cells are below it, those of caps are not."""
        return super().cell_count

    def cell_at(self, primitive_ids: ArrayLike) -> NDArray[np.int32]:
        """The cells of primitive ids.

        A cell is a unit cube in which the model is one polynomial: centred on the sample (x, y, z) for even degrees,
        from there to (x + 1, y + 1, z + 1) for odd ones. Its primitive id is its place in the grid of all cells, x
        varying fastest: ``x + nx * (y + ny * z)``, with as many cells as samples along each axis for even degrees, and
        one fewer for odd ones. It is the same for every level and every surface of the volume.

        Parameters
        ----------
        primitive_ids : (...) integer array
            Ids below `cell_count`, so neither misses nor caps.

        Returns
        -------
        (..., 3) int32 array
            x, y and z of each cell.

        Raises
        ------
        ValueError
            For an id that does not belong to a cell, such as that of a cap or of a miss.
        TypeError
            For ids that are not integers.

        Examples
        --------
        >>> import isospline
        >>> field = isospline.volumes.sphere(0.7)
        >>> volume = field.volume(32)
        >>> hits = isospline.Scene([isospline.Isosurface(volume, field.level)]).cast_rays([(0.1, -2, 0.2, 0, 1, 0)])
        >>> volume.cell_at(hits["primitive_ids"])
        array([[17,  5, 19]], dtype=int32)
        """
        return super().cell_at(primitive_ids)

    def primitive_id(self, cells: ArrayLike) -> NDArray[np.uint64]:
        """The primitive ids of cells: the inverse of `cell_at`.

        Parameters
        ----------
        cells : (..., 3) integer array
            x, y and z of each cell, such as `Shell.cells`.

        Returns
        -------
        (...) uint64 array

        Raises
        ------
        ValueError
            For a cell outside of the volume, and for another shape.
        TypeError
            For indices that are not integers.

        Examples
        --------
        >>> import numpy as np
        >>> import isospline
        >>> volume = isospline.Volume(np.zeros((5, 6, 7)))
        >>> volume.primitive_id([(6, 5, 4), (1, 2, 3)])
        array([209, 141], dtype=uint64)
        """
        return super().primitive_id(cells)

    def coefficient_weights(
        self, points: ArrayLike, *, progress: Progress = None
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """The model at points as weighted sums of coefficients.

        f(x) is the sum of the weights times ``volume.coefficients.ravel("K")[indices]``. So it is for the gradient,
        with gradients for weights.

        Parameters
        ----------
        points : (..., 3) float array, world units
            Positions x, y, z. Outside of the volume the model continues by its boundary rule.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        indices : (..., (n+1)^3) int64 array
            Places of coefficients, x + nx (y + ny z), for a volume of degree n. Beyond the border, one of them may
            occur more than once.
        weights : (..., (n+1)^3) float64 array
            The B-splines at the points; their sum is 1.
        gradients : (..., (n+1)^3, 3) float64 array
            Their gradients by world coordinates.

        Raises
        ------
        ValueError
            For points of another shape, for points that are not finite, and for points more than 1e9 voxels away.

        Examples
        --------
        >>> import numpy as np
        >>> import isospline
        >>> volume = isospline.volumes.sphere().volume(16)
        >>> points = np.array([(0.1, 0.2, 0.3), (0.5, 0.0, -0.25)])
        >>> indices, weights, gradients = volume.coefficient_weights(points)
        >>> values = (weights * volume.coefficients.ravel("K")[indices]).sum(axis=-1)
        >>> bool(abs(values - volume.sample(points)).max() < 1e-6)
        True
        """
        return super().coefficient_weights(points, progress)

    def adjoint(self, indices: ArrayLike, weights: ArrayLike) -> NDArray[np.float64]:
        r"""Gradients by the samples, from gradients by the coefficients.

        The coefficients are a linear function of the samples, c = F s, with the prefilter F along each axis. This is
        the transposed function: the sums g of the weights of each coefficient, times F^T. For the boundary rule
        "mirror", F is not symmetric, but F^T = W F W^-1 with W = 1/2 at both ends of an axis and 1 elsewhere; for
        "periodic", F^T = F. So it takes as long as the prefilter itself.

        Parameters
        ----------
        indices : (...) int array
            Places of coefficients, x + nx (y + ny z), such as ``coefficient_indices`` of `Scene.cast_rays`. They are
            those in ``volume.coefficients.ravel("K")``.
        weights : (...) float array
            Of the same shape: the gradient by each of them. Those of one place are added.

        Returns
        -------
        float64 array of the data's shape
            The gradient by each sample, to the precision of float32 relative to the largest one.

        Raises
        ------
        ValueError
            If an index is not one of the volume, the shapes differ, or a weight is not finite.
        TypeError
            If `indices` does not hold integers.

        Examples
        --------
        The derivative of t at one hit by all samples, -weight / <gradient, direction>:

        >>> import numpy as np
        >>> import isospline
        >>> field = isospline.volumes.sphere()
        >>> volume = field.volume(16)
        >>> scene = isospline.Scene(isospline.Isosurface(volume, field.level))
        >>> outputs = ("dt_dlevel", "coefficient_indices", "coefficient_weights")
        >>> hit = scene.cast_rays([(-3, 0, 0, 1, 0, 0)], outputs=outputs)
        >>> by_coefficients = -hit.dt_dlevel[:, None] * hit.coefficient_weights
        >>> by_samples = volume.adjoint(hit.coefficient_indices, by_coefficients)
        >>> bool(abs(by_samples.sum() + hit.dt_dlevel[0]) < 1e-4)  # all samples and the level, together
        True
        """
        places, numbers = _core._as_array(indices, "indices"), _core._as_array(weights, "weights").astype(float)
        if places.dtype.kind not in "iu" and places.size:
            raise TypeError(f"indices: expected integers, got {places.dtype}")
        if places.shape != numbers.shape:
            raise ValueError(f"weights: expected the shape of indices, {places.shape}, got {numbers.shape}")
        size = int(np.prod(self.shape))
        if places.size and not (places.min() >= 0 and places.max() < size):
            raise ValueError(f"indices: expected places from 0 to {size - 1}, got {places.min()} to {places.max()}")
        sums: Any = np.bincount(places.reshape(-1).astype(np.intp), numbers.reshape(-1), size)
        if not (np.isfinite(numbers).all() and np.isfinite(sums).all()):
            raise ValueError("weights: expected finite numbers with finite sums, got some that are not")
        return self._by_samples(sums)

    def _by_samples(self, by_coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gradients by the samples, from those by all coefficients, x fastest: the transposed prefilter."""
        sums = by_coefficients.reshape(self.shape, order="F" if self.axes == "xyz" else "C")
        if self.filter == "none" or not sums.any():
            return sums
        largest = np.abs(sums).max()
        scales = _mirrored_ends(self.shape) if self.boundary == "mirror" else 1.0
        options = {name: getattr(self, name) for name in ("degree", "boundary", "filter", "smoothing", "axes")}
        return known("Volume")(sums / largest / scales, **options).coefficients * scales * largest


def index_shape(volume):
    """The numbers of samples of a volume along x, y and z."""
    return volume.shape[::-1] if volume.axes == "zyx" else volume.shape


def cell_shift(volume):
    """What added to index coordinates makes the corners of cells whole: samples are in the middle for even degrees."""
    return 0.5 if volume.degree % 2 == 0 else 0.0


def _mirrored_ends(shape):
    """W of the three axes: products of 1/2 at both ends of an axis and 1 elsewhere."""
    scales = np.ones(shape)
    for axis, count in enumerate(shape):
        if count > 1:
            np.moveaxis(scales, axis, 0)[[0, -1]] *= 0.5
    return scales
