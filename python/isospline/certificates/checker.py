"""Checks certificates of rays with rational numbers; needs the standard library alone. docs/method.md, "Certificates".

    python checker.py CERTIFICATE.json COEFFICIENTS.f32

The second file has the stored coefficients: float32, little-endian, x fastest, without any header.
"""

import hashlib
import json
import sys
from fractions import Fraction
from itertools import pairwise, product
from math import ceil, comb, floor, inf, isfinite, nextafter

FORMAT = {"format": "isospline ray certificate", "version": 1}
ARITHMETIC = {"coefficients": "binary32", "numbers": "binary64", "unit_roundoff": 2.0**-53, "intervals": "tightest"}


class CertificateError(ValueError):
    """A certificate does not prove what it states."""


def require(condition, what):
    if not condition:
        raise CertificateError(what)


def digest(certificate):
    """The SHA-256 of all of a certificate but its digest."""
    content = {name: value for name, value in certificate.items() if name != "digest"}
    return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def interval(numbers):
    """The narrowest interval of doubles that contains some rational numbers."""
    lower, upper = float(min(numbers)), float(max(numbers))  # rounded to nearest
    below, above = nextafter(lower, -inf), nextafter(upper, inf)
    return [below if lower > min(numbers) else lower, above if upper < max(numbers) else upper]


def side(number):
    return "above" if number > 0 else "below" if number < 0 else "on"


def is_crossing(polynomials):
    """Whether f changes sides exactly once, by Descartes' rule of signs, and is on neither end on the level."""
    order = [side(each) for polynomial in polynomials for each in polynomial]
    changes = sum(a != b for a, b in pairwise(each for each in order if each != "on"))
    return changes == 1 and "on" not in (order[0], order[-1])


def weights(arguments):
    """The polar form of the B-splines on the cell [0, 1] whose degree is the number of arguments (de Boor)."""
    result = [Fraction(1)]
    for count, at in enumerate(arguments, 1):
        carried = Fraction(0)
        for i, weight in enumerate(result):
            share = weight / count
            result[i], carried = carried + share * (1 + i - at), share * (at + count - 1 - i)
        result.append(carried)
    return result


