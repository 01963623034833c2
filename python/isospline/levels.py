"""Suggested levels and levels by default, the histograms they are computed from, and specks of noise."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .base.parameters import check_count, describe_not_finite
from .base.signatures import explained
from .scene import Isosurface
from .scene.cells import index_shape

__all__ = ["histogram", "suggest_levels"]

# Bins for samples that are not integers of a small range.
BINS = 4096
# Integers of at most this range are counted one by one.
COUNTED_RANGE = 1 << 17
# Points at which a Volume without samples is evaluated.
LOOKED_UP = 500_000
#: If only a file is given, pieces of a solid count as noise if they have fewer inside cells than this fraction of the
#: largest piece's.
SPECK = 0.01

# Hounsfield units: air, with the rounding and the noise of scanners, and water.
_AIR, _WATER = (-1100, -900), 0


@explained
def suggest_levels(data: ArrayLike, count: int = 3) -> list[float]:
    r"""Suggest levels that separate the materials of a volume, the best first.

    A level divides the samples into two classes, below and above. The first level minimises the variance within these
    classes. That is two-class K-means, by which the paper chooses its level [1]_, and Otsu's threshold [2]_; in one
    dimension the optimum is found by trying all splits. Each further level splits one of the present classes in the
    same way [3]_: the one for which the reduction of the sum of squares,

    .. math:: \frac{n_0 n_1}{n_0 + n_1} (\mu_1 - \mu_0)^2,

    is largest. So asking for more levels never changes the first ones. A narrow peak of air, however high, has almost
    no variance and is not split.

    Parameters
    ----------
    data : array_like
        Samples of any shape, integers, real numbers or booleans, all finite.
    count : int
        Largest number of levels to suggest.

    Returns
    -------
    list of float
        Each is halfway between two values that occur in the data (for real numbers, in a histogram of 4096 bins). There
        are fewer than `count` if the data has at most `count` different values, and none if it is constant. Integers
        beyond 2^53 are different if they are in float64, the type of levels.

    Raises
    ------
    ValueError
        For data that is empty or not finite, or a count below 1.

    References
    ----------
    .. [1] P. Thévenaz, M. Unser, "High-quality isosurface rendering with exact gradient", ICIP 2001, §7.
    .. [2] N. Otsu, "A threshold selection method from gray-level histograms", IEEE Transactions on Systems, Man, and
       Cybernetics 9(1), 1979.
    .. [3] M. Cheriet, J. N. Said, C. Y. Suen, "A recursive thresholding technique for image segmentation", IEEE
       Transactions on Image Processing 7(6), 1998.

    Examples
    --------
    >>> import isospline
    >>> isospline.suggest_levels([0, 0, 0, 1, 90, 100, 200], count=2)
    [45.5, 150.0]
    """
    check_count(count)
    values, counts = histogram(data)
    return levels_of_histogram(values, counts, count)


def levels_of_histogram(values: NDArray[np.float64], counts: NDArray[np.int64], count: int = 3) -> list[float]:
    """Like `suggest_levels`, for the values that occur, in ascending order, and their counts."""
    weights = np.asarray(counts, dtype=float)
    levels: list[float] = []
    places = _from_zero_to_one(values)
    splits = [_best_split(places, weights, 0, len(values))]
    while len(levels) < count:
        best = max(splits)
        gain, begin, middle, end = best
        if gain <= 0:
            break
        levels.append(_halfway(float(values[middle - 1]), float(values[middle])))
        splits.remove(best)
        splits += [_best_split(places, weights, begin, middle), _best_split(places, weights, middle, end)]
    return levels


def _from_zero_to_one(values):
    """Ascending values, of which the first becomes 0, over a power of two: their squares are neither 0 nor infinite."""
    _, exponent = np.frexp(np.abs(values).max())
    apart = np.ldexp(values, -exponent - 1)  # so that differences do not overflow
    apart -= apart[0]
    _, exponent = np.frexp(apart[-1])
    return np.ldexp(apart, -exponent)


def _halfway(a, b):
    """A number above a, up to b: the middle, if there is a number in float64 between them."""
    middle = a + (b - a) / 2 if math.isfinite(b - a) else a / 2 + b / 2
    return middle if middle > a else b


def histogram(data):
    """The values that occur in an array, ascending, and their counts.

    Integers of a range up to 2^17 are counted exactly; other numbers in 4096 bins, for which the means are returned.

    Returns
    -------
    values : (N,) float64 array
    counts : (N,) int64 array
    """
    data = _core._as_array(data, "data")
    if data.size == 0:
        raise ValueError(f"data: expected samples, got none, shape {data.shape}")
    if data.dtype == bool:
        data = data.view(np.uint8)
    lowest, highest = data.min(), data.max()
    if not np.isfinite([lowest, highest]).all():
        raise ValueError(f"data: expected finite samples, got {describe_not_finite(data)}")

    if lowest == highest:
        return np.array([float(lowest)]), np.array([data.size])
    # Slice by slice, so that no temporary array is as large as the volume.
    slices = np.atleast_2d(data)
    if data.dtype.kind in "iu" and int(highest) - int(lowest) < COUNTED_RANGE:
        counts = np.zeros(int(highest) - int(lowest) + 1, np.int64)
        wide = data.dtype if data.dtype.kind == "u" else np.dtype(np.int64)  # holds the samples and their differences
        for part in slices:
            places = np.ravel(part).astype(wide) - wide.type(lowest)
            counts += np.bincount(places.astype(np.int64), minlength=len(counts))
        values = np.arange(len(counts)) + float(lowest)
    else:
        counts, sums = np.zeros(BINS, np.int64), np.zeros(BINS)
        for part in slices:
            place = BINS * share(np.ravel(part), lowest, highest)
            bins = np.minimum(place.astype(np.int64), BINS - 1)
            counts += np.bincount(bins, minlength=BINS)
            sums += np.bincount(bins, place, minlength=BINS)
        part = sums / np.maximum(counts, 1) / BINS
        low, high = float(lowest), float(highest)
        values = low + part * (high - low) if np.isfinite(high - low) else (1 - part) * low + part * high
    values, counts = values[counts > 0], counts[counts > 0]
    begins = np.flatnonzero(np.append(True, values[1:] != values[:-1]))  # several may be one number in float64
    return values[begins], np.add.reduceat(counts, begins)


def share(values: ArrayLike, lowest: Any, highest: Any) -> NDArray[np.float64]:
    """Where values are between two others, 0 to 1; 0 if both are the same number in float64."""
    low, high, values = float(lowest), float(highest), np.asarray(values, float)
    if not np.isfinite(high - low):  # halves do not overflow
        low, high, values = low / 2, high / 2, values / 2
    return (values - low) / (high - low) if low < high else np.zeros(values.shape)


def bars(values: NDArray[np.float64], counts: NDArray[np.int64], number: int) -> NDArray[np.int64]:
    """The counts of values in ascending order, in bars of the same width from the first to the last one."""
    places = np.minimum((number * share(values, values[0], values[-1])).astype(np.int64), number - 1)
    return np.bincount(places, counts, number).astype(np.int64)


def default_levels(suggested: list[float], minimum: float, patient: bool) -> tuple[float, float | None]:
    """The level of a picture for which none was given, and the level of the patient's body, or None.

    The first level is the first of the suggested ones. For a CT of a patient, in which air has -1000 Hounsfield units,
    it is the first one above water, which shows bones. The lowest suggested level then separates the body from air, if
    it is below water.
    """
    above_water = [level for level in suggested if level > _WATER]
    if not (patient and is_ct(minimum) and above_water):
        return suggested[0], None
    return above_water[0], min(suggested) if min(suggested) < _WATER else None


def is_ct(minimum: float) -> bool:
    """Whether the least sample of a patient's volume is air in Hounsfield units."""
    return _AIR[0] <= minimum <= _AIR[1]


