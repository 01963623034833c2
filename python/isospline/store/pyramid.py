r"""The least-squares spline pyramid, of factor 2 along each axis.

M. Unser, A. Aldroubi, M. Eden, "The L2 polynomial spline pyramid", IEEE Transactions on Pattern Analysis and Machine
Intelligence 15(4), 1993. Among the models of the same degree on a grid twice as coarse, the coarse model g minimises

.. math:: \int (f - g)^2

over the box of the coarse level, or over a whole period of a periodic model. Beyond the fine model's box, f continues
by its boundary rule. Along one axis, let :math:`\beta_i` be the B-splines of the fine grid and :math:`\gamma_k` those
of the coarse grid, each continued by the boundary rule. Then

.. math:: G d = B c, \quad G_{kl} = \int \gamma_k \gamma_l, \quad B_{ki} = \int \gamma_k \beta_i.

In three dimensions, the minimiser is computed along x, y and z in turn. The paper's filters are the rows of
:math:`G^{-1} B` far from the ends; near the ends, these rows include the boundary rule.

Coarse B-splines are sums of fine ones. Coarse sample 0 is therefore at fine sample 0 for odd degrees. For even degrees,
where two fine voxels make a coarse voxel, it is in the middle of fine samples 0 and 1.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .blocks import cut, inside_indices, read_box_folded, read_indices
from .layout import box_of, is_whole_shard, open_array, read_box
from .model import write_shard

#: Levels are made until the longest axis has at most this number of samples.
SMALLEST = 64

#: For degrees 0 to 5: the modulus whose powers bound the decay of the inverse of G. It is the largest pole of the
#: direct filter of the B-spline of degree 2 n + 1.
POLES = (0.0, 0.26795, 0.43058, 0.53529, 0.60800, 0.66127)

#: The values of the B-splines of degrees 0 to 5 at 0, 1 and 2.
_AT_SAMPLES = (
    (1.0,),
    (1.0,),
    (6 / 8, 1 / 8),
    (4 / 6, 1 / 6),
    (230 / 384, 76 / 384, 1 / 384),
    (66 / 120, 26 / 120, 1 / 120),
)

#: The fraction of a row of the inverse of G that may be cut off: below the precision of float32.
_FORGOTTEN = 2.0**-32

#: Number of slices of the finer level that are read at a time.
_SLAB = 32


def level_shapes(shape: Any, degree: int, boundary: str) -> list[tuple[int, ...]]:
    """Samples along each axis of all levels, the finest first."""
    shapes = [tuple(shape)]
    while max(shapes[-1]) > SMALLEST:
        shapes.append(tuple(coarse_size(size, degree, boundary) for size in shapes[-1]))
    return shapes


def coarse_size(size: int, degree: int, boundary: str) -> int:
    """Samples of the next level along an axis. Its box, or its period, covers that of this level."""
    if size == 1:
        return 1
    return size // 2 + 1 if degree % 2 and boundary == "mirror" else (size + 1) // 2


def origin_shift(degree: int) -> float:
    """The position of coarse sample 0, in fine samples."""
    return 0.0 if degree % 2 else 0.5


@dataclass(frozen=True)
class ReduceShard:
    """Compute one shard of a coarser level from the coefficients of the finer level, and write it."""

    root: Path
    fine_key: str
    coarse_key: str
    degree: int
    boundary: str

    def __call__(self, index: Any) -> None:
        target = open_array(self.root, self.coarse_key, "r+")
        if is_whole_shard(self.root, self.coarse_key, target, index):
            return
        sizes = open_array(self.root, self.fine_key).shape
        box = box_of(index, target.shards, target.shape)
        z, y, x = (reduction(first, last, size, self.degree, self.boundary) for (first, last), size in zip(box, sizes))
        read = functools.partial(read_box, self.root, self.fine_key)
        right = np.zeros((z.cross.shape[0], x.last - x.first, y.last - y.first))
        ends = np.flatnonzero(np.diff(z.fine // _SLAB)) + 1
        for begin, end in zip((0, *ends), (*ends, len(z.fine))):
            slab = read_indices(read, (z.fine[begin:end], y.fine, x.fine))
            reduced = np.stack([x.apply(y.apply(each).T) for each in slab])
            part = z.cross[:, begin:end]
            rows = np.flatnonzero(np.diff(part.indptr))
            if len(rows):
                reached = slice(rows[0], rows[-1] + 1)
                right[reached] += (part[reached] @ reduced.reshape(end - begin, -1)).reshape(-1, *right.shape[1:])
        coarse = z.solve(right).astype(np.float32).swapaxes(1, 2)
        write_shard(self.root, self.coarse_key, index, coarse)


@dataclass(frozen=True)
class SampleShard:
    """Evaluate one shard of a coarser model at its samples, and write them as the type of the finest level's.

    Whole numbers are rounded to the nearest, and all are limited to the range of the finest level's samples.
    """

    root: Path
    key: str
    samples_key: str
    degree: int
    boundary: str
    offset: float
    minimum: float
    maximum: float

    def __call__(self, index: Any) -> None:
        from scipy import ndimage

        target = open_array(self.root, self.samples_key)
        if is_whole_shard(self.root, self.samples_key, target, index):
            return
        box = box_of(index, target.shards, target.shape)
        weights = _AT_SAMPLES[self.degree]
        reach = len(weights) - 1
        grown = tuple((first - reach, last + reach) for first, last in box)
        read = functools.partial(read_box, self.root, self.key)
        values = read_box_folded(read, grown, target.shape, self.boundary)
        for axis in range(3):
            values = ndimage.correlate1d(values, (*weights[:0:-1], *weights), axis)
        values = cut(values, box, grown) + np.float64(self.offset)
        least, greatest = self.minimum, self.maximum
        if target.dtype.kind in "iub":
            values = np.rint(values)
            beyond = float(np.iinfo(target.dtype).max) + 1  # float64 would round the largest number of 64 bits to it
            greatest = min(greatest, float(np.nextafter(beyond, 0)))
        write_shard(self.root, self.samples_key, index, values.clip(least, greatest).astype(target.dtype))


def reduction_memory(shard: Any, degree: int) -> int:
    """An upper bound on the bytes needed to make a shard: slices of the finer level, and the equations along z."""
    z, y, x = (edge + 2 * _halo(degree) for edge in shard)
    equations = 8 * z * shard[1] * shard[2]
    return _SLAB * (2 * 4 * 2 * y * 2 * x + 8 * shard[1] * shard[2]) + 3 * equations + 4 * 4 * math.prod(shard)


@dataclass(frozen=True)
class Reduction:
    """The equations G d = B c along one axis for rows [first, last) of a coarse level.

    Attributes
    ----------
    fine : (N,) int64 array
        The fine samples in these equations.
    cross : (M, N) sparse matrix
        B.
    gram : (M, M) sparse matrix
        G.
    first, last : int
        The range of the M rows that belongs to the block.
    """

    fine: NDArray[np.int64]
    cross: Any
    gram: Any
    first: int
    last: int

    def apply(self, samples: NDArray[Any]) -> NDArray[np.float64]:
        """The coarse coefficients for fine ones, along the first axis."""
        right = self.cross @ samples.reshape(len(samples), -1)
        return self.solve(right.reshape(-1, *samples.shape[1:]))

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """The block's rows of G^-1 times a right-hand side, along its first axis."""
        import scipy.linalg

        size = len(right)
        flat = right.reshape(size, -1)
        width = max(offset for offset in range(min(size, 6)) if self.gram.diagonal(offset).any())
        if size > 6 and self.gram.diagonal(size - 1).any():  # periodic: both ends are coupled
            solved = scipy.linalg.solve(self.gram.toarray(), flat, assume_a="pos")
        else:
            banded = np.zeros((width + 1, size))
            for offset in range(width + 1):
                banded[offset, : size - offset] = self.gram.diagonal(offset)
            solved = scipy.linalg.solveh_banded(banded, flat, lower=True)
        return solved.reshape(right.shape)[self.first : self.last]


