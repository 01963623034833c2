"""Rays at spline volumes in exact integer arithmetic: what is proven of a ray, checked without rounding.

The real roots of polynomials are those that FLINT isolates (python-flint).
"""

from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from math import factorial, floor, gcd, inf, nextafter

import numpy as np
import pytest

import isospline

flint = pytest.importorskip("flint")  # not in the lowest versions

#: Maps with exact inverses, whose numbers binary fractions represent.
MAPS = [np.eye(4), np.diag([2.0, 0.5, 4.0, 1.0]), [[1, 1, 0, 3], [0, 1, 0, -2.5], [0, 0, 2, 1], [0, 0, 0, 1]]]

#: The n+1 weights of a cell's coefficients, times n!, as polynomials of the local coordinate, constant term first.
WEIGHTS = {
    1: ((1, -1), (0, 1)),
    2: ((1, -2, 1), (1, 2, -2), (0, 0, 1)),
    3: ((1, -3, 3, -1), (4, 0, -6, 3), (1, 3, 3, -3), (0, 0, 0, 1)),
}


def product(a, b):
    result = [0] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        if x:
            for j, y in enumerate(b):
                result[i + j] += x * y
    return result


def added(a, b, factor):
    return [x + factor * y for x, y in zip(a, b, strict=True)]


