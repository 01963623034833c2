"""Gradients of what rays find: by levels, samples, placements and rays, in closed form, with NumPy alone."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING, Any

from .. import _core
from ..scene import Scene
from .gradients import Gradients, Placed, are_moving, as_gradients, check_scene, outputs_of_hits

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

    from ..base.results import Hits


def cast_vjp(
    scene: Scene,
    rays: ArrayLike,
    *,
    t_near: float = 0.0,
    t_far: float = inf,
    coherent: bool | None = None,
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
    coherent : bool, optional
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
        the shape of the volume's data, if `samples` is true. Gradients of rays that miss or graze are ignored,
        NaN and inf as well.

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
    check_scene(scene)
    given = _core._as_array(rays, "rays").astype(float)  # a copy: the caller may change them before `vjp` is called
    outputs = outputs_of_hits(normals)
    hits = scene.cast_rays(given, t_near=t_near, t_far=t_far, coherent=coherent, outputs=outputs)
    shape, flat_rays = hits.t_hit.shape, given.reshape(-1, 6)
    # The caller may change these, too; those by coefficients, which take most of the memory, are not copied.
    kept = {name: each if name.startswith("coefficient_") else each.copy() for name, each in hits.items()}
    flat = type(hits)({name: each.reshape(len(flat_rays), *each.shape[len(shape) :]) for name, each in kept.items()})
    placed, moves = Placed(scene), are_moving(hits)

    def vjp(t_hit=None, primitive_normals=None, samples=True):
        of_t = as_gradients("t_hit", t_hit, shape, moves)
        if primitive_normals is not None and not normals:
            raise ValueError("primitive_normals: expected cast_vjp(..., normals=True) for it")
        of_normals = as_gradients("primitive_normals", primitive_normals, (*shape, 3), moves).reshape(-1, 3)
        found = Gradients(placed, samples)
        by_rays = found.add_hits(flat, flat_rays, of_t.reshape(-1), of_normals if normals else None)
        return {
            "rays": by_rays.reshape(given.shape),
            "levels": found.levels,
            "transforms": found.transforms,
            "samples": found.samples(),
        }

    return hits, vjp
