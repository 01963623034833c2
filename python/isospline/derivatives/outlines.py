"""Outlines in pictures, by the tube estimator: docs/method.md, "Derivatives of pictures"."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from ..scene.cells import cell_shift

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from .film import Film, Samples

#: How far from an outline its two sides are looked at, in pixels.
BESIDE = 1e-6
#: Newton's method ends when it moves by less, in pixels.
_SETTLED = 1e-9
_MOST_STEPS = 12
#: Cells that are larger, in pixels, have starts in pieces of this size.
_LARGE = 32.0
_MOST_PIECES = 24
#: Pairs of a sample and a start that are looked at together.
_PAIRS_AT_A_TIME = 2_000_000


@dataclass
class Feet:
    """The feet of samples on the outlines of one object, N of them: what moves there, and how much it counts."""

    positions: NDArray[np.float64]  # (N, 2), pixels
    t: NDArray[np.float64]
    points: NDArray[np.float64]  # (N, 3), in the space of the object
    is_edge: NDArray[np.bool_]  # else rays are tangent there
    outward: NDArray[np.float64]  # (N, 2), unit, in the picture
    #: Of the function of the picture whose zeros are the outline: (N, 3), by the point in the space of the object.
    gradients: NDArray[np.float64]
    #: The outline moves outward by this times a change of that function.
    speeds: NDArray[np.float64]
    #: How far from t the surface is, at most, on rays at the distance `beside`.
    margins: NDArray[np.float64]
    widths: NDArray[np.float64]  # of the tube, on each side, in pixels
    distances: NDArray[np.float64]  # of the samples, outward, in pixels; up to the width
    curvatures: NDArray[np.float64]  # of the outline, per pixel; positive where it is convex outward
    samples: NDArray[np.int64]  # the index of each foot's sample

    @property
    def stretch(self):
        """The area around the samples, for areas of the same width and length along the outline."""
        return np.abs(1.0 + self.curvatures * self.distances)

    def select(self, which) -> Feet:
        return Feet(**{each.name: getattr(self, each.name)[which] for each in fields(self)})

    @staticmethod
    def joined(parts: list[Feet]) -> Feet:
        names = [each.name for each in fields(Feet)]
        return Feet(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


class Outlines:
    """The outlines of a surface within `tube` pixels of the pixels that have samples.

    `film` has rays in the space of the surface.
    """

    def __init__(self, surface, film: Film, samples: Samples, tube: float):
        self.surface, self.film, self.tube = surface, film, tube
        self.planes = surface._end_planes()
        curves: list[Any] = [_Tangency(surface, film)]
        curves += [_Edge(surface, film, plane) for plane in self.planes]
        found = [(curve, curve.starts(samples, tube)) for curve in curves]
        self.curves = [(curve, starts) for curve, starts in found if len(starts)]

    def feet(self, samples: Samples) -> Feet | None:
        """The feet of samples within the tube of an outline, or half its radius; None if there are none.

        They may be hidden, outside of the picture, or in cells that are not in the surface.
        """
        if not len(samples.positions):
            return None
        found = (_feet_of(curve, starts, self.film, samples, self.tube) for curve, starts in self.curves)
        parts = [feet for feet in found if feet is not None]
        if not parts:
            return None
        feet = Feet.joined(parts)
        margin = 1e-9 * np.abs(self.surface.volume.bounds).max()
        return feet.select((feet.points @ self.planes[:, :3].T >= self.planes[:, 3] - margin).all(axis=1))


@dataclass
class _Equations:
    """The equations of an outline at positions u and t, and their derivatives."""

    f: Any  # f - level, with f_u and f_t
    f_u: Any
    f_t: Any
    c: Any  # the other function that is zero on the outline
    c_u: Any
    c_t: Any
    q: Any  # across the outline in the picture, (N, 2)
    q_u: Any  # (N, 2, 2)
    q_t: Any
    points: Any
    gradients: Any  # of f, at the points

    def bend(self):
        """Along the curve in the picture: unit normals, along q, and tangents; changes of t, and curvatures."""
        length = np.linalg.norm(self.q, axis=1)
        normals = self.q / length[:, None]
        tangents = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
        along_t = -(self.c_u * tangents).sum(axis=1) / self.c_t
        turned = np.einsum("nij,nj->ni", self.q_u, tangents) + self.q_t * along_t[:, None]
        return normals, tangents, along_t, (tangents * turned).sum(axis=1) / length


class _Curve:
    """A curve on the surface that may be seen as an outline: f = level, and another equation."""

    def __init__(self, surface, film):
        self.surface, self.film, self.volume, self.level = surface, film, surface.volume, surface.level
        self.shift = cell_shift(surface.volume)

    cells: Callable[[], Any]  # cells that may have a part of the curve
    other: Callable[..., Any]  # the other function and its gradient, at points of the object's space
    complete: Callable[..., _Equations]

    def jets(self, points):
        sample = self.volume.sample
        return sample(points) - self.level, sample(points, derivative=1), sample(points, derivative=2)

    def index(self, points):
        inverse = np.linalg.inv(self.volume.affine)
        return points @ inverse[:3, :3].T + inverse[:3, 3]

    def starts(self, samples, tube):
        """Points of the curve, in all cells that it passes through as a rule; finer in cells that are large to see."""
        cells = self.cells()
        first, last = self.seen_boxes(cells)
        corner = samples.corner - tube
        near = (last >= corner).all(axis=1) & (first <= corner + (samples.width, samples.height) + 2.0 * tube).all(
            axis=1
        )
        pieces = np.clip(np.ceil((last - first).max(axis=1) / _LARGE), 2, _MOST_PIECES).astype(np.int64)
        found = [self.starts_in(cells[near & (pieces == count)], count) for count in np.unique(pieces[near])]
        return np.concatenate([np.empty((0, 3)), *found])

    def seen_boxes(self, cells):
        """The boxes of cells in the picture: for those around the eye all of it, for those behind it nothing."""
        corners = cells - self.shift
        first, last = np.full((len(cells), 2), np.inf), np.full((len(cells), 2), -np.inf)
        behind, ahead = np.zeros(len(cells), bool), np.zeros(len(cells), bool)
        affine = self.volume.affine
        for corner in np.ndindex(2, 2, 2):
            positions, t = self.film.project((corners + corner) @ affine[:3, :3].T + affine[:3, 3])
            behind |= ~(t > 0.0) | ~np.isfinite(positions).all(axis=1)
            ahead |= ~(t <= 0.0)
            first, last = np.fmin(first, positions), np.fmax(last, positions)
        first[behind], last[behind] = -np.inf, np.inf
        first[~ahead], last[~ahead] = np.inf, -np.inf
        return first, last

    def starts_in(self, cells, pieces):
        """Points found by Newton's method from `pieces`^3 points of each cell."""
        affine = self.volume.affine
        linear = affine[:3, :3]
        places = (np.argwhere(np.ones((pieces, pieces, pieces))) + 0.5) / pieces
        corners = np.repeat(cells - self.shift, len(places), axis=0)
        points = (corners + np.tile(places, (len(cells), 1))) @ linear.T + affine[:3, 3]
        reach = 0.5 * np.linalg.norm(linear, axis=0).max()
        near = np.ones(len(points), bool)
        for _ in range(8):
            step, near_now = self.step_to(points, reach)
            points = points + step
            near = near_now & (np.abs(self.index(points) - corners - 0.5) < 1.0).all(axis=1)
            points, corners, step = points[near], corners[near], step[near]
        index = self.index(points)
        inside = (np.abs(index - corners - 0.5) < 0.6).all(axis=1) & (np.linalg.norm(step, axis=1) < 1e-3 * reach)
        points, index = points[inside], index[inside]
        _, first = np.unique(np.floor(1.5 * pieces * index).astype(np.int64), axis=0, return_index=True)
        return points[np.sort(first)]

    def step_to(self, points, reach):
        """Steps of Newton's method, the shortest ones, to the curve; and whether there are any."""
        value, gradient, hessian = self.jets(points)
        other, by_point = self.other(points, gradient, hessian)
        rows = np.stack([gradient, by_point], axis=1)
        square = rows @ rows.transpose(0, 2, 1)
        determinant = square[:, 0, 0] * square[:, 1, 1] - square[:, 0, 1] ** 2
        good = determinant > 1e-20 * square[:, 0, 0] * square[:, 1, 1]
        determinant = np.where(good, determinant, 1.0)
        a = (square[:, 1, 1] * value - square[:, 0, 1] * other) / determinant
        b = (square[:, 0, 0] * other - square[:, 0, 1] * value) / determinant
        step = -(a[:, None] * gradient + b[:, None] * by_point)
        length = np.linalg.norm(step, axis=1)
        return step * np.minimum(1.0, reach / np.maximum(length, 1e-300))[:, None], good

    def equations(self, u, t) -> _Equations:
        film = self.film
        rays = film.rays(u)
        directions = rays[:, 3:]
        points = rays[:, :3] + t[:, None] * directions
        by_u = film.origins + t[:, None, None] * film.directions
        value, gradient, hessian = self.jets(points)
        turned, across = np.einsum("nij,nj->ni", hessian, directions), hessian @ by_u
        f_u = np.einsum("ni,nij->nj", gradient, by_u)
        f_t = (gradient * directions).sum(axis=1)
        f_tt = (directions * turned).sum(axis=1)
        f_tu = np.einsum("ni,nij->nj", turned, by_u) + gradient @ film.directions
        f_uu = by_u.transpose(0, 2, 1) @ across
        return self.complete(value, f_u, f_t, f_tt, f_tu, f_uu, directions, by_u, points, gradient)


