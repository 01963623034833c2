"""Derivatives of volume and area, and of distances."""

from __future__ import annotations

import itertools
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..scene import Isosurface, Scene
from ..scene.cells import index_shape
from .gradients import Gradients, Placed, as_gradients, check_scene

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray


def measure_vjp(
    surface: Isosurface, *, order: int = 4, progress: Callable[[float], object] | bool | None = None
) -> tuple[dict[str, float], Callable[..., dict[str, Any]]]:
    """The volume and the area of the solid that a surface bounds, and their vector-Jacobian product.

    Let n be the unit normal, along the gradient, and B the B-spline of a coefficient. With the solid f >= level, the
    derivative of the volume by the coefficient is the integral of B over the gradient's length. That of the area is the
    integral of -B div(n) over this length, with integrals along the edges of cuts: docs/method.md, "Derivatives of
    measures".

    Parameters
    ----------
    surface : Isosurface
    order : int
        Nodes of Gauss-Legendre rules along each axis of a cell, 2 to 10, as in `Isosurface.enclosed_volume`.
    progress : callable, optional
        Called with the finished fraction of each integral; cancels if it returns a false value other than None.

    Returns
    -------
    measures : dict
        ``enclosed_volume`` and ``area``, floats, world units cubed and squared: those of the methods of these names.
    vjp : callable
        ``vjp(enclosed_volume=0.0, area=0.0, samples=True)`` takes the gradients of a number by them. It returns its
        gradients as a dict: ``level``, a float; and ``samples``, an array of the shape of the volume's data, if
        `samples` is true.

    Raises
    ------
    ValueError
        For an order out of range; and by `vjp` for the gradient of an area at degree 1, whose surfaces have creases.
    TypeError
        If `surface` is not an `Isosurface`.

    Notes
    -----
    Gradients have no stated error. That of the area converges slowly with `order` where the surface is near a point at
    which the gradient of f is zero, as at levels at which parts join: compare two orders.

    Examples
    --------
    The level at which a ball has a volume of 1, by Newton's method:

    >>> import isospline
    >>> surface = isospline.Isosurface(isospline.volumes.sphere().volume(32), 0.0)
    >>> for _ in range(4):
    ...     measures, vjp = isospline.derivatives.measure_vjp(surface)
    ...     slope = vjp(enclosed_volume=1.0, samples=False)["level"]
    ...     surface = surface.with_level(surface.level + (1.0 - measures["enclosed_volume"]) / slope)
    >>> bool(abs(measures["enclosed_volume"] - 1.0) < 1e-6)
    True
    """
    if not isinstance(surface, Isosurface):
        raise TypeError(f"surface: expected an Isosurface, got {type(surface).__name__}")
    fixed = surface.with_level(surface.level)  # the caller may set another level before `vjp` is called
    measures = {
        "enclosed_volume": fixed.enclosed_volume(order=order, progress=progress).value,
        "area": fixed.area(order=order, progress=progress).value,
    }

    def vjp(enclosed_volume=0.0, area=0.0, samples=True):
        by_volume = float(as_gradients("enclosed_volume", enclosed_volume, ()))
        by_area = float(as_gradients("area", area, ()))
        by_level, by_coefficients = fixed._measure_gradient(by_volume, by_area, order, samples, progress)
        found: dict[str, Any] = {"level": by_level}
        if by_coefficients is not None:
            found["samples"] = fixed.volume._by_samples(by_coefficients.ravel("K"))
        return found

    return measures, vjp


