"""Albedo, gradient magnitude and curvature of images against closed forms."""

import numpy as np
import pytest

import isospline

SIZE = (80, 60)
RADIUS, SCALE = 5.0, 1.5


@pytest.fixture(scope="module")
def image():
    """A ball of f = |x|^2 scaled by 1.5, geometry 0, in front of a coloured wall, geometry 1."""
    z, y, x = np.mgrid[-12:13, -12:13, -12:13].astype(float)
    volume = isospline.Volume(x**2 + y**2 + z**2, origin=(-12, -12, -12))
    scene = isospline.Scene()
    scene.add(isospline.Isosurface(volume, RADIUS**2, inside="below"), np.diag([SCALE, SCALE, SCALE, 1]))
    corners = [(-9, 10, -9), (9, 10, -9), (9, 10, 9), (-9, 10, 9)]
    colors = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]  # x and z of the wall as red and green
    scene.add(isospline.Mesh(corners, [(0, 1, 2), (0, 2, 3)], colors=colors))
    camera = isospline.PerspectiveCamera((2, -40, 3), (0, 0, 0), field_of_view=32)
    shading = {0: isospline.Phong(color=(0.9, 0.5, 0.1)), 1: isospline.Outline(surface_color=(1, 0.5, 1))}
    return isospline.render(scene, camera, size=SIZE, shading=shading, samples=2, curvature=True)


def test_albedo(image):
    ball, wall = image.geometry_ids == 0, image.geometry_ids == 1
    assert min(ball.sum(), wall.sum(), (~ball & ~wall).sum()) > 200
    assert (image.albedo[ball] == np.array((0.9, 0.5, 0.1), np.float32)).all()
    x, z = image.position[wall][:, 0], image.position[wall][:, 2]
    np.testing.assert_allclose(image.albedo[wall][:, 0], (x + 9) / 18, atol=1e-6)
    np.testing.assert_allclose(image.albedo[wall][:, 1], 0.5 * (z + 9) / 18, atol=1e-6)
    assert not image.albedo[wall][:, 2].any() and not image.albedo[~ball & ~wall].any()


def test_gradient_magnitude(image):
    ball = image.geometry_ids == 0
    np.testing.assert_allclose(image.gradient_magnitude[ball], 2 * RADIUS / SCALE, rtol=1e-5)
    assert not image.gradient_magnitude[~ball].any()


def test_curvature(image):
    ball = image.geometry_ids == 0
    radius = RADIUS * SCALE
    np.testing.assert_allclose(image.curvature[ball, 0], 1 / radius, atol=1e-4)
    np.testing.assert_allclose(image.curvature[ball, 1], 1 / radius**2, atol=1e-4)
    assert not image.curvature[~ball].any()


def test_curvature_is_there_only_where_it_is_wanted():
    camera = isospline.PerspectiveCamera((2, -40, 3), (0, 0, 0))
    image = isospline.render(isospline.Scene(), camera, size=(4, 3))
    assert image.curvature is None and image.albedo.shape == (3, 4, 3)
