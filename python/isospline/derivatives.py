"""Gradients of what rays find: by levels, samples, placements and rays, in closed form, with NumPy alone."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core
from .base.signatures import attach_methods, explained

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

    from .base.results import Hits

__all__ = ["cast_vjp"]

_OF_T = ("dt_dlevel", "dt_dorigin", "dt_ddirection", "grazing", "coefficient_indices", "coefficient_weights")
_OF_NORMALS = ("dnormal_dlevel", "dnormal_dorigin", "dnormal_ddirection", "coefficient_gradients")


def cast_vjp(
    scene: _core.Scene,
    rays: ArrayLike,
    *,
    t_near: float = 0.0,
    t_far: float = inf,
    coherent: bool = False,
    normals: bool = False,
) -> tuple[Hits, Callable[..., dict[str, Any]]]:
    """First crossings of rays, and the function that takes gradients by them to gradients by what they depend on.

    It is the vector-Jacobian product, as in `jax.vjp`, of `Scene.cast_rays`: to be wrapped as a function of another
    library that differentiates. The derivatives are exact where the first crossing moves smoothly (docs/method.md,
    "Derivatives of hits"); those of the outline, where hits appear or are lost, are not in them.

    Parameters
    ----------
    scene : Scene
    rays : (..., 6) array_like
        As in `Scene.cast_rays`; the results are float64.
    t_near, t_far : float
        Only crossings with t in [t_near, t_far] count.
    coherent : bool
        As in `Scene.cast_rays`.
    normals : bool
        Whether gradients by normals will be given. This takes more memory.

    Returns
    -------
    hits : Hits
        With ``t_hit``, ``geometry_ids``, ``primitive_ids``, ``primitive_normals``, ``positions`` and derivatives.
    vjp : callable
        ``vjp(t_hit=None, primitive_normals=None, samples=True)`` takes the gradients of a number by ``t_hit``, (...),
        and by ``primitive_normals``, (..., 3). It returns its gradients as a dict: ``rays``, (..., 6); and by geometry
        id, ``levels``, floats; ``transforms``, (4, 4) arrays by the matrices of the objects; and ``samples``, arrays of
        the shape of the volume's data, if `samples` is true. Gradients of rays that miss or graze are ignored.

    Examples
    --------
    The level at which a ball has a radius of 0.6, from the depth of one pixel, by Newton's method:

    >>> import isospline
    >>> volume = isospline.volumes.sphere().volume(32)
    >>> surface = isospline.Isosurface(volume, 0.0)
    >>> for _ in range(4):
    ...     hits, vjp = isospline.derivatives.cast_vjp(isospline.Scene(surface), [(-3, 0, 0, 1, 0, 0)])
    ...     slope = vjp(t_hit=[1.0], samples=False)["levels"][0]
    ...     surface = surface.with_level(surface.level + (2.4 - hits.t_hit[0]) / slope)
    >>> bool(abs(hits.t_hit[0] - 2.4) < 1e-6)
    True
    """
    if not isinstance(scene, _core.Scene):
        raise TypeError(f"scene: expected a Scene, got {type(scene).__name__}")
    given = _core._as_array(rays, "rays").astype(float)  # a copy: the caller may change them before `vjp` is called
    parts = _OF_T + (_OF_NORMALS if normals else ())
    outputs: Any = ("t_hit", "geometry_ids", "primitive_ids", "primitive_normals", "positions", *parts)
    hits = scene.cast_rays(given, t_near=t_near, t_far=t_far, coherent=coherent, outputs=outputs)
    placed = {id: (item, transform) for id, item, transform, _ in scene._placed_objects()}

    def vjp(t_hit=None, primitive_normals=None, samples=True):
        of_t = _gradients("t_hit", t_hit, hits.t_hit.shape)
        if primitive_normals is not None and not normals:
            raise ValueError("primitive_normals: expected cast_vjp(..., normals=True) for it")
        moves = np.isfinite(hits.t_hit) & ~hits.grazing
        of_normals = _gradients("primitive_normals", primitive_normals, (*hits.t_hit.shape, 3))
        moving = _Parts(hits.select(moves), given[moves], of_t[moves], of_normals[moves] if normals else None)
        by_rays = np.zeros_like(given)
        by_rays[moves] = moving.by_rays()
        found: dict[str, Any] = {"rays": by_rays, "levels": {}, "transforms": {}, "samples": {}}
        for id, (item, transform) in placed.items():
            own = moving.of_object(id)
            found["transforms"][id] = own.by_transform(transform)
            if isinstance(item, _core.Isosurface):
                found["levels"][id] = float(own.by_level().sum())
                if samples:
                    found["samples"][id] = item.volume.adjoint(own.hits.coefficient_indices, own.by_coefficients())
        return found

    return hits, vjp


class _Parts:
    """Hits that move, their rays, and the gradients by t and by normals, (N) and (N, 3); None without normals."""

    def __init__(self, hits, rays, of_t, of_normals):
        self.hits, self.rays, self.of_t, self.of_normals = hits, rays, of_t, of_normals

    def of_object(self, id):
        own = self.hits.geometry_ids == id
        of_normals = None if self.of_normals is None else self.of_normals[own]
        return _Parts(self.hits.select(own), self.rays[own], self.of_t[own], of_normals)

    def by_rays(self):
        hits = self.hits
        found = self.of_t[:, None] * np.concatenate([hits.dt_dorigin, hits.dt_ddirection], axis=1)
        if self.of_normals is not None:
            by_parts = (hits.dnormal_dorigin, hits.dnormal_ddirection)
            found += np.concatenate([np.einsum("ni,nij->nj", self.of_normals, each) for each in by_parts], axis=1)
        return found

    def by_level(self):
        found = self.of_t * self.hits.dt_dlevel
        if self.of_normals is not None:
            found += (self.of_normals * self.hits.dnormal_dlevel).sum(1)
        return found

    def by_coefficients(self):
        """A coefficient moves a hit as the level does, the other way, by its weight; and it turns the gradient of f."""
        found = -self.by_level()[:, None] * self.hits.coefficient_weights
        if self.of_normals is not None:
            normals = self.hits.primitive_normals
            over_gradient = self.hits.dt_dlevel * (normals * self.rays[:, 3:]).sum(1)  # with the sign of the side
            across = over_gradient[:, None] * _across(normals, self.of_normals)
            found += np.einsum("ni,nki->nk", across, self.hits.coefficient_gradients)
        return found

    def by_transform(self, transform):
        """With the object's point y, the surface moves by dT y at a fixed ray, and normals turn by the inverse of T."""
        inverse = np.linalg.inv(transform)
        points = np.concatenate([self.hits.positions, np.ones((len(self.of_t), 1))], axis=1) @ inverse.T
        moved = self.of_t[:, None] * self.hits.dt_dorigin
        found = np.zeros((4, 4))
        if self.of_normals is not None:
            moved = moved + np.einsum("ni,nij->nj", self.of_normals, self.hits.dnormal_dorigin)
            normals = self.hits.primitive_normals
            found[:3, :3] = -normals.T @ (_across(normals, self.of_normals) @ inverse[:3, :3].T)
        found[:3] -= moved.T @ points
        return found


