"""First crossings of rays in float64, with NumPy and SciPy only: shares no code with isospline.

Between two planes of the grid of cells, f along a ray is one polynomial of degree 3n. If all coefficients that
influence the cell are on one side of the level, it has no root there, because f is a mean of them. Otherwise it is
sampled at 3n+1 Chebyshev points by scipy.ndimage.map_coordinates, which determines it. If the constant term of its
Chebyshev series is larger than all other terms together, it has no root. Otherwise it is cut at the roots of its
derivative. If the signs at the ends of a monotone piece differ, the piece has a root. So no root is missed, not even
in a close pair.
"""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.polynomial import chebyshev
from scipy import ndimage

#: Boundary rules of isospline.Volume and the modes of scipy.ndimage that are the same.
MODES = {"mirror": "mirror", "periodic": "grid-wrap"}
CHUNK = 4096  # rays that are traced side by side


class Oracle:
    """The B-spline model of samples [z, y, x], with coefficients in float64 unless coefficients are given."""

    def __init__(self, data, level, affine, degree=2, boundary="mirror", coefficients=None):
        self.level = float(level)
        self.degree = degree
        self.mode = MODES[boundary]
        if coefficients is None:  # with degree 1, samples are coefficients
            coefficients = ndimage.spline_filter(data, degree, np.float64, self.mode) if degree > 1 else data
        self.coefficients = coefficients
        self.world_to_index = np.linalg.inv(affine)
        # even degrees: a cell is centred on a sample
        self.first_plane = -0.5 if degree % 2 == 0 else 0.0
        self.cells = np.array(data.shape[::-1]) - degree % 2
        self.straddles = self.cells_that_straddle()

        count = 3 * degree + 1
        self.nodes = chebyshev.chebpts1(count)
        self.to_series = np.linalg.inv(chebyshev.chebvander(self.nodes, count - 1)).T

    def cells_that_straddle(self):
        """Whether the coefficients of each cell [z, y, x] lie on both sides of the level, to rounding."""
        window = {"size": self.degree + 1, "mode": self.mode, "origin": -(self.degree % 2)}
        margin = 1e-9 * max(abs(float(self.coefficients.max())), abs(float(self.coefficients.min())))
        straddles = ndimage.minimum_filter(self.coefficients, **window) <= self.level + margin
        straddles &= ndimage.maximum_filter(self.coefficients, **window) >= self.level - margin
        return straddles

    def values(self, points):
        """f - level at (..., 3) points in index space."""
        coordinates = np.moveaxis(points[..., ::-1], -1, 0).astype(np.float64)
        values = ndimage.map_coordinates(
            self.coefficients, coordinates, np.float64, self.degree, self.mode, prefilter=False
        )
        return values - self.level

    def to_index(self, rays):
        """Origins and directions of world rays (N, 6) in index space, in extended precision if the machine has it:
        for distant grazing rays, the rounding of float64 at the eye would be the largest error."""
        rays = np.asarray(rays, dtype=np.longdouble)
        linear = self.world_to_index[:3, :3].T.astype(np.longdouble)
        return rays[:, :3] @ linear + self.world_to_index[:3, 3], rays[:, 3:] @ linear

    def voxels_per_t(self, rays):
        """Length of the directions of world rays (N, 6) in index space."""
        return np.linalg.norm(self.to_index(rays)[1], axis=1).astype(np.float64)

    def first_crossings(self, rays):
        """t >= 0 of the first crossing of world rays (N, 6), in units of the direction's length; inf for none."""
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            chunks = [rays[first : first + CHUNK] for first in range(0, len(rays), CHUNK)]
            return np.concatenate([np.empty(0), *pool.map(self.first_crossings_of_chunk, chunks)])

    def first_crossings_of_chunk(self, rays):
        origins, directions = self.to_index(rays)
        enter, leave = self.inside(origins, directions)
        t_hit = np.full(len(rays), np.inf, np.longdouble)
        (rows,) = np.nonzero(enter < leave)
        # Float64 is sufficient from the point where they enter.
        begins = (origins[rows] + enter[rows, None] * directions[rows]).astype(np.float64)
        directions = directions[rows].astype(np.float64)
        found = self.first_crossings_inside(begins, directions, (leave - enter)[rows].astype(np.float64))
        t_hit[rows] = enter[rows] + found
        return t_hit.astype(np.float64)

    def inside(self, origins, directions):
        """The t >= 0 where rays enter the grid of cells, and where they leave it; in the other order if they miss."""
        enter, leave = np.zeros(len(origins), np.longdouble), np.full(len(origins), np.inf, np.longdouble)
        for axis in range(3):
            lower, upper = self.first_plane, self.first_plane + self.cells[axis]
            origin, direction = origins[:, axis], directions[:, axis]
            along = direction != 0
            step = np.where(along, direction, 1)
            t_lower, t_upper = (lower - origin) / step, (upper - origin) / step
            outside = (origin < lower) | (origin > upper)
            near = np.where(along, np.minimum(t_lower, t_upper), np.where(outside, np.inf, -np.inf))
            far = np.where(along, np.maximum(t_lower, t_upper), np.inf)
            enter, leave = np.maximum(enter, near), np.minimum(leave, far)
        return enter, leave

    def first_crossings_inside(self, begins, directions, lengths):
        """The t of the first crossing of rays in index space that begin in the grid and leave it at t = length."""
        t_hit = np.full(len(begins), np.inf)
        rows, start, end = self.pieces_that_straddle(begins, directions, lengths)
        # The first piece of each ray, then the second one of those that have not hit, and so on.
        pieces = np.flatnonzero(np.diff(rows, prepend=-1))
        while len(pieces):
            row = rows[pieces]
            middle, half = (start[pieces] + end[pieces]) / 2, (end[pieces] - start[pieces]) / 2
            t = middle[:, None] + half[:, None] * self.nodes
            series = self.values(begins[row, None] + t[..., None] * directions[row, None]) @ self.to_series
            root = np.full(len(pieces), np.nan)
            undecided = np.abs(series[:, 0]) <= np.abs(series[:, 1:]).sum(axis=1)
            root[undecided] = first_sign_changes(series[undecided])
            hit = np.isfinite(root)
            t_hit[row[hit]] = (middle + half * root)[hit]
            following = pieces[~hit] + 1
            following = following[following < len(rows)]
            pieces = following[rows[following] == rows[following - 1]]
        return t_hit

    def pieces_that_straddle(self, begins, directions, lengths):
        """Pieces of rays between two planes of the grid, in cells that straddle the level: the row of the ray, and t of
        the ends, in the order of rows and of t."""
        columns = [np.zeros((len(begins), 1)), lengths[:, None]]
        for axis in range(3):
            planes = self.first_plane + np.arange(self.cells[axis] + 1)
            with np.errstate(divide="ignore", invalid="ignore"):
                t = (planes - begins[:, axis, None]) / directions[:, axis, None]
            inner = (t > 0) & (t < lengths[:, None])  # false for NaN
            columns.append(np.where(inner, t, lengths[:, None]))
        t = np.sort(np.concatenate(columns, axis=1), axis=1)
        middle = (t[:, 1:] + t[:, :-1]) / 2
        cell = np.zeros(middle.shape, np.int64)
        for axis in (2, 1, 0):
            at = begins[:, axis, None] + middle * directions[:, axis, None] - self.first_plane
            cell = cell * self.straddles.shape[2 - axis] + np.clip(at.astype(np.int64), 0, self.cells[axis] - 1)
        long_enough = np.diff(t, axis=1) > 1e-13 * np.maximum(1.0, lengths[:, None])
        rows, places = np.nonzero(long_enough & self.straddles.ravel()[cell])
        return rows, t[rows, places], t[rows, places + 1]


