"""Comparison of two label maps: overlap of voxels, and distances of surfaces."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.results import LabelComparison
from ..base.units import ratio_of_units
from ..distances import surface_distance
from ..io.checks import size_text
from .segments import Segment

if TYPE_CHECKING:
    from .labels import Labels


def compare(
    first: Labels,
    second: Labels,
    wanted: list[Segment] | None,
    by: str,
    smoothing: float,
    progress: Callable[[float], object] | None,
) -> LabelComparison:
    """The rows of all wanted segments of the first map, or of all segments of both."""
    _check_same_voxels(first, second)
    segments = first._segments if wanted is None else wanted
    keys = [getattr(each, by) for each in segments]
    if wanted is None:
        keys = sorted({*keys, *(getattr(each, by) for each in second._segments)})
    own, others = (_by_key(each, by, keys) for each in (segments, second._segments))
    rows = []
    for place, key in enumerate(keys):
        rows.append(_row(first, second, own.get(key), others.get(key), smoothing))
        if progress is not None:
            progress((place + 1) / len(keys))
    return LabelComparison._of_rows(rows)


def _by_key(segments, by, keys):
    """The segments with some names or numbers, each of which one segment has."""
    found: dict[str | int, Segment] = {}
    for each in segments:
        key = getattr(each, by)
        number = found.setdefault(key, each).number
        if number != each.number and key in keys:
            raise ValueError(
                f"by: expected names that one label of a map has, got {key!r} of {number} and {each.number}: "
                'use by="number"'
            )
    return found


def _check_same_voxels(first, second):
    if first.shape != second.shape:
        raise ValueError(f"other: expected {size_text(first.shape)} voxels, got {size_text(second.shape)}")
    unit, other = first._source.unit, second._source.unit
    if ratio_of_units(other, unit) != 1:
        raise ValueError(f"other: expected a map in {unit}, got one in {other}")
    corners = np.array([(0, 0, 0), first.shape[::-1]])
    apart = np.abs(first._source.position(corners) - second._source.position(corners)).max()
    axes = np.abs(np.asarray(first._source.direction) - second._source.direction).max()
    if apart > 0.01 * min(first._source.spacing) or axes > 1e-3:
        raise ValueError(f"other: expected a map in the same place, got one that is {apart:.3g} apart")


def _row(first, second, own: Segment | None, other: Segment | None, smoothing: float) -> dict[str, Any]:
    known = own or other
    assert known is not None
    row = {"numbers": known.number, "names": known.name, "dice": 0.0}
    row |= dict.fromkeys(("hausdorff_lower", "hausdorff_upper", "mean_distances", "mean_errors"), np.nan)
    if own is None or other is None:
        return row
    masks = first.mask(own.number), second.mask(other.number)
    row["dice"] = 2 * np.count_nonzero(masks[0] & masks[1]) / sum(map(np.count_nonzero, masks))
    here = first.surface(own.number, smoothing=smoothing)
    there = second.surface(other.number, smoothing=smoothing)
    ways = surface_distance(here, there), surface_distance(there, here)
    areas = here.area(), there.area()
    mean = (ways[0].mean * areas[0] + ways[1].mean * areas[1]) / (areas[0] + areas[1])
    row["hausdorff_lower"], row["hausdorff_upper"] = (max(each.maximum[end] for each in ways) for end in (0, 1))
    row["mean_distances"], row["mean_errors"] = mean.value, max(each.mean.error for each in ways)
    return row
