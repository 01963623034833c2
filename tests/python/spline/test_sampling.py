"""Values and derivatives in the world: analytic volumes, affines, shapes of points."""

import numpy as np
import pytest
from analytic_volumes import ALL, Gaussian, Gyroid, Plane, Sphere

import isospline


@pytest.mark.parametrize("analytic", ALL, ids=lambda analytic: type(analytic).__name__)
def test_closed_forms_of_derivatives_agree_with_each_other(rng, analytic):
    points = rng.uniform(5, 15, (50, 3))
    h = 1e-4
    for axis in range(3):
        step = h * np.eye(3)[axis]
        slope = (analytic.value(points + step) - analytic.value(points - step)) / (2 * h)
        np.testing.assert_allclose(analytic.gradient(points)[:, axis], slope, rtol=1e-5, atol=1e-5)
        bend = (analytic.gradient(points + step) - analytic.gradient(points - step)) / (2 * h)
        np.testing.assert_allclose(analytic.hessian(points)[:, :, axis], bend, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize(("analytic", "degrees"), [(Plane(), (1, 2, 3, 4, 5)), (Sphere((20, 20, 20), 9), (2, 3, 4, 5))])
def test_polynomials_are_held_exactly(rng, analytic, degrees):
    """Splines reproduce polynomials up to their degree; the border's rule is forgotten exponentially."""
    shape, spacing, origin = (58, 60, 64), (0.5, 0.75, 1.0), (2.0, -3.0, -9.0)
    data = analytic.values(shape, spacing, origin)
    span = np.ptp(data)
    lower = np.array(origin) + 20 * np.array(spacing)
    upper = np.array(origin) + (np.array(shape[::-1]) - 21) * np.array(spacing)
    points = rng.uniform(lower, upper, (200, 3))
    for degree in degrees:
        volume = isospline.Volume(data, spacing=spacing, origin=origin, degree=degree)
        assert np.abs(volume.sample(points) - analytic.value(points)).max() <= 3e-7 * span
        gradient = volume.sample(points, derivative=1)
        assert np.abs(gradient - analytic.gradient(points)).max() <= 1e-6 * span
        if degree > 1:
            hessian = volume.sample(points, derivative=2)
            assert np.abs(hessian - analytic.hessian(points)).max() <= 4e-6 * span


@pytest.mark.parametrize("degree", [2, 3, 4, 5])
@pytest.mark.parametrize("analytic", [Gyroid(12.0), Gaussian((12.0, 12.0, 12.0))], ids=["gyroid", "gaussian"])
def test_the_order_of_approximation_is_degree_plus_one(rng, analytic, degree):
    """Half the spacing divides the error of values by 2^(n+1), of gradients by 2^n, and of Hessians by 2^(n-1)."""
    points = rng.uniform(9, 15, (200, 3))
    errors = []
    for spacing, size in ((1.0, 25), (0.5, 49)):
        volume = isospline.Volume(analytic.values((size,) * 3, (spacing,) * 3), spacing=(spacing,) * 3, degree=degree)
        errors.append(
            (
                np.abs(volume.sample(points) - analytic.value(points)).max(),
                np.abs(volume.sample(points, derivative=1) - analytic.gradient(points)).max(),
                np.abs(volume.sample(points, derivative=2) - analytic.hessian(points)).max(),
            )
        )
    for derivative, (coarse, fine) in enumerate(zip(*errors)):
        assert fine <= max(coarse / 2 ** (degree + 1 - derivative) * 1.6, 1e-6)


def rotation(rng):
    q, r = np.linalg.qr(rng.standard_normal((3, 3)))
    return q * np.sign(np.diag(r))


@pytest.mark.parametrize("mirrored", [False, True])
def test_world_derivatives_follow_the_affine(rng, mirrored):
    direction = rotation(rng)
    if np.linalg.det(direction) < 0:
        direction[:, 2] *= -1
    if mirrored:
        direction[:, 0] *= -1
    spacing, origin = np.array([0.5, 1.5, 2.5]), np.array([10.0, -20.0, 30.0])
    data = rng.random((12, 11, 10))
    world = isospline.Volume(data, spacing=spacing, origin=origin, direction=direction, degree=3)
    index = isospline.Volume(data, degree=3)
    jacobian = direction * spacing
    np.testing.assert_allclose(world.affine[:3, :3], jacobian, atol=1e-15)
    points = rng.uniform(0, 9, (50, 3))
    there = points @ jacobian.T + origin
    inverse = np.linalg.inv(jacobian)
    np.testing.assert_allclose(world.sample(there), index.sample(points), atol=1e-11)
    np.testing.assert_allclose(
        world.sample(there, derivative=1), index.sample(points, derivative=1) @ inverse, atol=1e-10
    )
    np.testing.assert_allclose(
        world.sample(there, derivative=2), inverse.T @ index.sample(points, derivative=2) @ inverse, atol=1e-9
    )


def test_sheared_directions_are_allowed(rng):
    direction = np.array([[1.0, 0.3, 0.0], [0.0, 1.0, 0.2], [0.0, 0.0, 1.0]])
    data = rng.random((5, 6, 7))
    volume = isospline.Volume(data, direction=direction)
    np.testing.assert_allclose(volume.sample(direction @ [3.0, 2.0, 1.0]), data[1, 2, 3], atol=1e-6)


def test_points_of_any_shape_and_layout(rng):
    volume = isospline.Volume(rng.random((5, 6, 7)))
    points = rng.uniform(0, 4, (3, 4, 3))
    expected = volume.sample(points.reshape(-1, 3)).reshape(3, 4)
    np.testing.assert_array_equal(volume.sample(points), expected)
    np.testing.assert_array_equal(volume.sample(np.asfortranarray(points)), expected)
    np.testing.assert_array_equal(volume.sample(points[::-1])[::-1], expected)
    np.testing.assert_array_equal(volume.sample(points.astype(">f8")), expected)
    np.testing.assert_allclose(volume.sample(points.astype(np.float32)), expected, atol=1e-5)
    np.testing.assert_array_equal(volume.sample(points.tolist()), expected)
    assert volume.sample(points, derivative=1).shape == (3, 4, 3)
    assert volume.sample(points, derivative=2).shape == (3, 4, 3, 3)
    assert volume.sample([1, 2, 3]).shape == ()
    assert volume.sample(np.zeros((0, 3))).shape == (0,)
    assert volume.sample(points).dtype == np.float64


@pytest.mark.parametrize("boundary", ["mirror", "periodic"])
def test_far_points_are_folded_and_not_finite_ones_give_nan(rng, boundary):
    volume = isospline.Volume(rng.random((5, 6, 7)), boundary=boundary)
    period = np.array([7, 6, 5]) if boundary == "periodic" else np.array([12, 10, 8])
    points = rng.uniform(0, 5, (50, 3))
    np.testing.assert_allclose(volume.sample(points + 2**20 * period), volume.sample(points), atol=1e-6)
    assert np.isfinite(volume.sample([[1e300, -1e300, 5.0]])).all()
    for bad in (np.nan, np.inf, -np.inf):
        assert np.isnan(volume.sample([[bad, 1, 1]])).all()
        assert np.isnan(volume.sample([[1, bad, 1]], derivative=1)).all()
        assert np.isnan(volume.sample([[1, 1, bad]], derivative=2)).all()


@pytest.mark.parametrize("degree", range(6))
def test_weights_of_coefficients_are_those_of_the_cell_at_and_beside_knots(rng, degree):
    volume = isospline.Volume(rng.normal(size=(7, 8, 9)), degree=degree)
    knot = 2.0 if degree % 2 else 2.5
    places = np.array([knot, knot + 5e-17, knot - 5e-16, knot + 1e-15, knot + 0.3, -0.5 + 7e-17, 5e-17])
    points = np.stack(np.meshgrid(places, [1.2, knot], [2.7, knot], indexing="ij"), -1).reshape(-1, 3)
    indices, weights, gradients = volume.coefficient_weights(points)
    values = volume.coefficients.ravel()[indices]
    assert weights.sum(1) == pytest.approx(np.ones(len(points)), abs=1e-14)
    assert gradients.sum(1) == pytest.approx(np.zeros((len(points), 3)), abs=1e-13)
    assert (weights * values).sum(1) == pytest.approx(volume.sample(points), abs=1e-5)
    expected = volume.sample(points, derivative=1)
    assert (gradients * values[..., None]).sum(1) == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("boundary", ["mirror", "periodic"])
@pytest.mark.parametrize("degree", [0, 1])
def test_weights_beyond_the_border_are_those_of_the_same_cell(rng, degree, boundary):
    """Of points on faces of cells up to rounding, where f of degree 0 and the gradient of degree 1 jump."""
    direction = np.array([[1.0, 0.3, 0.2], [0.0, 1.0, 0.4], [0.0, 0.0, 1.0]])
    spacing, origin = np.array([0.7, 0.9, 1.4]), np.array([3.0, -2.0, 1.0])
    grid = {"spacing": spacing, "origin": origin, "direction": direction}
    volume = isospline.Volume(rng.normal(size=(6, 7, 8)), degree=degree, boundary=boundary, **grid)
    points = origin + (rng.integers(-9, 24, (2000, 3)) / 2) @ (direction * spacing).T
    indices, weights, gradients = volume.coefficient_weights(points)
    values = volume.coefficients.ravel()[indices]
    assert (weights * values).sum(1) == pytest.approx(volume.sample(points), abs=1e-12)
    expected = volume.sample(points, derivative=1)
    assert (gradients * values[..., None]).sum(1) == pytest.approx(expected, abs=1e-12)
