"""Rays as affine functions of positions on a picture, in the world or in the space of an object."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..cameras import OrthographicCamera, PerspectiveCamera, ProjectionPlaneCamera

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Film:
    """Rays of positions u, in pixels from the top left corner: x = origin + origins u + t (direction + directions u).

    `origin` and `direction` are (3,), `origins` and `directions` are (3, 2).
    """

    origin: NDArray[np.float64]
    direction: NDArray[np.float64]
    origins: NDArray[np.float64]
    directions: NDArray[np.float64]

    @staticmethod
    def of_camera(camera, size) -> Film:
        planar = (PerspectiveCamera, OrthographicCamera, ProjectionPlaneCamera)
        if not isinstance(camera, planar):
            raise TypeError(f"camera: expected one whose image is a plane, got a {type(camera).__name__}")
        distortion = getattr(camera, "distortion", None)
        if distortion is not None and np.any(distortion):
            raise ValueError("camera: expected one without distortion: lines would not be straight in its picture")
        width, height = size
        finer = 2 if min(size) == 1 else 1  # two rays are needed along each side
        rays = camera.rays((finer * width, finer * height))
        first, right, down = rays[0, 0], rays[0, -1], rays[-1, 0]
        half = 0.5 / finer
        by_u = np.stack([(right - first) / (width - 2 * half), (down - first) / (height - 2 * half)], axis=1)
        corner = first - half * by_u.sum(axis=1)
        return Film(corner[:3], corner[3:], by_u[:3], by_u[3:])

    def mapped(self, affine) -> Film:
        """The same rays in another space; t stays."""
        linear = affine[:3, :3]
        return Film(
            linear @ self.origin + affine[:3, 3],
            linear @ self.direction,
            linear @ self.origins,
            linear @ self.directions,
        )

    @property
    def is_parallel(self) -> bool:
        return not self.directions.any()

    @property
    def eye(self) -> NDArray[np.float64]:
        """(e, 1), or (-d, 0) for parallel rays along d."""
        return np.append(-self.direction, 0.0) if self.is_parallel else np.append(self.origin, 1.0)

    def rays(self, positions) -> NDArray[np.float64]:
        return np.concatenate(
            [self.origin + positions @ self.origins.T, self.direction + positions @ self.directions.T], axis=-1
        )

    def project(self, points) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The positions, (N, 2), and t, (N), of points."""
        offsets = points - self.origin
        if self.is_parallel:
            solved = np.linalg.solve(np.column_stack([self.origins, self.direction]), offsets.T)
            return solved[:2].T, solved[2]
        solved = np.linalg.solve(np.column_stack([self.directions, self.direction]), offsets.T)
        with np.errstate(divide="ignore", invalid="ignore"):
            return (solved[:2] / solved[2]).T, solved[2]


class Samples:
    """Positions on a picture, (N, 2), by pixel."""

    def __init__(self, positions):
        self.positions = positions
        self.corner = np.floor(positions.min(axis=0, initial=0.0)).astype(np.int64)
        pixels = np.floor(positions).astype(np.int64) - self.corner
        self.width, self.height = pixels.max(axis=0, initial=0) + 1
        places = pixels[:, 1] * self.width + pixels[:, 0]
        self.order = np.argsort(places, kind="stable")
        self.splits = np.searchsorted(places[self.order], np.arange(self.width * self.height + 1))

    def near(self, positions, reach: int):
        """Pairs of the index of a position and of a sample, for all samples within so many pixels along each axis."""
        pixels = np.floor(positions).astype(np.int64) - self.corner
        # The samples of a row of pixels follow each other.
        y = pixels[:, 1, None] + np.arange(-reach, reach + 1)
        is_inside = (y >= 0) & (y < self.height)
        row = np.where(is_inside, y, 0) * self.width
        begin = self.splits[row + np.clip(pixels[:, 0] - reach, 0, self.width)[:, None]]
        end = self.splits[row + np.clip(pixels[:, 0] + reach + 1, 0, self.width)[:, None]]
        counts = np.where(is_inside, end - begin, 0).reshape(-1)
        start = np.repeat(np.arange(len(positions)), counts.reshape(len(positions), -1).sum(axis=1))
        within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        return start, self.order[np.repeat(begin.reshape(-1), counts) + within]


def jittered(pixels, count: int, seed: int) -> NDArray[np.float64]:
    """Samples of pixels, whose corners are (M, 2) integers: (M * count, 2) positions, uniform in each pixel.

    If `count` is a square, each is in a square of its own. The same pixel has the same samples in any list.
    """
    side = math.isqrt(count)
    side = side if side * side == count else 1
    part = np.arange(count)
    strata = np.stack([part % side, part // side % side], axis=1)
    places = ((pixels[:, 1] + (1 << 24)) << 26) + pixels[:, 0] + (1 << 24)
    return (pixels[:, None, :] + (strata + _uniform(places[:, None] * count + part, seed)) / side).reshape(-1, 2)


def _uniform(numbers, seed):
    """Two random numbers in [0, 1) for each integer; those of different seeds are independent."""
    base = _mixed(np.array([seed], dtype=np.uint64))
    columns = [_mixed(_mixed(numbers.astype(np.uint64) * np.uint64(2) + np.uint64(axis)) ^ base) for axis in range(2)]
    return np.stack([(column >> np.uint64(11)).astype(float) * 2.0**-53 for column in columns], axis=-1)


def _mixed(numbers):
    """One-to-one, with bits as if random: SplitMix64 (Steele, Lea and Flood 2014)."""
    z = (numbers + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))
