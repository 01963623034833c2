"""Volumes with a closed form for value, gradient and Hessian, in float64, at any points of the world.

The solid is where the value is positive, so that the surface of level 0 has closed forms too.
"""

from dataclasses import dataclass

import numpy as np


def grid_points(shape, spacing=(1, 1, 1), origin=(0, 0, 0)):
    """World positions, (nz, ny, nx, 3), of the samples of an axis-aligned volume of `shape` (nz, ny, nx)."""
    z, y, x = np.meshgrid(*(np.arange(size, dtype=float) for size in shape), indexing="ij")
    return np.stack([x, y, z], axis=-1) * np.asarray(spacing, float) + np.asarray(origin, float)


class AnalyticVolume:
    """A function of the position with its derivatives; `points` is (..., 3)."""

    def value(self, points):
        """(...) values."""
        raise NotImplementedError

    def gradient(self, points):
        """(..., 3) gradients."""
        raise NotImplementedError

    def hessian(self, points):
        """(..., 3, 3) Hessians."""
        raise NotImplementedError

    def values(self, shape, spacing=(1, 1, 1), origin=(0, 0, 0)):
        """Samples on a grid, (nz, ny, nx)."""
        return self.value(grid_points(shape, spacing, origin))


@dataclass
class Plane(AnalyticVolume):
    """f = <normal, x> - offset; splines of degree 1 and more hold it exactly."""

    normal: tuple = (0.3, -0.5, 0.8)
    offset: float = 2.0

    def value(self, points):
        return np.asarray(points) @ np.asarray(self.normal) - self.offset

    def gradient(self, points):
        return np.broadcast_to(np.asarray(self.normal, float), np.shape(points)).copy()

    def hessian(self, points):
        return np.zeros((*np.shape(points), 3))


@dataclass
class Sphere(AnalyticVolume):
    """f = radius^2 - |x - center|^2; splines of degree 2 and more hold it exactly, except near the volume's border."""

    center: tuple = (8.0, 8.0, 8.0)
    radius: float = 5.0

    def value(self, points):
        return self.radius**2 - np.sum((points - np.asarray(self.center)) ** 2, axis=-1)

    def gradient(self, points):
        return -2.0 * (points - np.asarray(self.center))

    def hessian(self, points):
        return np.broadcast_to(-2.0 * np.eye(3), (*np.shape(points), 3)).copy()


@dataclass
class Torus(AnalyticVolume):
    """f = 4 R^2 (x^2 + y^2) - (|x|^2 + R^2 - r^2)^2, about the z axis through the center."""

    center: tuple = (12.0, 12.0, 12.0)
    major_radius: float = 6.0
    minor_radius: float = 2.5

    def value(self, points):
        p = points - np.asarray(self.center)
        s = np.sum(p**2, axis=-1) + self.major_radius**2 - self.minor_radius**2
        return 4.0 * self.major_radius**2 * np.sum(p[..., :2] ** 2, axis=-1) - s**2

    def gradient(self, points):
        p = points - np.asarray(self.center)
        s = np.sum(p**2, axis=-1) + self.major_radius**2 - self.minor_radius**2
        in_plane = p * (1.0, 1.0, 0.0)
        return 8.0 * self.major_radius**2 * in_plane - 4.0 * s[..., None] * p

    def hessian(self, points):
        p = points - np.asarray(self.center)
        s = np.sum(p**2, axis=-1) + self.major_radius**2 - self.minor_radius**2
        identity = np.eye(3)
        return (
            8.0 * self.major_radius**2 * np.diag([1.0, 1.0, 0.0])
            - 4.0 * s[..., None, None] * identity
            - 8.0 * p[..., :, None] * p[..., None, :]
        )


@dataclass
class Gyroid(AnalyticVolume):
    """f = sin X cos Y + sin Y cos Z + sin Z cos X, with X = 2 pi x / period and so on."""

    period: float = 16.0

    def value(self, points):
        x, y, z = np.moveaxis(np.asarray(points) * (2.0 * np.pi / self.period), -1, 0)
        return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)

    def gradient(self, points):
        scale = 2.0 * np.pi / self.period
        x, y, z = np.moveaxis(np.asarray(points) * scale, -1, 0)
        return scale * np.stack(
            [
                np.cos(x) * np.cos(y) - np.sin(z) * np.sin(x),
                np.cos(y) * np.cos(z) - np.sin(x) * np.sin(y),
                np.cos(z) * np.cos(x) - np.sin(y) * np.sin(z),
            ],
            axis=-1,
        )

    def hessian(self, points):
        scale = 2.0 * np.pi / self.period
        x, y, z = np.moveaxis(np.asarray(points) * scale, -1, 0)
        xx = -np.sin(x) * np.cos(y) - np.sin(z) * np.cos(x)
        yy = -np.sin(y) * np.cos(z) - np.sin(x) * np.cos(y)
        zz = -np.sin(z) * np.cos(x) - np.sin(y) * np.cos(z)
        xy, yz, zx = -np.cos(x) * np.sin(y), -np.cos(y) * np.sin(z), -np.cos(z) * np.sin(x)
        rows = [np.stack(row, axis=-1) for row in ((xx, xy, zx), (xy, yy, yz), (zx, yz, zz))]
        return scale**2 * np.stack(rows, axis=-2)


@dataclass
class Gaussian(AnalyticVolume):
    """f = exp(-1/2 <x - center, precision (x - center)>) - level."""

    center: tuple = (8.0, 8.0, 8.0)
    precision: tuple = ((0.08, 0.02, 0.0), (0.02, 0.06, -0.01), (0.0, -0.01, 0.05))
    level: float = 0.5

    def _exponential(self, points):
        p = points - np.asarray(self.center)
        q = p @ np.asarray(self.precision)
        return np.exp(-0.5 * np.sum(p * q, axis=-1)), q

    def value(self, points):
        return self._exponential(points)[0] - self.level

    def gradient(self, points):
        e, q = self._exponential(points)
        return -e[..., None] * q

    def hessian(self, points):
        e, q = self._exponential(points)
        return e[..., None, None] * (q[..., :, None] * q[..., None, :] - np.asarray(self.precision))


ALL = (Plane(), Sphere(), Torus(), Gyroid(), Gaussian())
