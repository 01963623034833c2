"""Distances between surfaces: mean, maximum, and at points."""

from __future__ import annotations

import math

import numpy as np

from .base.parameters import check_seed, check_type, flag, number, optional, whole_number
from .base.results import Measurement, SurfaceDistance
from .base.signatures import explained
from .farthest import largest_distance, largest_distance_of_mesh
from .scene import Isosurface, Mesh, Scene
from .scene.world_units import check_unit, units_in


@explained
def surface_distance(
    surface: Isosurface | Mesh,
    other: Isosurface | Mesh | Scene,
    *,
    samples: int = 10000,
    seed: int = 0,
    tolerance: float | None = None,
    signed: bool = False,
) -> SurfaceDistance:
    """Measure the distances of the points of a surface from another one. The measure is not symmetric.

    Parameters
    ----------
    surface : Isosurface or Mesh
        A surface with points to sample.
    other : Isosurface, Mesh or Scene
        The distances are measured from it. An isosurface has the unit of `surface`, if both have one; one of another
        unit is scaled in a scene, as ``Scene([(other, numpy.diag([0.001, 0.001, 0.001, 1]))])`` from micrometres to
        millimetres.
    samples : int
        Points of the surface for the mean, the root mean square and the map.
    seed : int
        Seed of the samples, 0 to 2^32 - 1.
    tolerance : float, world units, optional
        Tolerance of the bounds on the largest distance. If one of the two is an isosurface, it is by default the
        smallest of a quarter e of the shortest edge of a voxel (of `surface` if both are isosurfaces), and the larger
        of d / 10 and sqrt(d^2 + e^2) - d, where d is the largest distance of the samples. If neither is one, it is a
        thousandth of the diagonal of the bounds of `surface`.
    signed : bool
        Whether the distances and their mean are negative inside of `other`, of which meshes must be closed. The root
        mean square, the quantiles and the largest distance are without sign.

    Returns
    -------
    SurfaceDistance

    Raises
    ------
    ValueError
        For fewer than two samples, a seed out of range, a tolerance that is not positive, a surface without points, and
        isosurfaces of different units.
    TypeError
        For objects of other types.

    Notes
    -----
    Caps count. No point p of `surface` is farther from `other` than from any point q of `other`. In a triangle, the
    distance of p from q is largest at a corner. In a box, the surface is between two parallel planes, which Taylor's
    theorem gives from a bound on the second derivatives of the model there, of degree 2 or 3; caps are in known planes.
    If q is the point nearest to the middle of a part with radius r, at a distance d, and the surfaces are parallel, the
    bound is about sqrt(d^2 + r^2). At degree 1, whose gradient jumps, it is that of the box, d + r. Boxes with the
    largest bounds are divided into eight, triangles into four, until the bounds are within the tolerance of a known
    distance or there are 2^19 of them. So a small tolerance is not reached for large surfaces that are parallel, and
    for surfaces much less than a voxel apart; the bounds show this.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.sphere(0.7)
    >>> volume = field.volume(24)
    >>> large, small = isospline.Isosurface(volume, field.level), isospline.Isosurface(volume, 0.7**2 - 0.5**2)
    >>> apart = isospline.surface_distance(large, small, samples=1000)
    >>> round(apart.mean.value, 3), round(apart.maximum[0], 3), apart.maximum[1] < 0.23
    (0.2, 0.2, True)
    >>> inside = isospline.surface_distance(small, large, samples=1000, signed=True)
    >>> round(inside.mean.value, 3), inside.quantiles.round(3)
    (-0.2, array([0.2, 0.2, 0.2]))
    """
    _check_surface(surface, "surface")
    check_type(other, "other", (Isosurface, Mesh, Scene), "an Isosurface, a Mesh or a Scene")
    _check_units(surface, other)
    samples = whole_number(samples, "samples")
    if samples < 2:
        raise ValueError(f"samples: expected at least 2, got {samples}")
    check_seed(seed)
    tolerance = optional(number, tolerance, "tolerance")
    if tolerance is not None and not (tolerance > 0 and math.isfinite(tolerance)):
        raise ValueError(f"tolerance: expected a finite number above 0, got {tolerance:g}")
    signed = flag(signed, "signed")
    target = Scene([other]) if isinstance(other, Mesh) else other
    if isinstance(surface, Mesh):
        points, bounds = _points_of_mesh(surface, samples, seed), largest_distance_of_mesh
    else:
        points, bounds = surface.sample_points(samples, seed=seed)["points"], largest_distance
    nearest = target.closest_points(points)
    distances = nearest["distances"]
    if not np.isfinite(distances).all():
        raise ValueError("other: expected a surface with points, got one without")
    squares = distances**2
    quantiles = np.quantile(distances, (0.5, 0.95, 0.99))
    if tolerance is None:
        tolerance = _default_tolerance(surface, other, float(distances.max()))
    if signed:
        is_inside = target.contains(points) if isinstance(target, Isosurface) else target.occupancy(points)
        distances = np.where(is_inside, -distances, distances)
    rms = math.sqrt(squares.mean())
    square_error = squares.std(ddof=1) / math.sqrt(samples)
    return SurfaceDistance(
        mean=Measurement(float(distances.mean()), float(distances.std(ddof=1) / math.sqrt(samples))),
        rms=Measurement(rms, square_error / (2 * rms) if rms > 0 else 0.0),
        quantiles=quantiles,
        maximum=bounds(surface, target, nearest, tolerance),
        points=points,
        distances=distances,
    )


