"""Spheres as isosurfaces and as meshes, with the closed form for their crossings with rays."""

import numpy as np

import isospline

#: The default centre of `sphere`.
CENTER = np.full(3, 11.5)


def sphere(radius=8.0, size=24):
    """An isosurface that is a sphere about (size - 1) / 2 to within rounding: its model is |x - centre|^2.

    Sums of k^2 beta^2(x - k) are x^2 + 1/4, so coefficients k^2 - 1/4 give x^2 (filter "none").
    """
    x = np.arange(size) - (size - 1) / 2
    square = x**2 - 0.25
    volume = isospline.Volume(square[:, None, None] + square[:, None] + square, filter="none")
    return isospline.Isosurface(volume, radius**2, inside="below")


def mesh_sphere(radius, meridians=256):
    """A mesh whose vertices lie on a sphere about the origin, along meridians and parallels."""
    polar, azimuth = np.meshgrid(
        np.linspace(0, np.pi, meridians // 2 + 1), np.linspace(0, 2 * np.pi, meridians, endpoint=False), indexing="ij"
    )
    vertices = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1)
    index = np.arange(polar.size).reshape(polar.shape)
    a, b = index[:-1], index[1:]
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    quads = np.stack([a, b, c, d], axis=-1).reshape(-1, 4)
    return isospline.Mesh(radius * vertices.reshape(-1, 3), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))


def sagitta(mesh, radius):
    """The largest distance of a mesh's faces from a sphere about the origin that contains all vertices."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    normals = np.cross(b - a, c - a)
    area = np.linalg.norm(normals, axis=1)
    faces = area > 1e-9 * area.max()  # faces at the poles are lines
    return radius - ((normals * a).sum(axis=1)[faces] / area[faces]).min()


def sphere_t(rays, center, radius):
    """The first t at which rays from outside meet a sphere; inf for misses and for spheres behind the origin."""
    offset, direction = rays[:, :3] - center, rays[:, 3:]
    a, b = (direction**2).sum(axis=1), (offset * direction).sum(axis=1)
    discriminant = b**2 - a * ((offset**2).sum(axis=1) - radius**2)
    return np.where((discriminant > 0) & (b < 0), (-b - np.sqrt(np.maximum(discriminant, 0))) / a, np.inf)


def moved(x, y, z):
    """A translation."""
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix
