"""Points and the solid: which are inside, by closed forms and by scipy's evaluation of the same spline."""

import numpy as np
import pytest
from analytic_volumes import Plane, Sphere, Torus, grid_points
from scipy import ndimage

import isospline

ROTATION = np.array([(0.8, -0.6, 0.0), (0.6, 0.8, 0.0), (0.0, 0.0, 1.0)])
SHAPE = (25, 25, 25)


def random_points(rng, volume, count, margin=0.0):
    """Points in the box of a volume, and around it by a margin in parts of its size."""
    lower, upper = volume.bounds
    return rng.uniform(lower - margin * (upper - lower), upper + margin * (upper - lower), (count, 3))


@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("inside", ["above", "below"])
def test_contains_is_the_sign_of_the_spline(rng, degree, inside):
    data = rng.normal(size=(9, 10, 11))
    volume = isospline.Volume(data, degree=degree, spacing=(1, 2, 0.5), origin=(3, -2, 1), direction=ROTATION)
    level = 0.2
    surface = isospline.Isosurface(volume, level, inside=inside)
    points = random_points(rng, volume, 20000, margin=0.1)
    index = np.linalg.solve(volume.affine[:3, :3], (points - volume.affine[:3, 3]).T)
    coefficients = ndimage.spline_filter(data, degree, mode="mirror") if degree > 1 else data
    f = ndimage.map_coordinates(coefficients, index[::-1], order=degree, mode="mirror", prefilter=False)
    half = 0.5 if degree == 2 else 0.0
    in_domain = ((index >= -half) & (index <= np.array([[10], [9], [8]]) + half)).all(axis=0)
    expected = in_domain & ((f > level) if inside == "above" else (f < level))
    decided = np.abs(f - level) > 1e-5  # coefficients are float32
    assert decided.mean() > 0.99 and 0.05 < expected.mean() < 0.7 and not in_domain.all()
    np.testing.assert_array_equal(surface.contains(points)[decided], expected[decided])
    # With the library's own coefficients, the sign equals the sign in float64.
    np.testing.assert_array_equal(
        surface.contains(points), in_domain & ((volume.sample(points) > level) == (inside == "above"))
    )


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_points_at_the_level_count_as_above(rng, degree):
    # Of whole numbers, also as plateaus. The samples are coefficients, so that f has no error where it is constant.
    data = rng.integers(0, 3, (4, 4, 4)).repeat(4, 0).repeat(4, 1).repeat(4, 2)
    volume = isospline.Volume(data, degree=degree, filter="none")
    above, below = (isospline.Isosurface(volume, 1, inside=inside) for inside in ("above", "below"))
    points = grid_points(data.shape)
    at_level = volume.sample(points) == 1
    inside = above.contains(points)
    assert 0.1 < at_level.mean() < 0.5 and inside[at_level].all()
    np.testing.assert_array_equal(inside, above.to_mask())
    np.testing.assert_array_equal(below.contains(points), below.to_mask())
    np.testing.assert_array_equal(below.contains(points), ~inside)
    np.testing.assert_array_equal(isospline.Scene(above).occupancy(points) == 1, inside)


@pytest.mark.parametrize("field", [Plane(), Sphere((12, 12, 12), 8.0), Torus()], ids=lambda field: type(field).__name__)
def test_contains_agrees_with_closed_forms(rng, field):
    volume = isospline.Volume(field.values(SHAPE), degree=3)
    points = rng.uniform(3, 21, (20000, 3))
    value = field.value(points)
    decided = np.abs(value) > 0.02 * np.linalg.norm(field.gradient(points), axis=1)  # 1/50 voxel from the surface
    inside = isospline.Isosurface(volume, 0.0).contains(points)
    np.testing.assert_array_equal(inside[decided], value[decided] > 0)
    outside = isospline.Isosurface(volume, 0.0, inside="below").contains(points)
    assert (inside != outside).all()


def test_contains_agrees_with_rays(rng):
    field = Torus()
    surface = isospline.Isosurface(isospline.Volume(field.values(SHAPE)), 0.0)
    points = rng.uniform(4, 20, (3000, 3))
    rays = np.concatenate([points, rng.normal(size=(3000, 3))], axis=1)
    odd = isospline.Scene([surface]).count_intersections(rays) % 2 == 1
    np.testing.assert_array_equal(surface.contains(points), odd)