class Model:
    """f - level along a ray: exact numbers, in the lattice in which cell (i, j, k) is the cube at (i, j, k)."""

    def __init__(self, model, ray, coefficients):
        self.degree, self.boundary, self.shape = model["degree"], model["boundary"], model["shape"]
        require(self.degree in (1, 2, 3) and self.boundary in ("mirror", "periodic"), "the model is not known")
        require(len(coefficients) == self.shape[0] * self.shape[1] * self.shape[2], "the shape is another")
        self.cells = [n if self.degree == 2 else n - 1 for n in self.shape]
        self.coefficients, self.threshold = coefficients, Fraction(model["level"]) - Fraction(model["offset"])
        matrices = ([*model[name], [0, 0, 0, 1]] for name in ("transform", "affine"))
        placed, grid = ([[Fraction(x) for x in row] for row in rows] for rows in matrices)
        world = [[sum(row[k] * grid[k][j] for k in range(4)) for j in range(4)] for row in placed[:3]]
        rows = [row[:3] for row in world]
        pairs = zip(rows[1:] + rows[:1], rows[2:] + rows[:2])
        crossed = [[a[j - 2] * b[j - 1] - a[j - 1] * b[j - 2] for j in range(3)] for a, b in pairs]
        determinant = sum(a * b for a, b in zip(rows[0], crossed[0]))
        self.to_lattice = [[each / determinant for each in column] for column in zip(*crossed)]
        from_origin = [Fraction(x) - row[3] for x, row in zip(ray["origin"], world)]
        shift = Fraction(1 - self.degree % 2, 2)
        self.start = [sum(a * b for a, b in zip(row, from_origin)) + shift for row in self.to_lattice]
        self.along = [sum(a * Fraction(b) for a, b in zip(row, ray["direction"])) for row in self.to_lattice]

    def point(self, t):
        return [start + Fraction(t) * along for start, along in zip(self.start, self.along)]

    def numbers(self, first, last):
        """The coefficients of a box of cells minus the threshold, as rows along x, continued by the boundary rule."""
        places = []
        for size, begin, end in zip(self.shape, first, last):
            period = size if self.boundary == "periodic" else max(2 * size - 2, 1)
            within = [(i - self.degree // 2) % period for i in range(begin, end + self.degree + 1)]
            places.append([min(i, period - i) for i in within] if self.boundary == "mirror" else within)
        starts = [self.shape[0] * (y + self.shape[1] * z) for z, y in product(places[2], places[1])]
        return [[Fraction(self.coefficients[at + x]) - self.threshold for x in places[0]] for at in starts]

    def box(self, begin, end):
        """The first and the last cell of the smallest box of cells around the ray from t = begin to end."""
        pairs = [sorted(pair) for pair in zip(self.point(begin), self.point(end))]
        first = [min(max(floor(lower), 0), n - 1) for (lower, _), n in zip(pairs, self.cells)]
        return first, [min(max(ceil(upper) - 1, i), n - 1) for (_, upper), i, n in zip(pairs, first, self.cells)]

    def segments(self, begin, end):
        """(cell, t, t) of the cells on the way from t = begin to end, the ends rational."""
        begin, end = Fraction(begin), Fraction(end)
        for start, along, n in zip(self.start, self.along, self.cells):
            if along != 0:
                first, last = sorted((-start / along, (n - start) / along))
                begin, end = max(begin, first), min(end, last)
            elif not 0 <= start <= n:
                return
        cuts = {begin, end} if begin <= end else set()
        for start, along, n in zip(self.start, self.along, self.cells):
            if along != 0 and cuts:
                low, high = sorted((start + begin * along, start + end * along))
                cuts |= {(k - start) / along for k in range(max(ceil(low), 0), min(floor(high), n) + 1)}
        for first, last in pairwise(sorted(cuts) if len(cuts) > 1 else [*cuts, *cuts]):
            yield [min(floor(x), n - 1) for x, n in zip(self.point((first + last) / 2), self.cells)], first, last

    def polynomial(self, segment, axis=None):
        """The Bernstein coefficients of f - level on a segment, or of its derivative along an axis of the lattice."""
        cell, begin, end = segment
        ends = [(a - i, b - i) for a, b, i in zip(self.point(begin), self.point(end), cell)]
        degrees = [self.degree - (i == axis) for i in range(3)]
        by_axis = [[weights([a] * (n - p) + [b] * p) for p in range(n + 1)] for (a, b), n in zip(ends, degrees)]
        if axis is not None:  # the weights of differences of neighbours
            by_axis[axis] = [[a - b for a, b in pairwise([0, *row, 0])] for row in by_axis[axis]]
        numbers, count, result = self.numbers(cell, cell), self.degree + 1, [Fraction(0)] * (sum(degrees) + 1)
        for p, of_x in enumerate(by_axis[0]):
            lines = [sum(w * c for w, c in zip(of_x, row)) for row in numbers]
            for q, of_y in enumerate(by_axis[1]):
                planes = [sum(w * c for w, c in zip(of_y, lines[count * k : count * k + count])) for k in range(count)]
                for r, of_z in enumerate(by_axis[2]):
                    ways = comb(degrees[0], p) * comb(degrees[1], q) * comb(degrees[2], r)
                    result[p + q + r] += ways * sum(w * c for w, c in zip(of_z, planes))
        return [each / comb(sum(degrees), i) for i, each in enumerate(result)]

    def gradient(self, segments):
        """Intervals of the gradient's coordinates on some segments, in the space of the ray."""
        along_axes = [[self.polynomial(each, axis) for axis in range(3)] for each in segments]
        rows = [row for each in along_axes for row in zip(*each)]
        return [interval([sum(a[i] * x for a, x in zip(self.to_lattice, row)) for row in rows]) for i in range(3)]

    def is_free(self, begin, end, piece):
        """Whether the reason that a piece of the cover gives is one why f is not the level from t = begin to end."""
        if piece["reason"] == "outside":
            axis, outward = piece["axis"], 1 if piece["side"] == "above" else -1
            border = self.cells[axis] * (outward > 0)
            is_beyond = (outward * (self.point(t)[axis] - border) > 0 for t in (begin, end) if t != inf)
            return all(is_beyond) and (end != inf or outward * self.along[axis] >= 0)
        if piece["reason"] == "box":
            box = self.box(begin, end)
            found = {side(each) for row in self.numbers(*box) for each in row}
            return [*box] == [piece["first_cell"], piece["last_cell"]] and found == {piece["side"]}
        require(piece["reason"] == "polynomials", "a reason is not known")
        segments = [*self.segments(begin, end)]
        found = set().union(*(map(side, self.polynomial(each)) for each in segments))
        return piece["cells"] == [cell for cell, *_ in segments] and found == {piece["side"]}


def check(certificate, coefficients):
    """Raise an error unless a certificate proves its statement about coefficients, a memoryview of float32 numbers."""
    require({name: certificate.get(name) for name in FORMAT} == FORMAT, "the format is another")
    require(certificate["arithmetic"] == ARITHMETIC, "the arithmetic is another")
    require(certificate["digest"] == digest(certificate), "the content is not that of the digest")
    ray, statement, model = certificate["ray"], certificate["statement"], certificate["model"]
    stored = hashlib.sha256(memoryview(coefficients).cast("B")).hexdigest()
    require(stored == model["sha256"], "the coefficients are others")
    model = Model(model, ray, coefficients)
    at, t_far = ray["t_near"], inf if ray["t_far"] is None else ray["t_far"]
    require(isfinite(at) and at <= t_far, "the limits of the ray are not in order")
    for piece in certificate["cover"]:
        end = inf if piece["to"] is None else piece["to"]
        require(piece["from"] == at and at <= end <= t_far, f"the cover has a gap at t = {at}")
        require(model.is_free(at, end, piece), f"the way from t = {at} to {end} is not proven to be free")
        at = end
    if statement == "miss":
        return require(at == t_far, f"the cover ends at t = {at}")
    require(statement in ("hit", "undecided"), "the statement is not known")
    last = certificate[statement]
    require(last["from"] == at and at <= last["to"] <= t_far, f"the cover ends at t = {at}")
    segments = [*model.segments(at, last["to"])]
    polynomials = [model.polynomial(each) for each in segments]
    if statement == "undecided":
        bound = interval([abs(each) for polynomial in polynomials for each in polynomial])[1]
        return require(last["bound"] == bound, "the bound on |f - level| is another")
    require(last["cells"] == [cell for cell, *_ in segments], "the cells at the crossing are others")
    intervals = [[interval([x]) for x in polynomial] for polynomial in polynomials]
    require(last["polynomials"] == intervals, "the polynomials at the crossing are others")
    require(is_crossing(polynomials), "f does not change sides exactly once")
    require(last["gradient"] == model.gradient(segments), "the gradient at the crossing is another")


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8") as certificate_file, open(sys.argv[2], "rb") as coefficient_file:
        check(json.load(certificate_file), memoryview(coefficient_file.read()).cast("f"))
    print("proven")