@explained
def hausdorff_distance(
    surface: Isosurface | Mesh, other: Isosurface | Mesh, *, tolerance: float | None = None
) -> tuple[float, float]:
    """The Hausdorff distance of two surfaces: the largest distance of a point of either from the other.

    Parameters
    ----------
    surface, other : Isosurface or Mesh
        Surfaces with points.
    tolerance : float, world units, optional
        As in `surface_distance`.

    Returns
    -------
    (float, float), world units
        A lower and an upper bound.

    Raises
    ------
    ValueError
        For a tolerance that is not positive, a surface without points, and isosurfaces of different units.
    TypeError
        For objects of other types.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.sphere(0.7)
    >>> volume = field.volume(24)
    >>> large, small = isospline.Isosurface(volume, field.level), isospline.Isosurface(volume, 0.7**2 - 0.5**2)
    >>> lower, upper = isospline.hausdorff_distance(large, small)
    >>> lower <= 0.201 and 0.199 <= upper <= 0.23
    True
    """
    _check_surface(surface, "surface")
    _check_surface(other, "other")
    there = surface_distance(surface, other, tolerance=tolerance).maximum
    back = surface_distance(other, surface, tolerance=tolerance).maximum
    return max(there[0], back[0]), max(there[1], back[1])


def _check_surface(surface, parameter):
    """Check that points can be sampled from a mesh; isosurfaces without points raise an error of their own."""
    check_type(surface, parameter, (Isosurface, Mesh), "an Isosurface or a Mesh")
    if isinstance(surface, Mesh) and not _face_areas(surface).any():
        raise ValueError(f"{parameter}: expected a surface with points to sample, got a mesh without area")


def _check_units(surface, other):
    """Check that numbers of both mean the same; those of meshes do, and of what a scene's transforms convert."""
    if not isinstance(surface, Isosurface):
        return
    units = []
    if isinstance(other, Scene):
        units = units_in(other)
    elif isinstance(other, Isosurface):
        units = [other.volume.unit]
    for unit in units:
        check_unit(unit, surface.volume.unit, "other", "surface is")


def _default_tolerance(surface, other, largest):
    for each in (surface, other):
        if isinstance(each, Isosurface):
            quarter = 0.25 * float(np.linalg.norm(each.volume.affine[:3, :3], axis=0).min())
            return min(quarter, max(0.1 * largest, math.hypot(largest, quarter) - largest))
    return 1e-3 * float(np.linalg.norm(np.diff(surface.bounds, axis=0)))


def _points_of_mesh(mesh, count, seed):
    """Random points of a mesh, uniform by area."""
    until = np.cumsum(_face_areas(mesh))
    random = np.random.default_rng(seed)
    faces = np.minimum(np.searchsorted(until, random.uniform(0, until[-1], count), side="right"), len(until) - 1)
    u, v = random.uniform(size=(2, count, 1))
    u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))
    a, b, c = mesh.vertices[mesh.faces[faces]].transpose(1, 0, 2)
    return a + u * (b - a) + v * (c - a)


def _face_areas(mesh):
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
