"""The part of each voxel in which a B-spline of degree 2 is positive."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

# Boxes that are evaluated at once, so that they fit into the processor's cache.
_CHUNK = 1 << 17
# Gradients below this one, in values per voxel, count as this one.
_LEAST_GRADIENT = 1e-3


class PartialVolumes(NamedTuple):
    """Of the voxels that the surface may cross: their flat indices, the positive parts, and their derivatives."""

    voxels: NDArray[np.intp]
    parts: NDArray[np.float32]
    derivatives: NDArray[np.float32]
    is_inside: NDArray[np.bool_]

    @property
    def volume(self) -> float:
        """Of the positive part, in voxels."""
        return float(np.count_nonzero(self.is_inside) + self.parts.sum(dtype=float))

    def dense(self) -> NDArray[np.float32]:
        """The positive part of each voxel."""
        dense = self.is_inside.astype(np.float32)
        dense.ravel()[self.voxels] = self.parts
        return dense

    def dense_derivatives(self) -> NDArray[np.float32]:
        """The derivative of each voxel's part with respect to a constant that is added to the spline."""
        dense = np.zeros(self.is_inside.shape, np.float32)
        dense.ravel()[self.voxels] = self.derivatives
        return dense


def partial_volumes(coefficients: NDArray[np.float32], divisions: int) -> PartialVolumes:
    """The positive parts of voxels, each divided into ``divisions ** 3`` boxes in which the spline counts as linear.

    In a voxel, the spline is between the least and the largest of its 27 coefficients. So only voxels whose
    coefficients have both signs are evaluated.
    """
    padded = np.pad(coefficients, 1, mode="reflect")
    lower, upper = _extremes(padded, np.minimum), _extremes(padded, np.maximum)
    voxels = np.flatnonzero(((lower < 0) & (upper > 0)).ravel())
    offsets = _offsets(padded.shape)
    first = np.ravel_multi_index(np.unravel_index(voxels, coefficients.shape), padded.shape)
    weights = _weights(divisions)
    boxes = divisions**3
    parts, derivatives = np.empty(len(voxels), np.float32), np.empty(len(voxels), np.float32)
    flat = padded.ravel()
    for begin in range(0, len(voxels), _CHUNK // boxes):
        chunk = slice(begin, begin + _CHUNK // boxes)
        evaluated = flat[first[chunk, None] + offsets] @ weights
        values, slopes = evaluated[:, :boxes], np.abs(evaluated[:, boxes:])
        width = slopes[:, :boxes] + slopes[:, boxes : 2 * boxes] + slopes[:, 2 * boxes :]
        np.maximum(width, _LEAST_GRADIENT, out=width)
        position = values / width
        derivatives[chunk] = ((np.abs(position) < 0.5) / width).mean(axis=1)
        parts[chunk] = np.clip(position + 0.5, 0, 1).mean(axis=1)
    return PartialVolumes(voxels, parts, derivatives, lower >= 0)


def _extremes(padded, choose):
    """The least or the largest one among the 27 neighbours of each sample."""
    for axis in range(3):
        before, middle, after = (
            padded[(*[slice(None)] * axis, slice(shift, padded.shape[axis] - 2 + shift))] for shift in range(3)
        )
        padded = choose(choose(before, middle), after)
    return padded


def _offsets(shape):
    return np.array([(z * shape[1] + y) * shape[2] + x for z in range(3) for y in range(3) for x in range(3)])


@functools.cache
def _weights(divisions):
    """(27, 4 boxes) weights of coefficients: mean values in boxes of a voxel, and differences along x, y and z."""
    edges = np.linspace(-0.5, 0.5, divisions + 1)
    low, high = edges[:-1], edges[1:]
    ends = [(_primitive(end), _basis(end)) for end in (low, high)]
    means = (ends[1][0] - ends[0][0]) * divisions
    slopes = ends[1][1] - ends[0][1]

    def product(z, y, x):
        return np.einsum("ai,bj,ck->ijkabc", z, y, x).reshape(27, -1)

    columns = [
        product(means, means, means),
        product(means, means, slopes),
        product(means, slopes, means),
        product(slopes, means, means),
    ]
    return np.concatenate(columns, axis=1).astype(np.float32)


def _basis(t):
    """(N, 3) values of the three B-splines of degree 2 at offsets from a voxel's centre."""
    return np.stack([0.5 * (0.5 - t) ** 2, 0.75 - t**2, 0.5 * (0.5 + t) ** 2], axis=1)


def _primitive(t):
    """Their integrals from 0."""
    return np.stack([-((0.5 - t) ** 3) / 6, 0.75 * t - t**3 / 3, (0.5 + t) ** 3 / 6], axis=1)
