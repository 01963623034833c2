"""Checks certificates of rays with rational numbers; needs the standard library alone. docs/method.md, "Certificates".
python checker.py CERTIFICATE.json COEFFICIENTS.f32; the coefficients are float32, little-endian, x fastest, no header.
"""

import hashlib
import json
import sys
from fractions import Fraction
from itertools import pairwise
from math import ceil, comb, floor, inf, isfinite, nextafter, prod
from pathlib import Path

ARITHMETIC = {"coefficients": "binary32", "numbers": "binary64", "unit_roundoff": 2.0**-53, "intervals": "tightest"}
FORMAT = {"format": "isospline ray certificate", "version": 1, "arithmetic": ARITHMETIC}
PARTS = {*FORMAT, "statement", "model", "ray", "cover", "digest"}


class CertificateError(ValueError):
    """A certificate does not prove what it states."""


def require(condition, what):
    if not condition:
        raise CertificateError(what)


def exact(number):
    require(type(number) is float and isfinite(number), f"{number!r} is not a finite double")
    return Fraction(number)


def digest(certificate):
    content = {name: value for name, value in certificate.items() if name != "digest"}
    return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def interval(numbers):
    """The narrowest interval of doubles that contains some rational numbers."""
    lower, upper = float(min(numbers)), float(max(numbers))  # rounded to nearest
    below, above = nextafter(lower, -inf), nextafter(upper, inf)
    return [below if lower > min(numbers) else lower, above if upper < max(numbers) else upper]


def side(number):
    return "above" if number > 0 else "below" if number < 0 else "on"


