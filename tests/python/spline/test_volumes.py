"""The volumes made from formulas: gradients against complex steps of the values, known values, sampling."""

import numpy as np
import pytest

from isospline import volumes

FIELDS = {
    "sphere": volumes.sphere(),
    "torus": volumes.torus(),
    "gyroid": volumes.gyroid(),
    "marschner_lobb": volumes.marschner_lobb(),
    "blobs": volumes.blobs(),
    "waves": volumes.waves(),
    "heart": volumes.heart(),
}


def test_every_field_is_tested():
    assert sorted(["Field", *FIELDS]) == volumes.__all__


@pytest.mark.parametrize("name", FIELDS)
def test_gradient_is_the_derivative_of_the_value(name, rng):
    field = FIELDS[name]
    points = rng.uniform(-1, 1, (200, 3))
    step = 1e-5
    value = field.value
    differences = [
        (value(points - 2 * h) - 8 * value(points - h) + 8 * value(points + h) - value(points + 2 * h)) / (12 * step)
        for h in step * np.eye(3)
    ]
    gradient = field.gradient(points)
    np.testing.assert_allclose(gradient, np.stack(differences, axis=-1), atol=1e-7 * np.abs(gradient).max())


@pytest.mark.filterwarnings("error")
def test_marschner_lobb_is_smooth_on_its_axis():
    points = np.array([[0, 0, 0], [0, 0, 0.3], [0, 0, -1.0]])
    gradient = volumes.marschner_lobb().gradient(points)
    slopes = -np.pi / 2 * np.cos(np.pi / 2 * points[:, 2]) / 2.5
    np.testing.assert_allclose(gradient, np.stack([0 * slopes, 0 * slopes, slopes], axis=-1), atol=1e-15)


@pytest.mark.filterwarnings("error")
def test_a_torus_has_no_derivatives_by_x_and_y_on_its_axis():
    points = np.array([[0, 0, 0], [-0.0, 0, 0.3]])
    field = volumes.torus()
    np.testing.assert_array_equal(field.gradient(points), [[np.nan, np.nan, -2 * z] for _, _, z in points])
    np.testing.assert_array_equal(field.hessian(points), [[[np.nan] * 3, [np.nan] * 3, [0, 0, -2]]] * 2)


@pytest.mark.parametrize("name", FIELDS)
def test_hessian_is_symmetric_and_the_derivative_of_the_gradient(name, rng):
    field = FIELDS[name]
    points = rng.uniform(-1, 1, (50, 3))
    hessian = field.hessian(points)
    scale = np.abs(hessian).max()
    np.testing.assert_allclose(hessian, np.swapaxes(hessian, -1, -2), atol=1e-12 * scale)
    step = 1e-5
    differences = [(field.gradient(points + h) - field.gradient(points - h)) / (2 * step) for h in step * np.eye(3)]
    np.testing.assert_allclose(hessian, np.stack(differences, axis=-1), atol=1e-4 * scale)


def test_known_values():
    assert volumes.sphere(0.5).value(np.array([0.5, 0, 0])) == 0
    assert volumes.torus(0.6, 0.25).value(np.array([0.6, 0, 0.25])) == pytest.approx(0)
    assert volumes.gyroid(2).value(np.array([0.25, 0, 0])) == pytest.approx(1)
    # Marschner and Lobb, at the axis: rho(0) = cos(12 pi) = 1
    assert volumes.marschner_lobb().value(np.zeros(3)) == pytest.approx((1 + 0.25 * 2) / 2.5)


def test_samples_are_the_values_at_voxel_centres():
    field, shape = volumes.waves(), (3, 4, 5)
    data = field.values(shape, np.float64)
    grid = field.grid(shape)
    z, y, x = np.indices(shape)
    points = np.stack([x, y, z], axis=-1) * grid["spacing"] + grid["origin"]
    np.testing.assert_allclose(data, field.value(points), atol=1e-12)
    np.testing.assert_allclose(points.min((0, 1, 2)) - np.array(grid["spacing"]) / 2, -1)
    assert field.values(2).shape == (2, 2, 2)


def test_a_field_is_at_its_place_in_any_order_of_axes():
    points = np.array([(0.6, 0, 0), (0, 0, 0.6), (0.1, -0.5, 0.2)])
    field = volumes.torus()
    first, second = (field.volume((16, 24, 32), axes=axes) for axes in ("zyx", "xyz"))
    np.testing.assert_array_equal(first.bounds, second.bounds)
    np.testing.assert_array_equal(first.sample(points), second.sample(points))


def test_gradients_at_whole_numbers():
    for make in (volumes.blobs, volumes.waves, volumes.heart, volumes.sphere):
        field = make()
        np.testing.assert_array_equal(field.gradient(np.array([[1, 0, 0]])), field.gradient(np.array([[1.0, 0, 0]])))


def test_derivatives_of_a_sharp_heart_are_finite():
    field, points, step = volumes.heart(sharpness=1000.0), np.array([(0.0, 0, 0), (0.3, 0.2, -0.1)]), 1e-6
    steps = step * np.eye(3)
    expected = [(field.gradient(points + each) - field.gradient(points - each)) / (2 * step) for each in steps]
    np.testing.assert_allclose(field.hessian(points), np.stack(expected, axis=-1), rtol=1e-4, atol=1e-3)