def first_sign_changes(series):
    """The first s in [-1, 1] where each Chebyshev series (N, count) changes its sign, 0 being positive, or NaN."""
    # The real parts of complex roots cut a monotone piece in two, which is harmless.
    cuts = np.sort(np.concatenate([np.tile([-1.0, 1.0], (len(series), 1)), critical_points(series)], axis=1), axis=1)
    negative = chebyshev.chebval(cuts, series.T[..., None], tensor=False) < 0
    changes = negative[:, 1:] != negative[:, :-1]
    (rows,) = np.nonzero(changes.any(axis=1))
    first = changes[rows].argmax(axis=1)
    lower, upper, begins_negative = cuts[rows, first], cuts[rows, first + 1], negative[rows, first]
    coefficients = series[rows].T
    for _ in range(60):
        middle = (lower + upper) / 2
        before = (chebyshev.chebval(middle, coefficients, tensor=False) < 0) == begins_negative
        lower, upper = np.where(before, middle, lower), np.where(before, upper, middle)
    roots = np.full(len(series), np.nan)
    roots[rows] = upper
    return roots


def critical_points(series):
    """The roots of the derivatives of Chebyshev series (N, count), clipped to [-1, 1] and filled up with 1."""
    slopes = chebyshev.chebder(series, axis=1)
    kept = np.abs(slopes) > 1e-13 * np.abs(series).max(axis=1, keepdims=True)
    degrees = np.where(kept.any(axis=1), slopes.shape[1] - 1 - kept[:, ::-1].argmax(axis=1), 0)
    points = np.ones((len(series), slopes.shape[1] - 1))
    for degree in range(1, slopes.shape[1]):
        rows = degrees == degree
        points[rows, :degree] = np.clip(roots_of(slopes[rows, : degree + 1]), -1, 1)
    return points


def roots_of(series):
    """Real parts of the roots of Chebyshev series (N, degree + 1) of full degree, as numpy.polynomial has them."""
    degree = series.shape[1] - 1
    if degree == 1:
        return -series[:, :1] / series[:, 1:]
    monic = np.zeros(degree + 1)
    monic[degree] = 1
    companions = np.tile(chebyshev.chebcompanion(monic), (len(series), 1, 1))
    scale = np.r_[1.0, np.full(degree - 1, np.sqrt(0.5))]
    companions[:, :, -1] -= series[:, :-1] / series[:, -1:] * (scale / scale[-1]) / 2
    return np.linalg.eigvals(companions[:, ::-1, ::-1]).real