class _Tangency(_Curve):
    """Where rays are tangent to the surface: the derivative of f along the ray is zero."""

    def cells(self):
        return self.surface._outline_cells(self.film.eye)

    def other(self, points, gradient, hessian):
        eye = self.film.eye
        view = eye[3] * points - eye[:3]
        return (gradient * view).sum(axis=1), np.einsum("nij,nj->ni", hessian, view) + eye[3] * gradient

    def complete(self, value, f_u, f_t, f_tt, f_tu, f_uu, directions, by_u, points, gradients):
        return _Equations(value, f_u, f_t, f_t, f_tu, f_tt, f_u, f_uu, f_tu, points, gradients)

    def outcome(self, at: _Equations):
        """The signs of the outward direction along q, gradients, speeds and margins."""
        slopes = np.linalg.norm(at.q, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            signs = np.sign(at.c_t)  # f - level has it on the side of rays that pass by
            # Twice the half of the chord that the ray has in the parabola.
            return signs, at.gradients, -signs / slopes, 2.0 * np.sqrt(2.0 * BESIDE * slopes / np.abs(at.c_t))


class _Edge(_Curve):
    """Where the surface ends on a plane: of its clip, or of the border of the volume."""

    def __init__(self, surface, film, plane):
        super().__init__(surface, film)
        self.normal, self.offset = plane[:3], plane[3]

    def cells(self):
        cells = self.surface.shell.cells
        affine = self.volume.affine
        # <normal, x> - offset at the lower corners, and its range over a cell.
        slopes = self.normal @ affine[:3, :3]
        lower = (cells - self.shift) @ slopes + self.normal @ affine[:3, 3] - self.offset
        margin = 1e-9 * np.abs(slopes).sum()
        reach = lower + np.minimum(slopes, 0.0).sum(), lower + np.maximum(slopes, 0.0).sum()
        return cells[(reach[0] <= margin) & (reach[1] >= -margin)]

    def other(self, points, gradient, hessian):
        return points @ self.normal - self.offset, np.broadcast_to(self.normal, points.shape)

    def complete(self, value, f_u, f_t, f_tt, f_tu, f_uu, directions, by_u, points, gradients):
        c_t, c_u = directions @ self.normal, np.einsum("i,nij->nj", self.normal, by_u)
        turn = self.normal @ self.film.directions
        q = f_u * c_t[:, None] - f_t[:, None] * c_u
        q_u = f_uu * c_t[:, None, None] + f_u[:, :, None] * turn - c_u[:, :, None] * f_tu[:, None, :]
        q_t = f_tu * c_t[:, None] - f_tt[:, None] * c_u - f_t[:, None] * turn
        return _Equations(value, f_u, f_t, points @ self.normal - self.offset, c_u, c_t, q, q_u, q_t, points, gradients)

    def outcome(self, at: _Equations):
        with np.errstate(divide="ignore", invalid="ignore"):
            gradients = at.gradients - (at.f_t / at.c_t)[:, None] * self.normal
            speeds = -np.abs(at.c_t) / np.linalg.norm(at.q, axis=1)
            steepest = np.linalg.norm(at.f_u, axis=1) / np.abs(at.f_t), np.linalg.norm(at.c_u, axis=1) / np.abs(at.c_t)
        return np.sign(at.c_t), gradients, speeds, 2.0 * BESIDE * np.maximum(*steepest)


def _feet_of(curve, starts, film, samples, tube) -> Feet | None:
    """The feet of samples on one curve; None if there are none."""
    positions, t = film.project(starts)
    ahead = (t > 0.0) & np.isfinite(positions).all(axis=1)
    positions, t, starts = positions[ahead], t[ahead], starts[ahead]
    at = curve.equations(positions, t)
    with np.errstate(divide="ignore", invalid="ignore"):
        normals, tangents, along_t, curvatures = at.bend()
    # What a piece of a cell measures in the picture is how far the curve may be from the next start.
    linear = curve.volume.affine[:3, :3]
    edges = np.stack([film.project(at.points + edge)[0] - positions for edge in linear.T])
    sizes = np.sqrt((edges**2).sum(axis=(0, 2)))
    reach = sizes / np.clip(np.ceil(sizes / _LARGE), 2, _MOST_PIECES)
    good = np.isfinite(np.column_stack([normals, along_t, curvatures, reach])).all(axis=1)
    positions, t, starts, reach = positions[good], t[good], starts[good], reach[good]
    normals, tangents, along_t, curvatures = normals[good], tangents[good], along_t[good], curvatures[good]
    # Of the starts in a small part of a cell, each sample takes the nearest.
    homes = np.floor(3.0 * (curve.index(starts) + curve.shift)).astype(np.int64)
    homes = np.unique(homes, axis=0, return_inverse=True)[1].reshape(-1)
    parts = []
    for group in np.unique(np.ceil(reach + tube)):
        chosen = np.flatnonzero(np.ceil(reach + tube) == group)
        per_pixel = len(samples.positions) / (samples.width * samples.height)
        chunk = max(1, int(_PAIRS_AT_A_TIME / min((2 * group + 1) ** 2 * per_pixel, len(samples.positions))))
        for begin in range(0, len(chosen), chunk):
            some = chosen[begin : begin + chunk]
            start, sample = samples.near(positions[some], int(group))
            start = some[start]
            offsets = samples.positions[sample] - positions[start]
            across = (offsets * normals[start]).sum(axis=1)
            # Normals spread: a foot is nearer to the start than its sample, by this.
            spread = np.clip(1.0 + curvatures[start] * across, 0.25, 4.0)
            along = (offsets * tangents[start]).sum(axis=1) / spread
            bend = 0.5 * np.clip(curvatures[start] * along**2, -np.abs(along), np.abs(along))
            near = np.abs(along) <= 1.5 * reach[start]
            near &= np.abs(across + bend) <= 1.5 * tube + np.abs(bend) + 0.5
            start, sample, along, bend = start[near], sample[near], along[near], bend[near]
            best = _first_of_each(sample, homes[start], np.abs(along))
            start, sample, along, bend = start[best], sample[best], along[best], bend[best]
            u = positions[start] + along[:, None] * tangents[start] - bend[:, None] * normals[start]
            parts.append(_solve(curve, film, samples, sample, u, t[start] + along * along_t[start], tube))
    return _without_repeats(Feet.joined(parts)) if parts else None


def _first_of_each(first, second, order):
    """The indices, for each pair of (first, second), of the smallest `order`."""
    sorted_by = np.lexsort([order, second, first])
    changes = np.append(True, (np.diff(first[sorted_by]) != 0) | (np.diff(second[sorted_by]) != 0))
    return np.sort(sorted_by[changes[: len(sorted_by)]])


def _solve(curve, film, samples, sample, u, t, tube) -> Feet:
    """The nearest points of a curve to samples, by Newton's method from (u, t)."""
    p = samples.positions[sample]
    settled = np.zeros(len(p), bool)
    reach = np.linalg.norm(curve.volume.affine[:3, :3], axis=0).max()
    for step_count in range(_MOST_STEPS):
        active = np.flatnonzero(~settled)
        if not len(active):
            break
        at = curve.equations(u[active], t[active])
        offset = u[active] - p[active]
        # Unknowns of like sizes: pixels, and t in cells.
        directions = film.rays(u[active])[:, 3:]
        in_t = reach / np.linalg.norm(directions, axis=1)
        system = np.empty((len(active), 3, 3))
        system[:, 0, :2], system[:, 0, 2] = at.f_u, at.f_t
        system[:, 1, :2], system[:, 1, 2] = at.c_u, at.c_t
        system[:, 2, 0] = at.q[:, 1] + _cross(offset, at.q_u[:, :, 0])
        system[:, 2, 1] = -at.q[:, 0] + _cross(offset, at.q_u[:, :, 1])
        system[:, 2, 2] = _cross(offset, at.q_t)
        system[:, :, 2] *= in_t[:, None]
        values = np.stack([at.f, at.c, _cross(offset, at.q)], axis=1)
        sizes = np.abs(system).max(axis=2, keepdims=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            system, values = system / sizes, values / sizes[:, :, 0]
        good = np.isfinite(system).all(axis=(1, 2)) & (
            np.abs(np.linalg.det(np.where(np.isfinite(system), system, 0.0))) > 1e-14
        )
        system[~good], values[~good] = np.eye(3), np.nan
        step = -np.linalg.solve(system, values[:, :, None])[:, :, 0]
        length = np.maximum(np.linalg.norm(step[:, :2], axis=1) / (4.0 * tube + 1.0), 0.5 * np.abs(step[:, 2]))
        step /= np.maximum(length, 1.0)[:, None]
        u[active] += step[:, :2]
        t[active] += step[:, 2] * in_t
        settled[active] = np.linalg.norm(step[:, :2], axis=1) < _SETTLED
        kept = np.isfinite(u).all(axis=1) & (
            np.linalg.norm(u - p, axis=1) < (4.0 if step_count < 2 else 1.5) * tube + 1.0
        )
        sample, p, u, t, settled = sample[kept], p[kept], u[kept], t[kept], settled[kept]
    near = settled & (np.linalg.norm(u - p, axis=1) <= tube) & (t > 0.0)
    sample, p, u, t = sample[near], p[near], u[near], t[near]
    at = curve.equations(u, t)
    signs, gradients, speeds, margins = curve.outcome(at)
    with np.errstate(divide="ignore", invalid="ignore"):
        normals, _, _, curvature = at.bend()
    outward, curvature = signs[:, None] * normals, signs * curvature
    distance = ((p - u) * outward).sum(axis=1)
    is_edge = np.full(len(u), isinstance(curve, _Edge))
    # Where the outline is strongly curved, the tube is narrower: half of the radius.
    with np.errstate(divide="ignore"):
        widths = np.minimum(tube, 0.5 / np.abs(curvature))
    feet = Feet(u, t, at.points, is_edge, outward, gradients, speeds, margins, widths, distance, curvature, sample)
    numbers = np.column_stack([outward, speeds, margins, curvature])
    return feet.select(np.isfinite(numbers).all(axis=1) & (np.abs(distance) <= widths))


def _cross(a, b):
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _without_repeats(feet: Feet) -> Feet:
    """One of the feet of a sample that are the same but for rounding."""
    keys = np.column_stack(
        [
            feet.samples,
            np.round(feet.positions * 1e4),
            np.round(feet.t / np.maximum(np.abs(feet.t).max(initial=1e-300), 1e-300) * 1e5),
        ]
    )
    order = np.lexsort(keys.T[::-1])
    ordered = keys[order]
    close = (np.abs(np.diff(ordered[:, 1:], axis=0)) <= 1.0).all(axis=1) & (np.diff(ordered[:, 0]) == 0)
    return feet.select(np.sort(order[np.append(True, ~close)])) if len(order) else feet
