"""Derivatives by the samples of a volume: the transposed prefilter, as a method of `Volume`."""

from __future__ import annotations

import numpy as np

from . import _core
from .base.signatures import attach_methods, explained

__all__: list[str] = []


def adjoint(self, indices, weights):
    r"""Gradients by the samples, from gradients by the coefficients.

    The coefficients are a linear function of the samples, c = F s, with the prefilter F along each axis. This is the
    transposed function: the sums g of the weights of each coefficient, times F^T. For the boundary rule "mirror", F is
    not symmetric, but F^T = W F W^-1 with W = 1/2 at both ends of an axis and 1 elsewhere; for "periodic", F^T = F. So
    it takes as long as the prefilter itself.

    Parameters
    ----------
    indices : (...) int array
        Places of coefficients, x + nx (y + ny z), such as ``coefficient_indices`` of `Scene.cast_rays`. They are those
        in ``volume.coefficients.ravel("K")``.
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
    places, numbers = np.asarray(indices), np.asarray(weights, dtype=float)
    if places.dtype.kind not in "iu" and places.size:
        raise TypeError(f"indices: expected integers, got {places.dtype}")
    if places.shape != numbers.shape:
        raise ValueError(f"weights: expected the shape of indices, {places.shape}, got {numbers.shape}")
    size = int(np.prod(self.shape))
    if places.size and not (places.min() >= 0 and places.max() < size):
        raise ValueError(f"indices: expected places from 0 to {size - 1}, got {places.min()} to {places.max()}")
    if not np.isfinite(numbers).all():
        raise ValueError("weights: expected finite numbers, got some that are not")
    sums = np.bincount(places.reshape(-1).astype(np.intp), numbers.reshape(-1), size)
    sums = sums.reshape(self.shape, order="F" if self.axes == "xyz" else "C")
    if self.filter == "none" or not sums.any():
        return sums
    largest = np.abs(sums).max()
    scales = _mirrored_ends(self.shape) if self.boundary == "mirror" else 1.0
    options = {name: getattr(self, name) for name in ("degree", "boundary", "filter", "smoothing", "axes")}
    return _core.Volume(sums / largest / scales, **options).coefficients * scales * largest


def _mirrored_ends(shape):
    """W of the three axes: products of 1/2 at both ends of an axis and 1 elsewhere."""
    scales = np.ones(shape)
    for axis, count in enumerate(shape):
        if count > 1:
            np.moveaxis(scales, axis, 0)[[0, -1]] *= 0.5
    return scales


attach_methods(_core.Volume, explained, adjoint=adjoint)
