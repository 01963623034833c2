"""Slabs: the surface in a box is between two planes, which are as near to each other as the model is linear."""

from __future__ import annotations

import itertools

import numpy as np

from ..scene import Isosurface, Volume
from ..scene.cells import cell_shift

#: Longest edge, in cells, of the blocks of which second derivatives are bounded.
LONGEST_EDGE = 4
#: Boxes and cells at a time, which limits the memory.
BLOCKS_AT_A_TIME, CELLS_AT_A_TIME = 1 << 14, 1 << 12
#: For rounding.
SLIGHTLY_MORE = 1 + 1e-12


class HessianBounds:
    """Bounds on the norm of the Hessian, by world coordinates, in blocks of cells of a volume of degree 2 or 3.

    In a cell, the Hessian is a polynomial of at most the model's degree along each axis. So it is a convex combination
    of its Bernstein coefficients, which are matrices, and its norm is at most the largest norm of one of them. The
    coefficients follow from samples in the cell.
    """

    def __init__(self, volume: Volume) -> None:
        self._volume = volume
        self._shape = volume.cell_at(volume.cell_count - 1).astype(np.int64) + 1
        order = volume.degree + 1
        u = (np.arange(order) + 0.5) / order
        binomial = {3: (1, 2, 1), 4: (1, 3, 3, 1)}[order]
        basis = [binomial[k] * u**k * (1 - u) ** (order - 1 - k) for k in range(order)]
        inverse = np.linalg.inv(np.stack(basis, axis=1))
        self._to_bernstein = np.kron(np.kron(inverse, inverse), inverse)
        self._places = np.stack(np.meshgrid(u, u, u, indexing="ij"), axis=-1).reshape(-1, 3)
        if order == 3:
            self._places -= 0.5  # cells of even degrees are centred on samples

    def of_cells(self, cells: np.ndarray) -> np.ndarray:
        """The bounds of cells: (N,) from (N, 3)."""
        affine = self._volume.affine
        places = (cells[:, None] + self._places) @ affine[:3, :3].T + affine[:3, 3]
        xx, xy, xz, yy, yz, zz = range(6)
        found = self._volume.sample(places, derivative=2)[..., (0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2)]
        a = np.abs(self._to_bernstein @ found)
        frobenius = np.sqrt((a**2) @ np.array([1.0, 2, 2, 1, 2, 1]))
        rows = np.stack([a[..., i].sum(axis=-1) for i in ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))]).max(axis=0)
        return np.minimum(frobenius, rows).max(axis=1)

    def of_blocks(self, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
        """The bounds of blocks of cells from one to another cell, (N,) from (N, 3) each; infinite if they are long."""
        bounds = np.full(len(lower), np.inf)
        lower, upper = np.clip(lower, 0, self._shape - 1), np.clip(upper, 0, self._shape - 1)
        (wanted,) = ((upper - lower).max(axis=1, initial=0) < LONGEST_EDGE).nonzero()
        for start in range(0, len(wanted), BLOCKS_AT_A_TIME):
            part = wanted[start : start + BLOCKS_AT_A_TIME]
            edges = (upper - lower)[part].max(axis=0) + 1
            steps = np.array(list(itertools.product(*map(range, edges))))
            cells = np.minimum(lower[part, None] + steps, upper[part, None])
            ids, place = np.unique(np.ravel_multi_index(np.moveaxis(cells, -1, 0), self._shape), return_inverse=True)
            unique = np.stack(np.unravel_index(ids, self._shape), axis=-1)
            split = range(CELLS_AT_A_TIME, len(unique), CELLS_AT_A_TIME)
            of_ids = np.concatenate([self.of_cells(each) for each in np.split(unique, split)])
            bounds[part] = of_ids[place].reshape(len(part), -1).max(axis=1)
        return bounds


class Slabs:
    """Bounds on the distance of the surface in boxes from given points.

    Notes
    -----
    Let c be the centre of a box, and b = p - c for a point p of the surface in it, so that |b| <= r. Let p0 be a point
    of the surface near the box, n the direction of the model's gradient g there, e = p - p0, and M a bound on the norm
    of the Hessian in the convex hull of the box and p0. Let the index n mark components along n, and t those across.
    The values at p and p0 are the level. So, by Taylor's theorem on the segment from p0 to p,

        |g| |e_n| <= M / 2 (|e_t|^2 + |e_n|^2).

    At degree 2, second derivatives jump between cells, but first ones do not, and the theorem holds with M as a bound
    almost everywhere. With |e_t| <= |(c - p0)_t| + r and any bound on |e_n|, such as that of the box, this is a better
    bound on |e_n|, and so on. Then |b_n| = |e_n - (c - p0)_n| has a lower bound, so that |b_t|^2 <= r^2 - b_n^2 and
    e_t = (c - p0)_t + b_t are bounded. Finally, for any point q and v = p0 - q,

        |p - q|^2 = (v_n + e_n)^2 + |v_t + e_t|^2 <= max (v_n + e_n)^2 + (|v_t| + max |e_t|)^2.

    If q is the nearest point on a parallel surface, v_t is zero, and this is |v|^2 + r^2, except for curvature. A
    difference between the value at p0 and the level is added to the right side of the first inequality.

    If p0 is on a cap and the value there differs from the level by more than the same bound allows in the box, the box
    has caps only.

    The points p of a cap are in its plane. With n the normal of the plane, e_n is known exactly. They are also in the
    solid: with n into the solid, their values are on one side of the level, which gives the same lower bound on e_n,
    and only the box limits e_n above. This is the better one where a cap ends at the surface.
    """

    def __init__(self, surface: Isosurface) -> None:
        self._volume = surface.volume
        self._level = surface.level
        self._hessian = HessianBounds(surface.volume) if surface.volume.degree > 1 else None
        self._into = 1.0 if surface.inside == "above" else -1.0
        self._shift = cell_shift(surface.volume)
        self._linear, self._translation = surface.volume.affine[:3, :3], surface.volume.affine[:3, 3]
        self._to_index = np.linalg.inv(self._linear)
        # Planes of caps: m and o of <m, x> = o in the world.
        clip = surface.__getstate__()["clip"]
        normals, offsets = ([clip[:, :3]], [clip[:, 3]]) if surface.capped else ([], [])
        if surface.closed:
            cells = self._volume.cell_at(self._volume.cell_count - 1) + 1
            for end in (np.zeros(3), cells):
                normals.append(self._to_index)
                offsets.append(end - self._shift + self._to_index @ self._translation)
        planes = np.column_stack([np.concatenate([np.zeros((0, 3)), *normals]), np.concatenate([[], *offsets])])
        planes /= np.linalg.norm(planes[:, :3], axis=1)[:, None]
        self._normals, self._offsets = planes[:, :3], planes[:, 3]

    def to_world(self, points: np.ndarray) -> np.ndarray:
        """Points of the index space in the world."""
        return points @ self._linear.T + self._translation

    def radius(self, halves: np.ndarray) -> np.ndarray:
        """Half of the longest diagonal, in the world, of boxes with these halves of edges."""
        signs = np.array([(1, y, z) for y in (-1, 1) for z in (-1, 1)])
        return halves * (np.linalg.norm(signs @ self._linear.T, axis=1).max() * SLIGHTLY_MORE)

    def bounds(
        self, centers: np.ndarray, halves: np.ndarray, points: np.ndarray, targets: np.ndarray, enough: float
    ) -> np.ndarray:
        """Bounds on the distances from `targets` of the surface in boxes.

        Parameters
        ----------
        centers : (N, 3) array, index space
            Those of the boxes.
        halves : (N,) array, index space
            Half of their edges.
        points, targets : (N, 3) arrays, world units
            p0 and q of each box.
        enough : float, world units
            If the distance of the whole box is smaller, it is the bound.
        """
        centers_world, radius = self.to_world(centers), self.radius(halves)
        of_boxes = np.linalg.norm(centers_world - targets, axis=1) + radius
        if self._hessian is None:
            return of_boxes  # gradients of degree 1 jump between cells
        between, shifted = points - targets, centers_world - points
        gradient = self._into * self._volume.sample(points, derivative=1)
        slope = np.linalg.norm(gradient, axis=1)
        normal = gradient / np.where(slope > 0, slope, 1)[:, None]
        error = np.abs(self._volume.sample(points) - self._level)
        index = (points - self._translation) @ self._to_index.T
        hessian = np.full(len(centers), np.inf)
        wanted = of_boxes > enough
        hessian[wanted] = self._hessian.of_blocks(
            np.floor(np.minimum(index, centers - halves[:, None]) + self._shift).astype(np.int64)[wanted],
            np.ceil(np.maximum(index, centers + halves[:, None]) + self._shift).astype(np.int64)[wanted] - 1,
        )

        # Bounds on e_n of the surface and the solid.
        center_n, center_t = _along_and_across(shifted, normal)
        extent = halves * np.abs(normal @ self._linear).sum(axis=1)
        lowest, highest = center_n - extent, center_n + extent

        def change(e_n):
            """How much the value may differ from the linear one."""
            return hessian / 2 * ((center_t + radius) ** 2 + e_n**2)

        def by_taylor(e_n):
            for _ in range(3):
                with np.errstate(divide="ignore", invalid="ignore"):
                    e_n = np.fmin(e_n, (error + change(e_n)) / slope)
            return e_n

        longest = np.maximum(highest, -lowest)
        e_n = by_taylor(longest)
        of_surface = _largest(between, shifted, normal, -e_n, e_n, radius)
        of_surface[error > slope * longest + change(longest)] = 0.0
        caps = self._caps(centers_world, halves)
        if not caps.any():
            return np.minimum(of_boxes, of_surface)
        e_n = by_taylor(np.maximum(-lowest, 0))
        of_solid = _largest(between, shifted, normal, -e_n, np.maximum(highest, -e_n), radius)
        of_caps = np.zeros(len(centers))
        for plane, (m, o) in enumerate(zip(self._normals, self._offsets, strict=True)):
            here = caps[:, plane]
            e_n = o - points[here] @ m
            of_plane = _largest(between[here], shifted[here], m, e_n, e_n, radius[here])
            of_caps[here] = np.maximum(of_caps[here], of_plane)
        return np.minimum(of_boxes, np.maximum(of_surface, np.minimum(of_caps, of_solid)))

    def _caps(self, centers, halves):
        """Which planes of caps meet which boxes."""
        extent = halves[:, None] * np.abs(self._normals @ self._linear).sum(axis=1)
        rounding = 1e-9 * (extent + np.abs(self._offsets))
        return np.abs(centers @ self._normals.T - self._offsets) <= extent + rounding


def _along_and_across(vectors, normal):
    along = (vectors * normal).sum(axis=1)
    return along, np.linalg.norm(vectors - along[:, None] * normal, axis=1)


def _largest(between, shifted, normal, lowest, highest, radius):
    """The largest |p - q| for v, c - p0, n, the bounds on e_n, and r."""
    v_n, v_t = _along_and_across(between, normal)
    center_n, center_t = _along_and_across(shifted, normal)
    b_n = np.maximum(0, np.maximum(lowest - center_n, center_n - highest))
    e_t = center_t + np.sqrt(np.maximum(radius**2 - b_n**2, 0))
    return np.hypot(np.maximum(np.abs(v_n + lowest), np.abs(v_n + highest)), v_t + e_t) * SLIGHTLY_MORE