def is_crossing(sides):
    """Whether f changes sides exactly once, by Descartes' rule of signs, and is on neither end on the level."""
    changes = sum(a != b for a, b in pairwise(each for each in sides if each != "on"))
    return changes == 1 and "on" not in (sides[0], sides[-1])


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
        sizes = [n for n in self.shape if type(n) is int and n > self.degree % 2]
        require(sizes == self.shape and len(sizes) == 3 and prod(sizes) == len(coefficients), "the shape is another")
        self.cells = [n if self.degree == 2 else n - 1 for n in self.shape]
        self.coefficients, self.threshold = coefficients, exact(model["level"]) - exact(model["offset"])
        matrices = ([*model[name], [0.0, 0.0, 0.0, 1.0]] for name in ("transform", "affine"))
        placed, grid = ([[*map(exact, row)] for row in rows] for rows in matrices)
        columns = [*zip(*grid, strict=True)]
        world = [[sum(a * b for a, b in zip(row, each, strict=True)) for each in columns] for row in placed[:-1]]
        pairs = zip(world[1:] + world[:1], world[2:] + world[:2])
        crossed = [[a[j] * b[k] - a[k] * b[j] for j, k in ((1, 2), (2, 0), (0, 1))] for a, b in pairs]
        self.to_lattice = [[x / sum(a * b for a, b in zip(world[0], crossed[0])) for x in row] for row in zip(*crossed)]
        origin = [exact(x) - row[3] for x, row in zip(ray["origin"], world, strict=True)]
        shift = Fraction(1 - self.degree % 2, 2)
        self.start = [sum(a * b for a, b in zip(row, origin)) + shift for row in self.to_lattice]
        self.along = [sum(a * exact(b) for a, b in zip(row, ray["direction"], strict=True)) for row in self.to_lattice]

    def point(self, t):
        return [start + Fraction(t) * along for start, along in zip(self.start, self.along)]

    def numbers(self, first, last):
        """The coefficients of a box of cells minus the threshold, as rows along x, continued by the boundary rule."""
        places = []
        for size, begin, end in zip(self.shape, first, last):
            period = size if self.boundary == "periodic" else max(2 * size - 2, 1)
            within = [(i - self.degree // 2) % period for i in range(begin, end + self.degree + 1)]
            places.append([min(i, period - i) for i in within] if self.boundary == "mirror" else within)
        starts = [self.shape[0] * (y + self.shape[1] * z) for z in places[2] for y in places[1]]
        return [[Fraction(self.coefficients[at + x]) - self.threshold for x in places[0]] for at in starts]

    def box(self, begin, end):
        """The first and the last cell of the smallest box of cells around the ray from t = begin to end."""
        pairs = [sorted(pair) for pair in zip(self.point(begin), self.point(end))]
        first = [min(max(floor(lower), 0), n - 1) for (lower, _), n in zip(pairs, self.cells)]
        return [first, [min(max(ceil(upper) - 1, i), n - 1) for (_, upper), i, n in zip(pairs, first, self.cells)]]

    def segments(self, begin, end):
        """(cell, t, t) of the cells on the way from t = begin to end, the ends rational."""
        begin, end = Fraction(begin), Fraction(end)
        for start, along, n in zip(self.start, self.along, self.cells):
            beside = (begin, end if 0 <= start <= n else begin - 1)
            first, last = sorted((-start / along, (n - start) / along)) if along else beside
            begin, end = max(begin, first), min(end, last)
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
        require(piece["side"] in ("above", "below"), "a side is not known")
        if piece["reason"] == "outside":
            axis, outward = (0, 1, 2).index(piece["axis"]), 1 if piece["side"] == "above" else -1
            border = self.cells[axis] * max(outward, 0)
            is_beyond = (outward * self.point(t)[axis] > border for t in (begin, end) if t != inf)
            return all(is_beyond) and (end != inf or outward * self.along[axis] >= 0)
        if piece["reason"] == "box":
            found = {side(each) for row in self.numbers(*self.box(begin, end)) for each in row}
            return self.box(begin, end) == [piece["first_cell"], piece["last_cell"]] and found == {piece["side"]}
        require(piece["reason"] == "polynomials", "a reason is not known")
        segments = [*self.segments(begin, end)]
        found = set().union(*(map(side, self.polynomial(each)) for each in segments))
        return piece["cells"] == [cell for cell, *_ in segments] and found <= {piece["side"]}


def check(certificate, coefficients):
    """Raise an error unless a certificate proves its statement about coefficients, a memoryview of float32 numbers."""
    ray, statement, model = certificate["ray"], certificate["statement"], certificate["model"]
    require(digest({name: certificate[name] for name in FORMAT}) == digest(FORMAT), "the format is another")
    is_known = statement in ("miss", "hit", "undecided") and {*certificate} == PARTS | {statement} - {"miss"}
    require(is_known and certificate["digest"] == digest(certificate), "the content is not that of the digest")
    require(hashlib.sha256(memoryview(coefficients).cast("B")).hexdigest() == model["sha256"], "wrong coefficients")
    model = Model(model, ray, coefficients)
    at, t_far = ray["t_near"], inf if ray["t_far"] is None else ray["t_far"]
    require(exact(at) <= t_far and type(t_far) is float, "the limits of the ray are not in order")
    for piece in certificate["cover"]:
        end = inf if piece["to"] is None else piece["to"]
        require(piece["from"] == at and at <= end <= t_far and type(end) is float, f"the cover has a gap at t = {at}")
        require(model.is_free(at, end, piece), f"the way from t = {at} to {end} is not proven to be free")
        at = end
    if statement == "miss":
        return require(certificate["cover"] and at == t_far, f"the cover ends at t = {at}")
    last = certificate[statement]
    require(last["from"] == at and at <= exact(last["to"]) <= t_far, f"the cover ends at t = {at}")
    segments = [*model.segments(at, last["to"])]
    polynomials = [model.polynomial(each) for each in segments]
    sides, found = [side(x) for each in polynomials for x in each], {"from": at, "to": last["to"]}
    require(is_crossing(sides) == (statement == "hit"), "it is stated wrongly if f changes sides exactly once")
    if statement == "hit":
        found["cells"], found["gradient"] = [cell for cell, *_ in segments], model.gradient(segments)
        found["polynomials"] = [[interval([x]) for x in polynomial] for polynomial in polynomials]
    else:
        longest = max(nextafter(at, inf), at + 2.0**-20 / max(map(abs, model.along)))
        require(last["to"] <= longest and not {*sides} < {"above", "below"}, "the ray may be decided there")
        found["bound"] = interval([abs(x) for each in polynomials for x in each])[1]
    require(last == found, "the numbers at the crossing are others")


if __name__ == "__main__":
    files = [Path(name) for name in sys.argv[1:]]
    check(json.loads(files[0].read_text(encoding="utf-8")), memoryview(files[1].read_bytes()).cast("f"))
    print("proven")