@functools.lru_cache(maxsize=64)
def reduction(first: int, last: int, size: int, degree: int, boundary: str) -> Reduction:
    """The equations for rows [first, last) of the next coarser level of a level of `size` samples."""
    import scipy.sparse

    if size == 1:
        one = scipy.sparse.identity(1, format="csr")
        return Reduction(np.zeros(1, np.int64), one, one, 0, 1)
    coarse = coarse_size(size, degree, boundary)
    low, high = _system(first, last, coarse, degree, boundary)
    positions, weights = _quadrature(low, high, coarse, degree, boundary)
    rows = np.repeat(np.arange(len(positions)), degree + 1)

    # Coarse B-splines at the nodes; the boundary rule maps those beyond the ends to others.
    indices, values = _bsplines((positions - origin_shift(degree)) / 2, degree)
    if boundary == "mirror" or high - low == coarse:
        indices = inside_indices(indices, coarse, boundary)
    inside = ((indices >= low) & (indices < high)).ravel()
    places = (rows[inside], indices.ravel()[inside] - low)
    coarse_values = scipy.sparse.csr_matrix((values.ravel()[inside], places), (len(positions), high - low))

    # Fine B-splines. A period of the coarse grid may be one fine sample longer than a period of the fine grid.
    if boundary == "periodic":
        begin = _lower_end(degree)
        positions = begin + (positions - begin) % (2 * coarse)
    indices, values = _bsplines(positions, degree)
    fine, columns = np.unique(inside_indices(indices, size, boundary), return_inverse=True)
    fine_values = scipy.sparse.csr_matrix((values.ravel(), (rows, columns.ravel())), (len(positions), len(fine)))

    weighted = (coarse_values.T @ scipy.sparse.diags(weights)).tocsr()
    cross, gram = (weighted @ fine_values).tocsr(), (weighted @ coarse_values).tocsr()
    return Reduction(fine, cross, gram, first - low, last - low)


