"""Distances between surfaces: mean, maximum, and at points."""

from __future__ import annotations

import math

import numpy as np

from ._core import Isosurface, Mesh, Scene
from .base.parameters import check_seed
from .base.results import Measurement, SurfaceDistance
from .base.signatures import explained

#: Largest number of boxes or triangles for one bound.
MOST_PARTS = 1 << 18
#: Approximate number of boxes at the beginning.
FIRST_BOXES = 1 << 12


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
        The distances are measured from it.
    samples : int
        Points of the surface for the mean, the root mean square and the map.
    seed : int
        Seed of the samples, 0 to 2^32 - 1.
    tolerance : float, world units, optional
        Tolerance of the bounds on the largest distance; by default a quarter of the shortest edge of a voxel, of
        `surface` if both are isosurfaces. If neither is one, it is a thousandth of the diagonal of the bounds of
        `surface`.
    signed : bool
        Whether the distances and their mean are negative inside of `other`, of which meshes must be closed. The root
        mean square, the quantiles and the largest distance are without sign.

    Returns
    -------
    SurfaceDistance

    Raises
    ------
    ValueError
        For fewer than two samples, a seed out of range, a tolerance that is not positive, and a surface without points.
    TypeError
        For objects of other types.

    Notes
    -----
    Caps count. The distance from a surface is Lipschitz continuous with constant 1. So the distance of a box's centre,
    plus half the box's diagonal, is an upper bound for the surface in the box; the same holds for the centre of a
    triangle and its farthest corner. Boxes with the largest bounds are divided into eight, triangles into four, until
    the bounds are within the tolerance of a known distance or there are 2^18 of them. If surfaces are parallel, a small
    tolerance is not reached; the bounds show this.

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
    if not isinstance(surface, (Isosurface, Mesh)):
        raise TypeError(f"surface: expected an Isosurface or a Mesh, got {type(surface).__name__}")
    if samples < 2:
        raise ValueError(f"samples: expected at least 2, got {samples}")
    check_seed(seed)
    target = _target(other)
    tolerance = _default_tolerance(surface, other) if tolerance is None else tolerance
    if not (tolerance > 0 and math.isfinite(tolerance)):
        raise ValueError(f"tolerance: expected a finite number above 0, got {tolerance}")
    if isinstance(surface, Mesh):
        points, largest_distance = _points_of_mesh(surface, samples, seed), _largest_distance_of_mesh
    else:
        points, largest_distance = surface.sample_points(samples, seed=seed)["points"], _largest_distance
    distances = target.closest_points(points)["distances"]
    if not np.isfinite(distances).all():
        raise ValueError("other: expected a surface with points, got one without")
    squares = distances**2
    quantiles = np.quantile(distances, (0.5, 0.95, 0.99))
    largest = float(distances.max())
    if signed:
        is_inside = target.contains(points) if isinstance(target, Isosurface) else target.occupancy(points)
        distances = np.where(is_inside, -distances, distances)
    rms = math.sqrt(squares.mean())
    square_error = squares.std(ddof=1) / math.sqrt(samples)
    return SurfaceDistance(
        mean=Measurement(float(distances.mean()), float(distances.std(ddof=1) / math.sqrt(samples))),
        rms=Measurement(rms, square_error / (2 * rms) if rms > 0 else 0.0),
        quantiles=quantiles,
        maximum=largest_distance(surface, target, largest, tolerance),
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
        For a tolerance that is not positive, and a surface without points.
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
    there = surface_distance(surface, other, tolerance=tolerance).maximum
    back = surface_distance(other, surface, tolerance=tolerance).maximum
    return max(there[0], back[0]), max(there[1], back[1])


def _target(other):
    if isinstance(other, (Isosurface, Scene)):
        return other
    if isinstance(other, Mesh):
        return Scene([other])
    raise TypeError(f"other: expected an Isosurface, a Mesh or a Scene, got {type(other).__name__}")


def _default_tolerance(surface, other):
    for each in (surface, other):
        if isinstance(each, Isosurface):
            return 0.25 * float(np.linalg.norm(each.volume.affine[:3, :3], axis=0).min())
    diagonal = float(np.linalg.norm(np.diff(surface.bounds, axis=0)))
    return 1e-3 * diagonal if math.isfinite(diagonal) and diagonal > 0 else 1.0  # without points, there is no bound


def _points_of_mesh(mesh, count, seed):
    """Random points of a mesh, uniform by area."""
    corners = mesh.vertices[mesh.faces]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    until = np.cumsum(areas)
    if not (len(until) > 0 and until[-1] > 0):
        raise ValueError("surface: expected a surface with points to sample, got a mesh without area")
    random = np.random.default_rng(seed)
    faces = np.minimum(np.searchsorted(until, random.uniform(0, until[-1], count), side="right"), len(until) - 1)
    u, v = random.uniform(size=(2, count, 1))
    u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))
    a, b, c = corners[faces].transpose(1, 0, 2)
    return a + u * (b - a) + v * (c - a)