def test_contains_sees_masks_and_clips(rng):
    field = Sphere((8, 8, 8), 6.0)
    data = field.values((17, 17, 17))
    mask = np.ones(data.shape, bool)
    mask[:, :, 10:] = False
    volume = isospline.Volume(data)
    points = rng.uniform(0, 16, (20000, 3))
    whole = isospline.Isosurface(volume, 0.0).contains(points)
    masked = isospline.Isosurface(volume, 0.0, mask=mask).contains(points)
    np.testing.assert_array_equal(masked, whole & (points[:, 0] < 9.5))
    clip = [isospline.HalfSpace((8, 8, 9), (0, 1, 2)), isospline.Box((-np.inf, 5, -np.inf), (np.inf, np.inf, np.inf))]
    clipped = isospline.Isosurface(volume, 0.0, clip=clip).contains(points)
    kept = ((points - (8, 8, 9)) @ (0, 1, 2) >= 0) & (points[:, 1] >= 5)
    np.testing.assert_array_equal(clipped, whole & kept)
    assert 0 < clipped.sum() < whole.sum() and 0 < masked.sum() < whole.sum()
    # For odd degrees, a cell is removed if any of its corners is masked.
    cubic = isospline.Volume(data, degree=3)
    masked = isospline.Isosurface(cubic, 0.0, mask=mask).contains(points)
    np.testing.assert_array_equal(masked, isospline.Isosurface(cubic, 0.0).contains(points) & (points[:, 0] < 9))


@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("closed", [False, True])
def test_samples_beside_a_mask_are_inside_as_in_the_mask_of_the_solid(rng, degree, closed):
    volume = isospline.Volume(rng.uniform(size=(5, 6, 7)), degree=degree)
    mask = rng.uniform(size=volume.shape) > 0.2
    surface = isospline.Isosurface(volume, 0.4, mask=mask, closed=closed)
    expected = surface.to_mask().astype(bool)
    z, y, x = np.indices(volume.shape)
    samples = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    np.testing.assert_array_equal(surface.contains(samples).reshape(volume.shape), expected)
    assert expected.any() and not expected.all()


@pytest.mark.parametrize("boundary", ["mirror", "periodic"])
def test_points_beyond_the_domain_are_outside(boundary):
    # High at both ends of x, where the spline continues beyond the volume's border.
    volume = isospline.Volume(np.full((4, 5, 6), 7.0) + (3, 2, 1, 1, 2, 3), boundary=boundary)
    surface = isospline.Isosurface(volume, 8.5)
    lower, upper = volume.bounds
    assert surface.contains(upper).shape == () and surface.contains(upper) and surface.contains(lower)
    beyond = [np.nextafter(upper, np.inf), np.nextafter(lower, -np.inf), upper * (1e300, 1, 1)]
    assert (volume.sample(beyond[:2]) > 8.5).all()
    assert surface.contains(beyond).tolist() == [False, False, False]


@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("inside", ["above", "below"])
def test_samples_on_the_border_are_in_the_domain_in_spite_of_rounding(rng, degree, inside):
    beside = 0
    for turned in (False, True) * 8:
        direction = np.linalg.qr(rng.normal(size=(3, 3)))[0] if turned else np.eye(3)
        place = dict(spacing=rng.uniform(0.1, 3, 3), origin=rng.uniform(-100, 100, 3), direction=direction)
        data = rng.integers(0, 9, rng.integers(3, 7, 3))
        surface = isospline.Isosurface(isospline.Volume(data, degree=degree, **place), 3.5, inside=inside)
        points = grid_points(data.shape) @ (direction * place["spacing"]).T + place["origin"]
        # The model interpolates, so that samples tell the answer.
        expected = (data > 3.5) if inside == "above" else (data < 3.5)
        np.testing.assert_array_equal(surface.to_mask(), expected)
        np.testing.assert_array_equal(surface.contains(points), expected)
        np.testing.assert_array_equal(isospline.Scene(surface).occupancy(points) == 1, expected)
        certified = surface.contains(points, certify=True)
        np.testing.assert_array_equal(certified[certified == 1], 1 * expected[certified == 1])
        beside += (certified != expected).sum()
        # Farther out than by rounding, samples' positions are outside; and so are points between samples.
        lower, upper = grid_points(data.shape).min((0, 1, 2)) - 0.5 * (degree == 2), np.array(data.shape[::-1]) - 1.0
        upper = upper + 0.5 * (degree == 2)
        for index in ([*upper[:2], upper[2] + 1e-9], [lower[0] - 1e-9, *lower[1:]], [0, upper[1] + 1e-9, 1]):
            assert not surface.contains(direction @ (index * place["spacing"]) + place["origin"])
    assert (beside > 0) == (degree != 2)


def test_contains_takes_any_array_and_names_bad_points():
    surface = isospline.Isosurface(isospline.Volume(Sphere().values((17, 17, 17))), 0.0)
    points = grid_points((4, 3, 2)) + 7
    inside = surface.contains(points)
    assert inside.shape == (4, 3, 2) and inside.dtype == bool and inside.all()
    np.testing.assert_array_equal(surface.contains(points.astype(np.float32)[:, ::-1]), inside)
    assert surface.contains(np.zeros((0, 3))).shape == (0,)
    with pytest.raises(ValueError, match=r"points: expected finite numbers"):
        surface.contains([(0, 0, 0), (1, np.nan, 2)])
    with pytest.raises(ValueError, match=r"points: expected shape \(..., 3\)"):
        surface.contains((1, 2, 3, 4))
    with pytest.raises(TypeError, match="points: expected an array of real numbers"):
        surface.contains("abc")