def stripped(polynomial):
    """Without zeros at its end, divided by its content."""
    while polynomial and polynomial[-1] == 0:
        polynomial = polynomial[:-1]
    content = gcd(*polynomial)
    return [each // content for each in polynomial] if content else []


def sign_at(polynomial, at):
    value, power = 0, 1
    for coefficient in reversed(polynomial):
        value = value * at.numerator + coefficient * power
        power *= at.denominator
    return (value > 0) - (value < 0)


def has_root(polynomial, begin, end):
    """Whether an integer polynomial is zero anywhere in [begin, end]."""
    polynomial = stripped(polynomial)
    if not polynomial or sign_at(polynomial, begin) == 0 or sign_at(polynomial, end) == 0:
        return True
    if sign_at(polynomial, begin) != sign_at(polynomial, end):
        return True
    return begin < end and has_root_between(polynomial, begin, end)


def has_root_between(polynomial, *ends):
    """Whether an integer polynomial is zero in an interval, not at its ends: by the roots that FLINT isolates."""
    for precision in (64, 256, 1024, 4096):
        with flint.ctx.workprec(precision):
            begin, end = (flint.arb(flint.fmpq(each.numerator, each.denominator)) for each in ends)
            roots = [root.real for root, _ in flint.fmpz_poly(polynomial).complex_roots() if root.imag == 0]
            if any(begin < root and root < end for root in roots):
                return True
            if all(root < begin or root > end for root in roots):
                return False
    raise AssertionError("a root is too near to an end")


class ExactModel:
    """A spline model by its coefficients minus the level: integers, with the padding, in an array [z, y, x]."""

    def __init__(self, coefficients, degree):
        self.coefficients = coefficients.tolist()
        self.degree = degree
        self.shape = [n - degree for n in reversed(coefficients.shape)]

    def segments(self, origin, direction, t_near, t_far):
        """(polynomial of t, t_begin, t_end) for the cells along a ray in lattice space, t_near to t_far.

        Origin and direction are integers over a common denominator, which the polynomial does not have.
        """
        begin, end = Fraction(t_near), None if t_far == float("inf") else Fraction(t_far)
        for o, d, n in zip(origin, direction, self.shape, strict=True):
            if d == 0:
                if not 0 <= o <= n:
                    return
                continue
            first, last = sorted((-o / d, (n - o) / d))
            begin, end = max(begin, first), last if end is None else min(end, last)
        if begin > end:
            return
        planes = {begin, end}
        for o, d, n in zip(origin, direction, self.shape, strict=True):
            if d != 0:
                planes |= {t for k in range(n + 1) if begin < (t := (k - o) / d) < end}
        places = sorted(planes)
        for first, last in pairwise(places) if len(places) > 1 else [(begin, begin)]:
            middle = (first + last) / 2
            cell = [min(floor(o + middle * d), n - 1) for o, d, n in zip(origin, direction, self.shape, strict=True)]
            yield self.polynomial(cell, origin, direction), first, last

    def signs_at_ends(self, origin, direction, t_near, t_far):
        """The signs of f - level at both ends of the part of a ray in the domain; none if there is no such part."""
        places = [t for _, *ends in self.segments(origin, direction, t_near, t_far) for t in ends]
        points = [[o + t * d for o, d in zip(origin, direction, strict=True)] for t in places[:1] + places[-1:]]
        return [(value > 0) - (value < 0) for value in map(self.value, points)]

    def polynomial(self, cell, origin, direction):
        """f - level in a cell along the line, times a positive integer; constant if all coefficients have one sign."""
        n = self.degree
        block = [
            [self.coefficients[cell[2] + k][cell[1] + j][cell[0] : cell[0] + n + 1] for j in range(n + 1)]
            for k in range(n + 1)
        ]
        numbers = [each for plane in block for row in plane for each in row]
        if min(numbers) > 0 or max(numbers) < 0:
            return [numbers[0]]
        axes = [
            weights_along(n, (o - c).as_integer_ratio(), d.as_integer_ratio())
            for c, o, d in zip(cell, origin, direction, strict=True)
        ]
        total = [0] * (3 * n + 1)
        for k, plane in enumerate(block):
            of_plane = [0] * (2 * n + 1)
            for j, row in enumerate(plane):
                line = [0] * (n + 1)
                for i, each in enumerate(row):
                    line = added(line, axes[0][i], each)
                of_plane = added(of_plane, product(line, axes[1][j]), 1)
            total = added(total, product(of_plane, axes[2][k]), 1)
        return total

    def touches(self, origin, direction, t_near, t_far):
        """Whether a point of the ray is on the surface."""
        return any(has_root(*segment) for segment in self.segments(origin, direction, t_near, t_far))

    def value(self, point):
        """f - level at the point of the domain that is nearest along each axis."""
        n = self.degree
        clamped = [min(max(x, Fraction(0)), Fraction(size)) for x, size in zip(point, self.shape, strict=True)]
        cell = [min(floor(x), size - 1) for x, size in zip(clamped, self.shape, strict=True)]
        weights = [
            [sum(c * (x - k) ** power for power, c in enumerate(weight)) / factorial(n) for weight in WEIGHTS[n]]
            for x, k in zip(clamped, cell, strict=True)
        ]
        return sum(
            wz * wy * wx * self.coefficients[cell[2] + k][cell[1] + j][cell[0] + i]
            for k, wz in enumerate(weights[2])
            for j, wy in enumerate(weights[1])
            for i, wx in enumerate(weights[0])
        )


@lru_cache(maxsize=4096)
def weights_along(degree, origin, direction):
    """The weights at origin + t direction, two fractions, as polynomials of t, times one positive integer."""
    denominator = origin[1] * direction[1] // gcd(origin[1], direction[1])
    line = [origin[0] * (denominator // origin[1]), direction[0] * (denominator // direction[1])]
    powers = [[1]]
    for _ in range(degree):
        powers.append(product(powers[-1], line))
    result = []
    for weight in WEIGHTS[degree]:
        total = [0] * (degree + 1)
        for power, each in enumerate(weight):
            scaled = [x * each * denominator ** (degree - power) for x in powers[power]]
            total = [x + y for x, y in zip(total, scaled + [0] * (degree - power), strict=True)]
        result.append(total)
    return result


def solved(matrix, right):
    """The exact solution of three linear equations, by Cramer's rule."""
    columns, right = list(zip(*(row[:3] for row in matrix[:3]), strict=True)), tuple(right)

    def determinant(a, b, c):
        crossed = (b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0])
        return sum(x * y for x, y in zip(a, crossed, strict=True))

    replaced = ([right if i == axis else column for i, column in enumerate(columns)] for axis in range(3))
    return [determinant(*each) / determinant(*columns) for each in replaced]


MISS, HIT, UNDECIDED = range(3)


class Case:
    """A small model of integer coefficients, at an integer level, in a scene; and the same in exact arithmetic.

    `sparse` models are larger, with a surface in small parts of them.
    """

    def __init__(self, rng, degree, placed=False, sparse=False):
        size = int(rng.integers(20, 90) if sparse else rng.integers(3, 6))
        samples = rng.integers(-3, 4, (size, size, size)).astype(float)
        self.boxes = []  # in which the surface of a sparse model is: corners along x, y, z
        if sparse:
            inside = np.zeros(samples.shape, dtype=bool)
            self.boxes = rng.integers(0, size - 2, (4, 3))
            for corner in self.boxes:
                inside[tuple(slice(x, x + n) for x, n in zip(corner[::-1], rng.integers(2, 12, 3), strict=True))] = True
            samples[~inside] = rng.choice([-3, 3])
        elif rng.random() < 0.6:  # rough samples leave little of a surface at higher degrees
            samples = np.sort(samples, axis=rng.integers(3))
        samples[0, 0, :2] = -3, 3  # so that levels are in the range
        grid = {}
        if placed:  # in any way, so that maps and their inverses are rounded
            direction, _ = np.linalg.qr(rng.normal(size=(3, 3)))
            grid = {"spacing": rng.uniform(0.1, 3, 3), "origin": rng.normal(size=3), "direction": direction}
        self.volume = isospline.Volume(samples, degree=degree, filter="none", **grid)
        self.level = int(rng.choice([-1, 0, 0, 1]))
        self.transform = np.array(MAPS[rng.integers(len(MAPS))], dtype=float)
        if placed:
            self.transform[:3] += rng.normal(size=(3, 4))
        self.to_rays = [[Fraction(x) for x in row] for row in self.transform.tolist()]
        if placed:
            affine = [[Fraction(x) for x in row] for row in self.volume.affine.tolist()]
            self.to_rays = [
                [sum(x * y for x, y in zip(row, column, strict=True)) for column in zip(*affine, strict=True)]
                for row in self.to_rays
            ]
        self.scene = isospline.Scene([(isospline.Isosurface(self.volume, self.level), self.transform)])
        self.size = size
        self.exact = ExactModel(np.pad(samples.astype(int), degree // 2, mode="reflect") - self.level, degree)
        self.shift = Fraction(1, 2) if degree == 2 else Fraction(0)

    def rays(self, rng, count):
        """Through vertices, edges and faces of cells and middles of them, along faces and edges, grazing, or any."""
        grid = rng.integers(-2, 2 * self.size + 2, (2, count, 3)) / 2
        if len(self.boxes):
            grid[1] = rng.choice(self.boxes, count) + rng.integers(-2, 16, (count, 3)) / 2
        origins, directions = grid[0], grid[1] - grid[0]
        along_axes = rng.random(count) < 0.3
        directions[along_axes] *= np.eye(3)[rng.integers(3, size=along_axes.sum())]
        near = rng.random(count) < 0.2  # next to all these
        origins[near] += rng.choice([-1, 1], (near.sum(), 3)) * 2.0 ** -rng.integers(20, 55, (near.sum(), 1))
        any_way = rng.random(count) < 0.2
        directions[any_way] = rng.normal(size=(any_way.sum(), 3))
        directions[(directions == 0).all(axis=1)] = 1, 0, 0
        rays = np.concatenate([origins, directions], axis=1)
        if rng.random() < 0.5:
            rays[:, 3:] /= np.linalg.norm(rays[:, 3:], axis=1, keepdims=True)
        rounded = np.array(self.to_rays, dtype=float)
        linear = rounded[:3, :3]
        return np.concatenate([rays[:, :3] @ linear.T + rounded[:3, 3], rays[:, 3:] @ linear.T], axis=1)

    def lattice_ray(self, ray):
        """The exact origin and direction in lattice space."""
        from_origin = [Fraction(x) - row[3] for x, row in zip(ray[:3], self.to_rays, strict=False)]
        origin, direction = (solved(self.to_rays, each) for each in (from_origin, map(Fraction, ray[3:])))
        return [x + self.shift for x in origin], direction

    def holds(self, ray, status, t_bounds, level_bound, t_near, t_far):
        """Whether what is said of a ray is true."""
        line = self.lattice_ray(ray)
        lower, upper = t_bounds
        if status == MISS:
            return lower == upper == inf and not self.exact.touches(*line, t_near, t_far)
        before = nextafter(lower, -inf)
        if before >= t_near and self.exact.touches(*line, t_near, before):
            return False
        if status == HIT:
            return t_near <= lower <= upper <= t_far and self.exact.touches(*line, lower, upper)
        origin, direction = line
        value = self.exact.value([o + Fraction(lower) * d for o, d in zip(origin, direction, strict=True)])
        return upper == inf and abs(value) <= level_bound