def _across(normals, vectors):
    """The parts of vectors perpendicular to normals."""
    return vectors - normals * (normals * vectors).sum(1, keepdims=True)


def _gradients(name, given, shape):
    if given is None:
        return np.zeros(shape)
    array = _core._as_array(given, name).astype(float)
    if array.shape != shape:
        raise ValueError(f"{name}: expected gradients of shape {shape}, got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name}: expected finite gradients, got some that are not")
    return array


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
    places, numbers = _core._as_array(indices, "indices"), _core._as_array(weights, "weights").astype(float)
    if places.dtype.kind not in "iu" and places.size:
        raise TypeError(f"indices: expected integers, got {places.dtype}")
    if places.shape != numbers.shape:
        raise ValueError(f"weights: expected the shape of indices, {places.shape}, got {numbers.shape}")
    size = int(np.prod(self.shape))
    if places.size and not (places.min() >= 0 and places.max() < size):
        raise ValueError(f"indices: expected places from 0 to {size - 1}, got {places.min()} to {places.max()}")
    sums = np.bincount(places.reshape(-1).astype(np.intp), numbers.reshape(-1), size)
    if not (np.isfinite(numbers).all() and np.isfinite(sums).all()):
        raise ValueError("weights: expected finite numbers with finite sums, got some that are not")
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
