"""Separable linear filters of volumes, as banded matrices of one axis each, with mirror boundaries."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Rows of a matrix that are applied at once: longer blocks multiply more zeros, shorter ones call BLAS more often.
_BLOCK = 64
# Radius of a Gaussian's kernel, in standard deviations.
_TRUNCATION = 3.0
# Entries of a matrix that are left out.
_NEGLIGIBLE = 1e-7

#: Matrices of the axes z, y and x, each with the number of its diagonals on either side.
Filter = list[tuple[NDArray[np.float32], int]]


def gaussian(shape: tuple[int, ...], deviations: NDArray[np.float64]) -> Filter:
    """Convolution with a Gaussian; standard deviations in voxels, in the order of the shape."""
    return [_banded(_gaussian_matrix(count, each)) for count, each in zip(shape, deviations)]


def low_pass(shape: tuple[int, ...], deviations: NDArray[np.float64]) -> Filter:
    r"""The filter :math:`1 - (1 - G)^3` along each axis, which keeps polynomials of degree 5."""
    matrices = []
    for count, each in zip(shape, deviations):
        rest = np.eye(count) - _gaussian_matrix(count, each)
        matrices.append(_banded(np.eye(count) - rest @ rest @ rest))
    return matrices


def quadratic_interpolation(shape: tuple[int, ...]) -> Filter:
    """Samples to coefficients of the B-spline of degree 2 that interpolates them, as `Volume` does by default."""
    return [_banded(np.linalg.inv(_toeplitz(count, np.array([1, 6, 1]) / 8))) for count in shape]


def apply(filter: Filter, samples: NDArray[np.float32]) -> NDArray[np.float32]:
    """The filtered samples."""
    for axis, (matrix, radius) in enumerate(filter):
        samples = _apply_along(axis, matrix, radius, samples)
    return samples


def _apply_along(axis, matrix, radius, samples):
    count = samples.shape[axis]
    if count == 1:
        return samples
    result = np.empty_like(samples, order="C")
    for begin in range(0, count, _BLOCK):
        end = min(begin + _BLOCK, count)
        low, high = max(begin - radius, 0), min(end + radius, count)
        rows = matrix[begin:end, low:high]
        if axis == 0:
            part = rows @ samples[low:high].reshape(high - low, -1)
            result[begin:end] = part.reshape(end - begin, *samples.shape[1:])
        elif axis == 1:
            np.matmul(rows, samples[:, low:high], out=result[:, begin:end])
        else:
            result[..., begin:end] = samples[..., low:high] @ rows.T
    return result


def _banded(matrix):
    """A matrix in single precision, and the number of diagonals on either side that are not negligible."""
    rows, columns = np.nonzero(np.abs(matrix) > _NEGLIGIBLE)
    return matrix.astype(np.float32), int(np.abs(rows - columns).max())


def _gaussian_matrix(count, deviation):
    radius = int(np.ceil(_TRUNCATION * deviation))
    kernel = np.exp(-0.5 * (np.arange(-radius, radius + 1) / deviation) ** 2)
    return _toeplitz(count, kernel / kernel.sum())


def _toeplitz(count, kernel):
    """Convolution with a kernel; samples are mirrored at the centres of the first and of the last one."""
    radius = len(kernel) // 2
    matrix = np.zeros((count, count))
    if count == 1:
        matrix[0, 0] = 1.0
        return matrix
    places = np.arange(count)
    for offset, weight in zip(range(-radius, radius + 1), kernel):
        folded = (places + offset) % (2 * count - 2)
        np.add.at(matrix, (places, np.minimum(folded, 2 * count - 2 - folded)), weight)
    return matrix