def _largest_distance_of_mesh(mesh, target, lower, tolerance):
    """Bounds on the largest distance of a point of the mesh from the target, given that one is as far as `lower`."""
    triangles = mesh.vertices[mesh.faces]
    of_vertices = np.zeros(len(mesh.vertices))
    used = np.unique(mesh.faces)
    of_vertices[used] = target.closest_points(mesh.vertices[used])["distances"]
    lower = max(lower, float(of_vertices.max()))
    # From a vertex, no point of a triangle is farther than the triangle's longer edge there.
    edges = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=2)
    upper = (of_vertices[mesh.faces] + np.maximum(edges, np.roll(edges, 1, axis=1))).min(axis=1)
    looked_at, left_out = 0, 0.0
    while True:
        wanted = upper > lower + tolerance
        left_out = max(left_out, float(upper[~wanted].max(initial=0.0)))
        triangles, upper = triangles[wanted], upper[wanted]
        if len(triangles) == 0:
            return lower, max(lower, min(left_out, lower + tolerance))
        looked_at += len(triangles)
        if looked_at > max(MOST_PARTS, len(mesh.faces)):
            return lower, max(lower, float(upper.max(initial=left_out)))
        centers = triangles.mean(axis=1)
        found = target.closest_points(centers)["distances"]
        lower = max(lower, float(found.max()))
        radius = np.linalg.norm(triangles - centers[:, None], axis=2).max(axis=1)
        upper = np.minimum(upper, found + radius)
        wanted = upper > lower + tolerance
        left_out = max(left_out, float(upper[~wanted].max(initial=0.0)))
        a, b, c = triangles[wanted].transpose(1, 0, 2)
        ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        triangles = np.concatenate([np.stack(each, axis=1) for each in quarters])
        upper = np.tile(upper[wanted], 4)


def _largest_distance(surface, target, lower, tolerance):
    """Bounds on the largest distance of a point of the surface from the target, given that one is as far as `lower`."""
    volume = surface.volume
    to_world = volume.affine
    shift = 0.5 if volume.degree % 2 == 0 else 0.0
    shape = volume.cell_at(volume.cell_count - 1) + 1
    edge = math.ceil((volume.cell_count / FIRST_BOXES) ** (1 / 3))
    places = np.meshgrid(*(np.arange(0, cells, edge) for cells in shape), indexing="ij")
    centers = np.stack(places, axis=-1).reshape(-1, 3) + (edge / 2 - shift)  # index space
    half, looked_at, left_out = edge / 2, 0, 0.0
    upper = np.full(len(centers), np.inf)
    signs = np.array([(1, y, z) for y in (-1, 1) for z in (-1, 1)])
    while True:
        radius = half * np.linalg.norm(signs @ to_world[:3, :3].T, axis=1).max()
        world = centers @ to_world[:3, :3].T + to_world[:3, 3]
        looked_at += len(centers)
        # Boxes that contain a part of the surface, and a point of it. This is the cheapest query, as it ends early.
        on_surface = surface.closest_points(world, max_distance=radius)
        has_surface = np.isfinite(on_surface["distances"])
        centers, world, upper = centers[has_surface], world[has_surface], upper[has_surface]
        points, apart = on_surface["points"][has_surface], on_surface["distances"][has_surface]
        if len(centers) == 0:
            return lower, max(lower, min(left_out, lower + tolerance))
        found = target.closest_points(points)["distances"]
        lower = max(lower, float(found.max()))
        upper = np.minimum(upper, found + apart + radius)
        wanted = upper > lower + tolerance
        left_out = max(left_out, float(upper[~wanted].max(initial=0.0)))
        centers, world, upper = centers[wanted], world[wanted], upper[wanted]
        upper = np.minimum(upper, target.closest_points(world)["distances"] + radius)
        wanted = upper > lower + tolerance
        left_out = max(left_out, float(upper[~wanted].max(initial=0.0)))
        centers, upper = centers[wanted], upper[wanted]
        if looked_at + 8 * len(centers) > MOST_PARTS:
            return lower, max(lower, float(upper.max(initial=left_out)))
        half /= 2
        corners = np.stack(np.meshgrid(*((-half, half),) * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        centers, upper = (centers[:, None] + corners).reshape(-1, 3), np.repeat(upper, 8)
