"""First crossings of rays in float64, by NumPy and SciPy alone: shares no code with isospline.

Between two planes of the grid of cells, f along a ray is one polynomial of degree 3n. It is sampled at 3n+1 Chebyshev
points by scipy.ndimage.map_coordinates, which makes it known. Where the constant term of its Chebyshev series is larger
than all others together it has no root. Otherwise it is cut at the roots of its derivative, and where the signs at the
ends of a monotone piece differ, there is the root: none is missed, not even a pair of them close together.
"""

import numpy as np
from numpy.polynomial import chebyshev
from scipy import ndimage, optimize

#: Boundary rules of isospline.Volume and the modes of scipy.ndimage that are the same.
MODES = {"mirror": "mirror", "periodic": "grid-wrap"}


class Oracle:
    """The B-spline model of samples [z, y, x], with coefficients in float64, or of coefficients that are given."""

    def __init__(self, data, level, affine, degree=2, boundary="mirror", coefficients=None):
        self.level = float(level)
        self.degree = degree
        self.mode = MODES[boundary]
        if coefficients is None:  # degree 1 interpolates as it is
            coefficients = ndimage.spline_filter(data, degree, np.float64, self.mode) if degree > 1 else data
        self.coefficients = coefficients
        self.world_to_index = np.linalg.inv(affine)
        # even degrees: a cell is centred on a sample
        self.first_plane = -0.5 if degree % 2 == 0 else 0.0
        self.cells = np.array(data.shape[::-1]) - degree % 2

        count = 3 * degree + 1
        self.nodes = chebyshev.chebpts1(count)
        self.to_series = np.linalg.inv(chebyshev.chebvander(self.nodes, count - 1)).T

    def values(self, points):
        """f - level at (..., 3) points in index space."""
        coordinates = np.moveaxis(points[..., ::-1], -1, 0).astype(np.float64)
        values = ndimage.map_coordinates(
            self.coefficients, coordinates, np.float64, self.degree, self.mode, prefilter=False
        )
        return values - self.level

    def to_index(self, rays):
        """Origins and directions of world rays (N, 6) in index space, in extended precision where the machine has it:
        for grazing rays from far away the rounding of float64, at the eye, would be the largest error of all."""
        rays = np.asarray(rays, dtype=np.longdouble)
        linear = self.world_to_index[:3, :3].T.astype(np.longdouble)
        return rays[:, :3] @ linear + self.world_to_index[:3, 3], rays[:, 3:] @ linear

    def voxels_per_t(self, rays):
        """Length of the directions of world rays (N, 6) in index space."""
        return np.linalg.norm(self.to_index(rays)[1], axis=1).astype(np.float64)

    def first_crossings(self, rays):
        """t >= 0 of the first crossing of world rays (N, 6), in units of the direction's length; inf for none."""
        origins, directions = self.to_index(rays)
        return np.array([self.first_crossing(*ray) for ray in zip(origins, directions)], dtype=np.float64)

    def first_crossing(self, origin, direction):
        """The same for one ray in index space."""
        planes = self.plane_crossings(origin, direction)
        if len(planes) < 2:
            return np.inf
        start, length = planes[:-1], np.diff(planes)
        t = start[:, None] + length[:, None] * (0.5 + 0.5 * self.nodes)
        series = self.values(origin + t[..., None] * direction) @ self.to_series
        undecided = np.abs(series[:, 0]) <= np.abs(series[:, 1:]).sum(axis=1)
        for piece in np.flatnonzero(undecided):
            root = first_sign_change(series[piece])
            if root is not None:
                return start[piece] + length[piece] * (0.5 + 0.5 * root)
        return np.inf

    def plane_crossings(self, origin, direction):
        """Ascending t where the ray is inside the grid of cells: where it enters, crosses a plane of it, and leaves."""
        enter, leave, inner = 0.0, np.inf, [np.empty(0)]
        for axis in range(3):
            planes = self.first_plane + np.arange(self.cells[axis] + 1)
            if direction[axis] == 0:
                if not planes[0] <= origin[axis] <= planes[-1]:
                    return np.empty(0)
                continue
            t = (planes - origin[axis]) / direction[axis]
            enter, leave = max(enter, t.min()), min(leave, t.max())
            inner.append(t)
        if enter >= leave:
            return np.empty(0)
        t = np.concatenate(inner)
        t = np.sort(np.concatenate([[enter, leave], t[(t > enter) & (t < leave)]]))
        return t[np.concatenate([[True], np.diff(t) > 1e-13 * max(1.0, abs(leave))])]


def first_sign_change(series):
    """The first s in [-1, 1] where a Chebyshev series changes its sign, 0 counting as positive, or None."""
    scale = np.abs(series).max()
    slope = chebyshev.chebtrim(chebyshev.chebder(series), 1e-13 * scale)
    # Real parts of complex roots cut a monotone piece in two, which does no harm.
    critical = np.clip(chebyshev.chebroots(slope).real, -1, 1) if len(slope) > 1 else np.empty(0)
    cuts = np.concatenate([[-1], np.sort(critical), [1]])
    negative = chebyshev.chebval(cuts, series) < 0
    changes = np.flatnonzero(negative[1:] != negative[:-1])
    if len(changes) == 0:
        return None
    lower, upper = cuts[changes[0]], cuts[changes[0] + 1]
    if chebyshev.chebval(upper, series) == 0:
        return upper
    return optimize.brentq(chebyshev.chebval, lower, upper, args=(series,), xtol=1e-14)
