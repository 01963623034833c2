"""Certificates of rays: searches for the proof that `checker` checks."""

from __future__ import annotations

import hashlib
from fractions import Fraction
from math import inf, nextafter

import numpy as np

from . import checker

#: No box of cells of a cover has more coefficients; a checker reads them one by one.
MOST_COEFFICIENTS = 20_000
#: A piece of the ray is divided until its length is below this share of t, or of the way.
LEAST_SHARE = 2.0**-48


class Prover:
    """Finds the certificate of one ray at one isosurface."""

    def __init__(self, surface, transform, ray, limits, bounds):
        volume = surface.volume
        self.stored = volume._stored_coefficients
        numbers = memoryview(self.stored.reshape(-1))
        self.t_near, self.t_far = limits
        self.ray = {"origin": ray[:3], "direction": ray[3:], "t_near": self.t_near, "t_far": _finite(self.t_far)}
        self.description = {
            **describe_volume(volume),
            "sha256": hashlib.sha256(numbers).hexdigest(),
            "transform": transform[:3].tolist(),
            "level": surface.level,
        }
        self.model = checker.Model(self.description, self.ray, numbers)
        self.bounds = bounds  # of the crossing: only to find it sooner
        self.cover = []

    def certificate(self):
        """The certificate, as data for JSON."""
        found = self._search()
        statement = found.pop("statement")
        result = {
            **checker.FORMAT,
            "statement": statement,
            "model": self.description,
            "ray": self.ray,
            "cover": self.cover,
        }
        if found:
            result[statement] = found
        return {**result, "digest": checker.digest(result)}

    def _search(self):
        """Cover the ray until a crossing, a doubt or its end; returns the statement, and what proves it."""
        at = self._before_the_lattice()
        if self.cover and at == self.t_far:
            return {"statement": "miss"}
        _, exit_ = self._limits()
        stop = min(self.t_far, _above(exit_[0]))
        step = longest = 1.0 / float(max(map(abs, self.model.along)))  # through one cell
        while at < stop or not self.cover:
            end = min(max(at + step, nextafter(at, inf)), stop)
            if self._add_box(at, end):
                at, step = end, 2.0 * step
            elif step > longest:
                step *= 0.5
            else:
                at, end = self._divide(at, end)
                if end is not None:
                    return self._crossing(at, end)
        if stop < self.t_far:
            self._add_outside(stop, self.t_far, exit_[1], exit_[2])
        return {"statement": "miss"}

    def _limits(self):
        """(t, axis, side) where the ray enters the lattice, and where it leaves it; t is rational or infinite."""
        entry, exit_ = (-inf, 0, "below"), (inf, 0, "above")
        for axis, (start, along, n) in enumerate(zip(self.model.start, self.model.along, self.model.cells)):
            if along == 0:
                if not 0 <= start <= n:
                    return (inf, axis, "below" if start < 0 else "above"), (
                        -inf,
                        axis,
                        "below" if start < 0 else "above",
                    )
                continue
            sides = ("below", "above") if along > 0 else ("above", "below")
            first, last = sorted((-start / along, (n - start) / along))
            entry, exit_ = max(entry, (first, axis, sides[0])), min(exit_, (last, axis, sides[1]))
        return entry, exit_

    def _before_the_lattice(self):
        """Cover the way to the lattice; returns its end, t_far if the ray misses the lattice."""
        entry, exit_ = self._limits()
        if self.t_near > exit_[0]:
            return self._add_outside(self.t_near, self.t_far, *exit_[1:])
        if self.t_far < entry[0]:
            return self._add_outside(self.t_near, self.t_far, *entry[1:])
        if entry[0] > exit_[0]:
            between = float((entry[0] + exit_[0]) / 2)
            if exit_[0] < between < entry[0]:
                self._add_outside(self.t_near, between, *entry[1:])
                return self._add_outside(between, self.t_far, *exit_[1:])
        if self.t_near < entry[0] and (end := _below(entry[0])) > self.t_near:
            return self._add_outside(self.t_near, min(end, self.t_far), *entry[1:])
        return self.t_near

    def _add_outside(self, begin, end, axis, side):
        self.cover.append({"from": begin, "to": _finite(end), "reason": "outside", "axis": axis, "side": side})
        return end

    def _add_box(self, begin, end):
        """Cover a part by the smallest box of cells around it, if its coefficients are on one side."""
        first, last = self.model.box(begin, end)
        sizes = [b - a + 1 + self.model.degree for a, b in zip(first, last)]
        if sizes[0] * sizes[1] * sizes[2] > MOST_COEFFICIENTS:
            return False
        side = self._side_of_box(first, sizes)
        if side is not None:
            piece = {"reason": "box", "first_cell": first, "last_cell": last, "side": side}
            self.cover.append({"from": begin, "to": end, **piece})
        return side is not None

    def _side_of_box(self, first, sizes):
        places = []
        for begin, count, size in zip(first, sizes, self.model.shape):
            at = np.arange(begin, begin + count) - self.model.degree // 2
            period = size if self.model.boundary == "periodic" else max(2 * size - 2, 1)
            within = at % period
            places.append(within if self.model.boundary == "periodic" else np.minimum(within, period - within))
        box = self.stored[np.ix_(*reversed(places))]
        if Fraction(float(box.min())) > self.model.threshold:
            return "above"
        return "below" if Fraction(float(box.max())) < self.model.threshold else None

    def _add_polynomials(self, begin, end):
        """Cover a part by the polynomials along it, if their Bernstein coefficients are on one side."""
        segments = [*self.model.segments(begin, end)]
        sides = set()
        for segment in segments:
            sides |= set(map(checker.side, self.model.polynomial(segment)))
            if len(sides) > 1:
                break
        if len(sides) > 1 or "on" in sides:
            return False
        cells = [cell for cell, *_ in segments]  # none if the ray passes the lattice within rounding
        piece = {"reason": "polynomials", "cells": cells, "side": sides.pop() if sides else "above"}
        self.cover.append({"from": begin, "to": end, **piece})
        return True

    def _divide(self, begin, end):
        """Cover as much of a part as can be; returns where the cover ends, and a t behind that, None for the end."""
        at, ends, way = begin, [end], end - begin
        while ends:
            if self._add_polynomials(at, ends[-1]):
                at = ends.pop()
                continue
            hints = [t for t in self.bounds if at < t < ends[-1]]
            middle = hints[0] if hints else at + 0.5 * (ends[-1] - at)
            least = LEAST_SHARE * max(abs(at), abs(ends[-1]), 2.0**-10 * way)
            is_found = [at, ends[-1]] == self.bounds
            if is_found or not at < middle < ends[-1] or ends[-1] - at < least:
                return at, ends[-1]
            ends.append(middle)
        return at, None

    def _crossing(self, begin, end):
        """What is known of the part from begin on, at which the cover ends."""
        for widened in (end, *(begin + 2.0**k * (end - begin) for k in range(1, 12))):
            to = min(widened, self.t_far)
            segments = [*self.model.segments(begin, to)]
            polynomials = [self.model.polynomial(each) for each in segments]
            sides = [checker.side(each) for polynomial in polynomials for each in polynomial]
            if sides and checker.is_crossing(sides):
                return {
                    "statement": "hit",
                    "from": begin,
                    "to": to,
                    "cells": [cell for cell, *_ in segments],
                    "polynomials": [[checker.interval([x]) for x in each] for each in polynomials],
                    "gradient": self.model.gradient(segments),
                }
        polynomials = [self.model.polynomial(each) for each in self.model.segments(begin, end)]
        bound = checker.interval([abs(each) for polynomial in polynomials for each in polynomial])[1]
        return {"statement": "undecided", "from": begin, "to": end, "bound": bound}


def describe_volume(volume):
    """What a certificate tells of a volume, besides its coefficients."""
    shape = volume.shape if volume.axes == "xyz" else volume.shape[::-1]
    return {
        "shape": list(shape),
        "degree": volume.degree,
        "boundary": volume.boundary,
        "filter": volume.filter,
        "smoothing": volume.smoothing,
        "offset": volume._offset,
        "affine": volume.affine[:3].tolist(),
    }


def _finite(t):
    """JSON has no infinite numbers."""
    return None if t == inf else t


def _below(number):
    """The largest double below a rational number."""
    nearest = float(number)
    return nearest if nearest < number else nextafter(nearest, -inf)


def _above(number):
    nearest = float(number)
    return nearest if nearest > number else nextafter(nearest, inf)
