"""Label maps whose surfaces are known, and random ones."""

import numpy as np
from scipy import ndimage

CENTER = np.array([31.2, 30.7, 31.4])


def grid(*shape):
    """x, y and z of voxels."""
    z, y, x = np.mgrid[tuple(slice(count) for count in shape)]
    return x, y, z


def sphere(radius, size=None, spacing=(1.0, 1.0, 1.0), seed=0):
    """A voxelised sphere, and its outward normals at points."""
    counts = [int(np.ceil((size or 2 * radius + 14) / step)) for step in spacing]
    random = np.random.default_rng(seed).uniform(-0.5, 0.5, 3)
    center = (np.array(counts) / 2 - 0.5 + random) * spacing
    x, y, z = (each * step for each, step in zip(grid(*counts[::-1]), spacing))
    inside = (x - center[0]) ** 2 + (y - center[1]) ** 2 + (z - center[2]) ** 2 < radius**2

    def normals(points):
        return (points - center) / np.linalg.norm(points - center, axis=1, keepdims=True)

    return inside.astype(np.uint8), normals


def torus(ring=20.0, tube=6.0):
    """A voxelised torus, and its outward normals at points."""
    wide, high = int(2 * (ring + tube) + 14), int(2 * tube + 14)
    center = np.array([wide / 2 - 0.3, wide / 2 - 0.6, high / 2 - 0.45])
    x, y, z = grid(high, wide, wide)
    inside = (np.hypot(x - center[0], y - center[1]) - ring) ** 2 + (z - center[2]) ** 2 < tube**2

    def normals(points):
        apart = points - center
        flat = apart[:, :2] / np.hypot(apart[:, 0], apart[:, 1])[:, None] * ring
        away = apart - np.c_[flat, np.zeros(len(flat))]
        return away / np.linalg.norm(away, axis=1, keepdims=True)

    return inside.astype(np.uint8), normals


def plate_and_ball():
    """A ball with a plate of one voxel."""
    x, y, z = grid(44, 44, 44)
    ball = (x - 21.3) ** 2 + (y - 22.1) ** 2 + (z - 21.7) ** 2 < 81
    return (ball | ((z == 21) & (x > 3) & (x < 40) & (y > 3) & (y < 40))).astype(np.uint8)


def oblique_wall():
    """A disc of about one and a half voxels, oblique to the axes."""
    x, y, z = grid(44, 44, 44)
    return ((np.abs(0.8 * z + 0.6 * x - 30.2) < 0.72) & (np.hypot(y - 22, x - 22) < 15)).astype(np.uint8)


def blobs(seed, width):
    """Random blobs with a border of background."""
    noise = np.random.default_rng(seed).normal(size=(40, 42, 44))
    smooth = ndimage.gaussian_filter(noise, width, mode="wrap")
    inside = smooth > np.quantile(smooth, 0.7)
    return np.pad(inside[3:-3, 3:-3, 3:-3], 3).astype(np.uint8)


def crumbs():
    """One voxel, a line of voxels and eight voxels."""
    data = np.zeros((20, 20, 20), np.uint8)
    data[5, 5, 5] = data[12, 12, 5:9] = data[14:16, 5:7, 14:16] = 1
    return data


def cells(count=7, size=64, seed=1, radius=26.0):
    """The Voronoi cells of random points, cut by a ball: many places where three and four labels meet."""
    points = np.random.default_rng(seed).uniform(0.22 * size, 0.78 * size, (count, 3))
    x, y, z = grid(size, size, size)
    distances = [(x - p[0]) ** 2 + (y - p[1]) ** 2 + (z - p[2]) ** 2 for p in points]
    center = CENTER * (size / 64)
    outside = (x - center[0]) ** 2 + (y - center[1]) ** 2 + (z - center[2]) ** 2 > radius**2
    return np.where(outside, 0, 1 + np.argmin(distances, axis=0)).astype(np.uint8)
