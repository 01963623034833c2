"""Derivatives of signed distances, beside finite differences."""

import numpy as np
import pytest

import isospline
from isospline.derivatives import distance_vjp

LEVEL, STEP = 0.03, 1e-4
TRANSFORM = np.array([[0.9, 0.1, 0, 0.1], [-0.1, 1, 0.2, 0.2], [0, -0.2, 1.1, -0.1], [0, 0, 0, 1.0]])
CASES = {
    "whole": {},
    "below": {"inside": "below"},
    "capped": {"clip": isospline.HalfSpace((0, 0, 0.2), (0, 0.3, -1)), "capped": True},
    "masked": {"mask": np.indices((24, 24, 24)).sum(axis=0) < 34},
}


def samples():
    z, y, x = np.meshgrid(*[np.linspace(-1.2, 1.2, 24)] * 3, indexing="ij")
    return 0.7 - np.sqrt(x**2 + 1.3 * y**2 + 0.8 * z**2)


def scene(options, degree, level=LEVEL, data=None, transform=TRANSFORM):
    volume = isospline.Volume(
        samples() if data is None else data, degree=degree, spacing=(2.4 / 23,) * 3, origin=(-1.2,) * 3
    )
    return isospline.Scene([(isospline.Isosurface(volume, level, **options), transform)])


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_gradients_are_those_of_finite_differences(degree, case):
    rng, options = np.random.default_rng(0), CASES[case]
    points = rng.uniform(-1.2, 1.2, (30, 3))
    gains, moves, change = rng.normal(size=30), rng.normal(size=(30, 3)), rng.normal(size=(24, 24, 24))
    turn = np.vstack([rng.normal(size=(3, 4)), np.zeros(4)])
    distances, vjp = distance_vjp(scene(options, degree), points)
    assert np.array_equal(distances, scene(options, degree).signed_distance(points))

    def slope(number):
        return (number(STEP) - number(-STEP)) / (2 * STEP)

    def total(of, at=points):
        return (of.signed_distance(at, tolerance=1e-10) * gains).sum()

    found = vjp(gains)
    by_level = slope(lambda step: total(scene(options, degree, LEVEL + step)))
    by_points = slope(lambda step: total(scene(options, degree), points + step * moves))
    by_transform = slope(lambda step: total(scene(options, degree, transform=TRANSFORM + step * turn)))
    by_samples = slope(lambda step: total(scene(options, degree, data=samples() + step * change)))
    assert found["levels"][0] == pytest.approx(by_level, rel=1e-4, abs=1e-4)
    assert (found["points"] * moves).sum() == pytest.approx(by_points, rel=1e-4, abs=1e-4)
    assert (found["transforms"][0] * turn).sum() == pytest.approx(by_transform, rel=1e-4, abs=1e-4)
    assert (found["samples"][0] * change).sum() == pytest.approx(by_samples, rel=2e-3, abs=5e-3)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_a_foot_where_the_gradient_vanishes_is_still(degree):
    """At a corner of a mirrored volume of degree 3, the gradient is zero; the other point's foot moves."""
    data = np.random.default_rng(0).random((5, 5, 5)) + 1
    data[:, :, 3:] = 0.0
    surface = isospline.Isosurface(isospline.Volume(data, degree=degree), 0.5, closed=True)
    points = [(-2.0, -2.0, -2.0), (6.0, 2.0, 2.0)]
    distances, vjp = distance_vjp(isospline.Scene(surface), points)
    found = vjp([1.0, 0.0])
    np.testing.assert_allclose(found["points"][0], np.full(3, -1 / np.sqrt(3)), rtol=1e-6)
    assert found["levels"][0] == 0 and not found["samples"][0].any()
    alone = distance_vjp(isospline.Scene(surface), points[1:])[1]([1.0])
    together = vjp([0.0, 1.0])
    np.testing.assert_array_equal(together["points"][1], alone["points"][0])
    assert together["levels"][0] == alone["levels"][0] > 0


def test_points_on_the_surface_move_along_its_normal():
    surface = isospline.Isosurface(isospline.volumes.torus().volume(32), isospline.volumes.torus().level)
    on_it = surface.sample_points(20, seed=3)
    distances, vjp = distance_vjp(isospline.Scene(surface), on_it.points)
    assert np.abs(distances).max() < 1e-6
    by_points = vjp(np.ones(20), samples=False)["points"]
    assert np.allclose(by_points, on_it.primitive_normals, atol=1e-3)


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e6])
def test_gradients_do_not_depend_on_the_unit(unit):
    """In metres, distances of nanometres are not zero. The nearest point is a corner; then one is on the surface."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1.0)])
    scene = isospline.Scene(isospline.Mesh(corners * unit, [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]))
    offset = np.array([0.3, -0.2, -0.1])
    found = distance_vjp(scene, [(corners[1] + offset) * unit, (0.2 * unit, 0.2 * unit, -1e-14 * unit)])[1]([1, 1])
    assert found["points"] == pytest.approx(np.array([offset / np.linalg.norm(offset), (0, 0, -1)]), abs=1e-6)


def test_the_level_may_change_before_vjp_is_called():
    at = scene({}, 2)
    _, vjp = distance_vjp(at, [(1.0, 0.2, 0)])
    before = vjp([1.0])["levels"][0]
    at.object(0).level = 0.2
    assert vjp([1.0])["levels"][0] == before


def test_points_with_nothing_near_do_not_move():
    surface = isospline.Isosurface(isospline.volumes.sphere(0.5).volume(16), 0.0)
    distances, vjp = distance_vjp(isospline.Scene(surface), [(3.0, 0, 0), (0.6, 0, 0)], max_distance=0.5)
    found = vjp([np.nan, 1.0], samples=False)
    assert np.isinf(distances[0]) and not found["points"][0].any() and found["points"][1].any()


def test_meshes_move_with_their_transform():
    mesh = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    _, vjp = distance_vjp(isospline.Scene(mesh), [(0.2, 0.2, -0.5)])
    found = vjp([2.0])
    assert found["points"][0].tolist() == [0.0, 0.0, -2.0]
    assert np.allclose(found["transforms"][0][:3, 3], [0, 0, 2.0])
    assert found["levels"] == {} and found["samples"] == {}


def test_wrong_arguments_get_one_sentence():
    with pytest.raises(TypeError, match="scene: expected a Scene, got int"):
        distance_vjp(3, [(0, 0, 0)])
    _, vjp = distance_vjp(scene({}, 2), [(0, 0, 0)])
    with pytest.raises(ValueError, match="distances: expected gradients of shape"):
        vjp([1.0, 2.0])