def count_pieces(surface: Isosurface) -> tuple[int, int]:
    """The number of components of the solid that are not specks of noise, and the number of all components.

    Only cells that are completely inside count: a layer of noise has many cells but hardly any inside.
    """
    inside = surface.components().inside_counts
    return int((inside >= SPECK * inside.max(initial=0)).sum()), len(inside)


def some_values(volume):
    """The model's values at some evenly spaced samples."""
    steps = max(1, int(np.ceil((np.prod(volume.shape[:3], dtype=float) / LOOKED_UP) ** (1 / 3))))
    axes = [np.arange(0, count, steps, dtype=float) for count in index_shape(volume)]
    index = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return volume.sample(index @ volume.affine[:3, :3].T + volume.affine[:3, 3])


def _best_split(values, weights, begin, end):
    """The split [begin, middle), [middle, end) of a class that reduces its sum of squares most.

    Returns that gain, begin, middle and end; a gain of 0 for a class of one value.
    """
    if end - begin < 2:
        return 0.0, begin, begin, end
    weights, values = weights[begin:end], values[begin:end]
    below = np.cumsum(weights)
    total = below[-1]
    # Relative to the mean, the first moments of both sides only differ in sign.
    moment = np.cumsum(weights * (values - np.average(values, weights=weights)))[:-1]
    gains = moment**2 * total / (below[:-1] * (total - below[:-1]))
    best = int(np.argmax(gains))
    return float(gains[best]), begin, begin + best + 1, end
