"""Branch and bound over parts of a surface: triangles of a mesh, and boxes."""

from __future__ import annotations

import itertools
import math

import numpy as np

from ..scene.cells import cell_shift
from .slabs import Slabs

#: Largest number of boxes or triangles for one bound.
MOST_PARTS = 1 << 19
#: Approximate number of boxes at the beginning.
FIRST_BOXES = 1 << 12
#: Number of boxes that are divided at a time.
AT_A_TIME = 1 << 12


def largest_distance_of_mesh(mesh, target, nearest, tolerance):
    """Bounds on the largest distance of a point of the mesh from the target, with the `nearest` points to some.

    For any point q of the target, |p - q| is a convex function of p. So its maximum in a triangle is at a corner.
    """
    used, place = np.unique(mesh.faces, return_inverse=True)
    found = target.closest_points(mesh.vertices[used])
    largest = _Largest(nearest)
    largest.add(found)
    triangles = mesh.vertices[mesh.faces]
    points = found["points"][place.reshape(-1, 3)]
    upper = np.min([_farthest_corner(triangles, points[:, corner]) for corner in range(3)], axis=0)
    looked_at, left_out = 0, 0.0
    while True:
        wanted = upper > largest.found + tolerance
        left_out = max(left_out, float(upper[~wanted].max(initial=0.0)))
        triangles, upper = triangles[wanted], upper[wanted]
        if len(triangles) == 0:
            return largest.proven, max(largest.found, min(left_out, largest.found + tolerance))
        looked_at += len(triangles)
        if looked_at > max(MOST_PARTS, len(mesh.faces)):
            return largest.proven, max(largest.found, float(upper.max(initial=left_out)))
        found = target.closest_points(triangles.mean(axis=1))
        largest.add(found)
        upper = np.minimum(upper, _farthest_corner(triangles, found["points"]))
        wanted = upper > largest.found + tolerance
        left_out = max(left_out, float(upper[~wanted].max(initial=0.0)))
        a, b, c = triangles[wanted].transpose(1, 0, 2)
        ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        triangles = np.concatenate([np.stack(each, axis=1) for each in quarters])
        upper = np.tile(upper[wanted], 4)


class _Largest:
    """The largest distance of points from the target that was found, and what is proven of it."""

    def __init__(self, nearest):
        self.found = self.proven = 0.0
        self.add(nearest)

    def add(self, nearest):
        """Take account of nearest points; their distances are too large by their error bounds, at most."""
        distances = nearest["distances"]
        self.found = max(self.found, float(distances.max(initial=0.0)))
        self.proven = max(self.proven, float((distances - nearest["error_bounds"]).max(initial=0.0)))


def _farthest_corner(triangles, points):
    return np.linalg.norm(triangles - points[:, None], axis=2).max(axis=1)


def largest_distance(surface, target, nearest, tolerance):
    """Bounds on the largest distance of a point of the surface from the target, with the `nearest` points to some."""
    volume = surface.volume
    slabs = Slabs(surface)
    shift = cell_shift(volume)
    shape = volume.cell_at(volume.cell_count - 1) + 1
    edge = math.ceil((volume.cell_count / FIRST_BOXES) ** (1 / 3))
    places = np.meshgrid(*(np.arange(0, cells, edge) for cells in shape), indexing="ij")
    centers = np.stack(places, axis=-1).reshape(-1, 3) + (edge / 2 - shift)  # index space
    halves, upper = np.full(len(centers), edge / 2), np.full(len(centers), np.inf)
    corners = np.array(list(itertools.product((-1, 1), repeat=3)))
    waiting = centers[:0], halves[:0], upper[:0]
    largest = _Largest(nearest)
    looked_at, left_out = 0, 0.0
    while True:
        looked_at += len(centers)
        # Boxes that contain a part of the surface, and a point of it. This is the cheapest query, as it ends early.
        world, radius = slabs.to_world(centers), slabs.radius(halves)
        on_surface = surface.closest_points(world, max_distance=1.001 * radius.max())
        has_surface = on_surface["distances"] - on_surface["error_bounds"] <= radius
        centers, halves, upper = centers[has_surface], halves[has_surface], upper[has_surface]
        points = on_surface["points"][has_surface]
        found = target.closest_points(points)
        largest.add(found)
        upper = np.minimum(upper, slabs.bounds(centers, halves, points, found["points"], largest.found + tolerance))
        # The boxes with the largest bounds are divided into eight.
        centers, halves, upper = (np.concatenate(each) for each in zip(waiting, (centers, halves, upper), strict=True))
        wanted = upper > largest.found + tolerance
        left_out = max(left_out, float(upper[~wanted].max(initial=0.0)))
        centers, halves, upper = centers[wanted], halves[wanted], upper[wanted]
        if len(centers) == 0 or looked_at >= MOST_PARTS:
            return largest.proven, max(largest.found, float(upper.max(initial=left_out)))
        order = np.argsort(-upper, kind="stable")
        now, later = order[:AT_A_TIME], order[AT_A_TIME:]
        waiting = centers[later], halves[later], upper[later]
        halves = np.repeat(halves[now] / 2, 8)
        centers = np.repeat(centers[now], 8, axis=0) + halves[:, None] * np.tile(corners, (len(now), 1))
        upper = np.repeat(upper[now], 8)
