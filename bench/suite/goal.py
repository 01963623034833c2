"""A goal, what was measured, and by how much the goal was missed."""

import statistics
from dataclasses import dataclass

from .tables import power


@dataclass
class Goal:
    what: str
    goal: str
    measured: str
    verdict: str  # "met", or "missed" and by how much, or "not measured"


def at_least(what, goal, values, unit="times", of_median=False):
    """A goal for the smallest of the values, a dict of label to quantity, or for their median."""
    return _bound(what, f"at least {goal:g} {unit}", goal, values, min, lambda value: value >= goal, unit, of_median)


def at_most(what, goal, values, unit):
    """A goal for the largest of the values, a dict of label to quantity."""
    return _bound(what, f"at most {goal:g} {unit}", goal, values, max, lambda value: value <= goal, unit, False)


def none_of(what, values, out_of):
    """A goal of zero for a dict of label to count, out of so many in all."""
    if not out_of:
        return Goal(what, "0", "-", "not measured")
    total = sum(values.values())
    worst = max(values, key=values.get)
    where = f", most in {worst}" if total else ""
    return Goal(what, "0", f"{total} of {power(out_of)}{where}", "met" if total == 0 else f"missed by {total}")


def skipped(what, goal, reason):
    return Goal(what, goal, "-", f"not measured: {reason}")


def _bound(what, text, goal, values, worst_of, is_met, unit, of_median):
    if not values:
        return Goal(what, text, "-", "not measured")
    label = worst_of(values, key=values.get)
    worst, median = values[label], statistics.median(values.values())
    measured = f"{worst:.3g} {unit} ({label})"
    if of_median:
        measured = f"{median:.3g} {unit}; worst {measured}"
    elif len(values) > 1:
        measured += f"; median {median:.3g}"
    judged = median if of_median else worst
    verdict = "met" if is_met(judged) else f"missed by a factor of {max(judged / goal, goal / judged):.2f}"
    return Goal(what, text, measured, verdict)
