"""Rays at spline volumes in exact integer arithmetic: what is proven of a ray, checked without rounding."""

from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from math import factorial, floor, gcd

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


def sturm_sequence(polynomial):
    """Remainders up to positive factors."""
    sequence = [stripped(polynomial), stripped([i * each for i, each in enumerate(polynomial)][1:])]
    while len(sequence[-1]) > 1:
        rest, by = list(sequence[-2]), sequence[-1]
        factor = abs(by[-1])
        while len(rest) >= len(by):
            lead = rest[-1] * (1 if by[-1] > 0 else -1)
            rest = [factor * each for each in rest]
            shift = len(rest) - len(by)
            for i, each in enumerate(by):
                rest[shift + i] -= lead * each
            rest.pop()
        rest = stripped([-each for each in rest])
        if not rest:
            break
        sequence.append(rest)
    return sequence


def has_root(polynomial, begin, end):
    """Whether an integer polynomial is zero anywhere in [begin, end]."""
    polynomial = stripped(polynomial)
    if not polynomial or sign_at(polynomial, begin) == 0 or sign_at(polynomial, end) == 0:
        return True
    if sign_at(polynomial, begin) != sign_at(polynomial, end):
        return True
    if begin == end:
        return False
    counts = []
    sequence = sturm_sequence(polynomial)
    for at in (begin, end):
        signs = [sign for each in sequence if (sign := sign_at(each, at))]
        counts.append(sum(a != b for a, b in pairwise(signs)))
    return counts[0] != counts[1]


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

    def nearly_touches(self, origin, direction, t, band):
        """Whether f is within `band` of the level at t, or within a double's rounding of t."""
        rounding = Fraction(2) ** -40 * (1 + abs(Fraction(t)))
        values = [
            self.value([o + at * d for o, d in zip(origin, direction, strict=True)])
            for at in (Fraction(t) - rounding, Fraction(t), Fraction(t) + rounding)
        ]
        return min(map(abs, values)) <= band or min(values) < 0 < max(values)

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