def _halo(degree):
    """The number of coarse samples beyond a block on which its coefficients depend."""
    return math.ceil(math.log(_FORGOTTEN) / math.log(POLES[degree])) + degree if degree else 0


def _system(first, last, coarse, degree, boundary):
    """The coarse samples whose equations determine those of a block."""
    low, high = first - _halo(degree), last + _halo(degree)
    if boundary == "mirror":
        low, high = max(low, 0), min(high, coarse)
    return (0, coarse) if high - low >= coarse else (low, high)


def _lower_end(degree):
    """The lower end of a level's box, in samples of the finer one."""
    return 0.0 if degree % 2 else -0.5


def _quadrature(low, high, coarse, degree, boundary):
    """Nodes and weights, in fine samples, over the support of coarse B-splines; exact for products of B-splines."""
    shift, begin = origin_shift(degree), _lower_end(degree)
    whole = (begin, begin + 2 * (coarse - (degree % 2 if boundary == "mirror" else 0)))
    reached = (shift + 2 * low - (degree + 1), shift + 2 * (high - 1) + (degree + 1))
    if high - low == coarse:
        reached = whole
    elif boundary == "mirror":
        reached = (max(reached[0], whole[0]), min(reached[1], whole[1]))
    nodes, weights = np.polynomial.legendre.leggauss(degree + 1)
    cells = np.arange(reached[0], reached[1])
    return (cells[:, None] + (nodes + 1) / 2).ravel(), np.tile(weights / 2, len(cells))


def _bsplines(positions, degree):
    """The degree + 1 integer-spaced B-splines that are not zero at positions: indices and values."""
    indices = np.ceil(positions - (degree + 1) / 2).astype(np.int64)[:, None] + np.arange(degree + 1)
    x = np.abs(positions[:, None] - indices)
    values = np.zeros(x.shape)
    for k in range(degree // 2 + 1):  # truncated powers from the outer end, where they are exact
        values += (-1) ** k * math.comb(degree + 1, k) * np.maximum((degree + 1) / 2 - k - x, 0) ** degree
    return indices, values / math.factorial(degree) if degree else np.ones(x.shape)