def distance_vjp(
    scene: Scene, points: ArrayLike, *, max_distance: float = inf
) -> tuple[NDArray[np.float64], Callable[..., dict[str, Any]]]:
    """Signed distances of points from a scene, as `Scene.signed_distance`, and their vector-Jacobian product.

    A distance changes as its nearest point moves along the line to it, and not by the choice of that point.

    Parameters
    ----------
    scene : Scene
    points : (..., 3) array_like, world units
    max_distance : float, world units
        As in `Scene.closest_points`. Points with nothing within it do not move, and their gradients are ignored.

    Returns
    -------
    distances : (...) float64 array, world units
        Negative inside of any object.
    vjp : callable
        ``vjp(distances, samples=True)`` takes the gradients of a number by them, (...). It returns its gradients as a
        dict: ``points``, (..., 3); and by geometry id, ``levels``, ``transforms`` and ``samples``, as those of
        `cast_vjp`. Points on a surface, within 1e-9 of the scene's size, get the gradient along the outward normal.
        Nearest points on caps do not move with levels and samples, those on edges of cuts and masks move along these.

    Raises
    ------
    ValueError
        For points of another shape or that are not finite.
    TypeError
        If `scene` is not a `Scene`.

    Examples
    --------
    A step of Gauss and Newton that puts points onto a surface which they were moved away from:

    >>> import numpy as np
    >>> import isospline
    >>> field = isospline.volumes.torus()
    >>> surface = isospline.Isosurface(field.volume(48), field.level)
    >>> points = surface.sample_points(200).points + (0.01, -0.02, 0.005)
    >>> distances, vjp = isospline.derivatives.distance_vjp(isospline.Scene(surface), points)
    >>> by_points = vjp(np.ones(200), samples=False)["points"]
    >>> np.linalg.lstsq(by_points, distances, rcond=None)[0].round(2)
    array([ 0.01, -0.02,  0.  ])
    """
    check_scene(scene)
    given = _core._as_array(points, "points").astype(float)
    found = scene.closest_points(given, max_distance=max_distance)
    placed = Placed(scene)
    shape = found.distances.shape
    flat = given.reshape(-1, 3)
    inside = scene.occupancy(given).reshape(-1)
    has_near = np.isfinite(found.distances)
    near = has_near.reshape(-1)
    feet, normals = found.points.reshape(-1, 3), found.primitive_normals.reshape(-1, 3)
    ids, distances = found.geometry_ids.reshape(-1), found.distances.reshape(-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        away = (flat - feet) / distances[:, None] * np.where(inside, -1.0, 1.0)[:, None]
    away = np.where((distances > _on_surface(scene))[:, None], away, normals)
    away[~near] = 0.0

    moved = {}  # of each object: its points, how their distances change with the level, and the coefficients there
    for id, (item, transform) in placed.objects.items():
        own = near & (ids == id)
        moved[id] = [own]
        if isinstance(item, Isosurface):
            home = np.linalg.inv(transform)
            at_home = feet[own] @ home[:3, :3].T + home[:3, 3]
            slopes = _slopes_by_level(item, at_home, away[own] @ transform[:3, :3])
            moved[id] += [slopes, *item.volume.coefficient_weights(at_home)[:2]]

    def vjp(distances, samples=True):
        of = as_gradients("distances", distances, shape, has_near).reshape(-1)
        sums = Gradients(placed, samples)
        for id, (own, *at_surface) in moved.items():
            sums.add_motion(id, -of[own, None] * away[own], feet[own])
            if at_surface:
                slopes, indices, weights = at_surface
                gains = of[own, None] * slopes
                sums.levels[id] += float(gains.sum())
                sums.add_coefficients(id, indices, -gains * weights)
        return {
            "points": (of[:, None] * away).reshape(given.shape),
            "levels": sums.levels,
            "transforms": sums.transforms,
            "samples": sums.samples(),
        }

    signed = np.where(inside, -distances, distances).reshape(shape)
    return signed, vjp


def _on_surface(scene):
    """The distance up to which points are on a surface: there, rounding spoils the line to the nearest point."""
    bounds = scene.bounds
    if not np.isfinite(bounds).all():
        return 0.0
    return max(1e-9 * float(np.ptp(bounds, axis=0).max()), 1e-13 * float(np.abs(bounds).max()))


def _slopes_by_level(surface, points, away):
    """(N, 1): how a distance changes with the level, where `away` is its gradient at nearest points; in their space.

    A nearest point is stationary: `away` is a multiple of the gradient of f, and on an edge plus one of the normal of
    the plane that ends the surface there. The first factor is the slope.
    """
    gradients = surface.volume.sample(points, derivative=1)
    steepness = np.linalg.norm(gradients, axis=1)
    scale = np.abs(surface.volume.affine[:3, :3]).max()
    lengths = np.where(steepness > 0, steepness, 1.0)  # the gradient vanishes at corners of mirrored volumes
    off = np.abs(surface.volume.sample(points) - surface.level)
    planes = surface._end_planes()
    active = np.abs(points @ planes[:, :3].T - planes[:, 3]) < 1e-6 * scale
    faces = np.linalg.inv(surface.volume.affine)
    active = np.concatenate([active, _ends_at_faces(surface, points @ faces[:3, :3].T + faces[:3, 3])], axis=1)
    unit = faces[:3, :3] / np.linalg.norm(faces[:3, :3], axis=1, keepdims=True)
    normals = np.concatenate([planes[:, :3], unit])
    columns = np.concatenate([gradients[:, :, None] / lengths[:, None, None], active[:, None, :] * normals.T], 2)
    factors = np.einsum("nij,nj->ni", np.linalg.pinv(columns, rcond=1e-9), away)[:, :1]
    on_surface = (off <= 1e-6 * scale * steepness)[:, None]
    return np.where(on_surface, -factors / lengths[:, None], 0.0)


def _ends_at_faces(surface, index):
    """(N, 3): whether a surface ends or has a crease at its points, on a face between cells across x, y and z."""
    volume = surface.volume
    lattice = index + 0.5 * (volume.degree % 2 == 0)
    is_on_face = np.abs(lattice - np.round(lattice)) < 1e-6
    if volume.degree == 1:  # the gradient is that of one cell: on creases it differs along the cells' faces
        return is_on_face
    mask = surface.__getstate__()["mask"]
    if mask is None:
        return np.zeros_like(is_on_face)
    kept = mask.reshape(index_shape(volume), order="F").astype(bool)
    if volume.degree % 2 == 1:
        for axis in range(3):
            corners = np.moveaxis(kept, axis, 0)
            kept = np.moveaxis(corners[1:] & corners[:-1], 0, axis)
    kept = np.pad(kept, 1)

    def is_kept(sides):  # of faces, -1 or 0, (N, ..., 3)
        cells = np.where(is_on_face[:, None], np.round(lattice)[:, None] + sides, np.floor(lattice)[:, None]) + 1
        return kept[tuple(np.moveaxis(cells.astype(np.intp), -1, 0))]

    around = np.array([*itertools.product((-1, 0), repeat=3)])
    own = around[is_kept(around).argmax(axis=1)]  # a kept cell that each point is in
    across = np.where(np.eye(3, dtype=bool), -1 - own[:, None], own[:, None])  # its neighbours
    return is_on_face & ~is_kept(across)
