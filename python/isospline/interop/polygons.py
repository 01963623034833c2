"""Polygons and strips, cut into triangles.

Libraries make fans of polygons that are not convex, whose triangles overlap; VTK drops polygons that are tiny, have a
bridge to a hole, or are otherwise no simple ones.
"""

from __future__ import annotations

import numpy as np


@np.errstate(invalid="ignore", over="ignore")  # of points that are not finite, which meshes refuse
def cut_polygons(points, sizes, corners):
    """The triangles of polygons, in their order: a polygon of n corners has n - 2, with its own corners alone.

    Triangles stay as they are. From larger polygons, corners that repeat the corner before them are dropped first, as
    those of quadrilaterals that are triangles. Polygons are seen along the normal that Newell's method gives. Convex
    ones become fans from their first corners, others fans from another corner, or they lose one ear after the other
    [1]_. Polygons of fewer than three corners have no triangles.

    Parameters
    ----------
    points : (V, 3) float array
    sizes : (P,) integer array
        The number of corners of each polygon.
    corners : (C,) integer array
        The points of all polygons, one polygon after the other.

    Returns
    -------
    (F, 3) int64 array

    References
    ----------
    .. [1] G. H. Meisters, "Polygons have ears", The American Mathematical Monthly 82(6), 1975.
    """
    sizes, corners = _without_repeats(np.asarray(sizes, np.int64), np.asarray(corners, np.int64))
    begins = np.cumsum(sizes) - sizes
    counts = np.maximum(sizes - 2, 0)
    places = np.cumsum(counts) - counts
    triangles = np.empty((counts.sum(), 3), np.int64)
    for size in np.unique(sizes[sizes > 2]):
        found = np.flatnonzero(sizes == size)
        for block in np.array_split(found, 1 + len(found) * size // _BLOCK):
            polygons = corners[begins[block, None] + np.arange(size)]
            cuts = _cuts_of(_flattened(points[polygons])) if size > 3 else np.array([[(0, 1, 2)]])
            triangles[places[block, None] + np.arange(size - 2)] = np.take_along_axis(polygons[:, None], cuts, axis=2)
    return triangles


def cut_strips(sizes, corners):
    """The (F, 3) triangles of strips: each corner after the second makes one with the two before it."""
    counts = np.maximum(np.asarray(sizes, np.int64) - 2, 0)
    rows = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    first = np.repeat(np.cumsum(sizes) - sizes, counts) + rows
    return np.asarray(corners, np.int64)[np.stack([first, first + 1 + rows % 2, first + 2 - rows % 2], axis=1)]


def _without_repeats(sizes, corners):
    """The sizes and corners of polygons without corners that repeat the one before them."""
    ends = np.cumsum(sizes)
    is_some = sizes > 0
    before = np.roll(corners, 1)
    before[(ends - sizes)[is_some]] = corners[ends[is_some] - 1]
    is_kept = (corners != before) | np.repeat(sizes <= 3, sizes)
    if is_kept.all():
        return sizes, corners
    return np.bincount(np.repeat(np.arange(len(sizes)), sizes)[is_kept], minlength=len(sizes)), corners[is_kept]


def _flattened(polygons):
    """(P, N, 3) corners in a plane, as complex numbers: without the axis closest to the normal, counter-clockwise."""
    polygons = polygons - polygons[:, :1]
    exponents = np.frexp(np.abs(polygons).max(axis=(1, 2), keepdims=True))[1]
    polygons = np.ldexp(polygons, -exponents)  # exact, and products of small numbers are not 0
    normals = np.cross(polygons, np.roll(polygons, -1, axis=1)).sum(axis=1)
    axes = np.abs(normals).argmax(axis=1)[:, None]
    is_turned = np.take_along_axis(normals, axes, axis=1) < 0
    kept = (axes + np.where(is_turned, [2, 1], [1, 2])) % 3
    x, y = np.moveaxis(np.take_along_axis(polygons, kept[:, None], axis=2), 2, 0)
    return x + 1j * y


def _cuts_of(polygons):
    """The (P, N - 2, 3) corners of the triangles of (P, N) polygons."""
    count = polygons.shape[1]
    fan = np.stack([np.zeros(count - 2, np.int64), np.arange(1, count - 1), np.arange(2, count)], axis=1)
    cuts, left = np.empty((len(polygons), *fan.shape), np.int64), np.arange(len(polygons))
    for begin in range(min(count, _BEGINS)):
        cuts[left] = (fan + begin) % count
        left = left[~(_areas(*np.moveaxis(polygons[left][:, (fan + begin) % count], 2, 0)) > 0).all(axis=1)]
    for at in left:
        cuts[at] = _ears(polygons[at])
    return cuts


def _areas(first, second, third):
    """Twice the area of triangles, positive if they are counter-clockwise."""
    return ((second - first).conj() * (third - first)).imag


def _ears(polygon):
    """The (N - 2, 3) corners of the triangles of a polygon."""
    count = len(polygon)
    before, after = np.roll(np.arange(count), 1), np.roll(np.arange(count), -1)
    areas = _areas(polygon[before], polygon, polygon[after])
    is_left = np.ones(count, bool)
    ears: list[tuple[int, int, int]] = []
    at, tried = 0, 0
    while len(ears) < count - 2:
        if tried == count - len(ears):  # not a simple polygon: the corner whose loss changes the outline least
            at = np.flatnonzero(is_left)[np.abs(areas[is_left]).argmin()]
        elif not (areas[at] > 0 and _is_empty(polygon[[before[at], at, after[at]]], polygon[is_left & ~(areas > 0)])):
            at, tried = after[at], tried + 1
            continue
        ears.append((before[at], at, after[at]))
        is_left[at], tried = False, 0
        after[before[at]], before[after[at]] = after[at], before[at]
        for each in (before[at], after[at]):
            areas[each] = _areas(polygon[before[each]], polygon[each], polygon[after[each]])
        at = after[at]
    return ears


def _is_empty(ear, points):
    """Whether no point is in an ear, except at its corners."""
    first, second, third = ear
    is_inside = (_areas(first, second, points) >= 0) & (_areas(second, third, points) >= 0)
    is_inside &= (_areas(third, first, points) >= 0) & (points != first) & (points != second) & (points != third)
    return not is_inside.any()


# How many corners of a polygon are tried as the first ones of a fan, and how many are in memory at once.
_BEGINS, _BLOCK = 8, 1 << 16
