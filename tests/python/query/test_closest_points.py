"""Nearest points of surfaces: closed forms, cuts, and a dense sampling of the same spline in a KD tree."""

import itertools
import math
import os
import signal
import time
import warnings
from fractions import Fraction

import numpy as np
import pytest
import scipy.ndimage
from scipy.spatial import cKDTree

import isospline

ROTATION = np.array([(0.8, -0.6, 0.0), (0.48, 0.64, -0.6), (0.36, 0.48, 0.8)])
SHEAR = np.array([(1.0, 0.3, 0.0), (0.0, 1.0, -0.2), (0.0, 0.0, 1.0)])


def index_grid(size):
    """Index coordinates, (n, n, n, 3), of the samples of a cube."""
    z, y, x = np.mgrid[0:size, 0:size, 0:size].astype(float)
    return np.stack([x, y, z], axis=-1)


def world_grid(size, spacing, origin, direction):
    return index_grid(size) * spacing @ np.transpose(direction) + origin


def ball(radius, size=25, center=(12.25, 11.5, 12.0), degree=2, **options):
    """f = R^2 - |x - c|^2 without error: samples used as coefficients add the B-spline's variance once per axis."""
    variance = {2: 0.25, 3: 1 / 3}[degree]
    values = radius**2 - ((index_grid(size) - center) ** 2).sum(-1) + 3 * variance
    volume = isospline.Volume(values, degree=degree, filter="none")
    return isospline.Isosurface(volume, 0.0, **options), np.array(center)


def random_points(rng, volume, count, margin=0.3):
    lower, upper = volume.bounds
    return rng.uniform(lower - margin * (upper - lower), upper + margin * (upper - lower), (count, 3))


def check(surface, points, nearest, tolerance=None):
    """Check all answers: points are on the surface, at the returned distances, in the returned cells."""
    volume = surface.volume
    edge = volume.spacing.min()
    found = np.isfinite(nearest["distances"])
    x = nearest["points"][found]
    half = 0.5 if volume.degree == 2 else 0.0
    corners = volume.cell_at(nearest["primitive_ids"][found]) - half
    middles = (corners + 0.5) @ volume.affine[:3, :3].T + volume.affine[:3, 3]
    # Evaluate inside the cell: gradients of degree 1 jump at its faces.
    gradients = volume.sample(x + 1e-9 * (middles - x), derivative=1)
    slopes = np.linalg.norm(gradients, axis=1)
    assert (np.abs(volume.sample(x) - surface.level) <= 1e-9 * edge * slopes).all()
    np.testing.assert_allclose(np.linalg.norm(points[found] - x, axis=1), nearest["distances"][found], rtol=1e-12)
    outward = -1.0 if surface.inside == "above" else 1.0
    np.testing.assert_allclose(nearest["primitive_normals"][found], outward * gradients / slopes[:, None], atol=1e-7)
    index = np.linalg.solve(volume.affine[:3, :3], (x - volume.affine[:3, 3]).T).T
    assert ((index >= corners - 1e-9) & (index <= corners + 1 + 1e-9)).all()
    assert (nearest["error_bounds"] >= 0).all()
    assert (nearest["error_bounds"] <= (1e-6 * edge if tolerance is None else tolerance)).all()
    return found


@pytest.mark.parametrize("degree", [2, 3])
def test_ball(rng, degree):
    surface, center = ball(7.0, degree=degree)
    points = random_points(rng, surface.volume, 1000)
    radii = np.linalg.norm(points - center, axis=1)
    points, radii = points[radii > 0.5], radii[radii > 0.5]
    nearest = surface.closest_points(points)
    assert check(surface, points, nearest).all()
    np.testing.assert_allclose(nearest["distances"], np.abs(radii - 7), atol=1e-6)
    away = (points - center) / radii[:, None]
    np.testing.assert_allclose(nearest["primitive_normals"], away, atol=1e-5)
    np.testing.assert_allclose(surface.signed_distance(points), radii - 7, atol=1e-6)


@pytest.mark.parametrize("direction", [np.eye(3), ROTATION, SHEAR], ids=["straight", "rotated", "sheared"])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_plane_in_any_grid(rng, degree, direction):
    spacing, origin = (1.0, 2.0, 0.5), (30.0, -20.0, 5.0)
    grid = world_grid(16, spacing, origin, direction)
    normal = np.array([0.3, -0.5, 0.8])
    middle = grid[8, 8, 8]
    volume = isospline.Volume(
        (grid - middle) @ normal, degree=degree, spacing=spacing, origin=origin, direction=direction, filter="none"
    )
    surface = isospline.Isosurface(volume, 0.0)
    unit = normal / np.linalg.norm(normal)
    # Points above and below an inner part of the plane, away from the volume's border.
    feet = rng.normal(size=(400, 3))
    feet = middle + 0.6 * (feet - np.outer(feet @ unit, unit))
    heights = rng.uniform(-5, 5, 400)
    points = feet + np.outer(heights, unit)
    nearest = surface.closest_points(points)
    assert check(surface, points, nearest).all()
    np.testing.assert_allclose(nearest["distances"], np.abs(heights), atol=2e-6)
    np.testing.assert_allclose(nearest["points"], feet, atol=1e-5)


def test_torus_of_a_field(rng):
    field = isospline.volumes.torus(0.6, 0.25)
    volume = field.volume(96, degree=3)
    surface = isospline.Isosurface(volume, field.level)
    points = rng.uniform(-1.2, 1.2, (800, 3))
    from_circle = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 0.6, points[:, 2])
    points, from_circle = points[from_circle > 0.02], from_circle[from_circle > 0.02]
    assert check(surface, points, surface.closest_points(points)).all()
    # The spline differs from the formula by little: 1 / 300 of a voxel.
    np.testing.assert_allclose(surface.signed_distance(points), from_circle - 0.25, atol=7e-5)


def dense_points(surface, refinement):
    """Points of the surface: sign changes along the edges of a fine grid, by Newton's method on `Volume.sample`."""
    volume = surface.volume
    lower, upper = volume.bounds
    counts = np.round((upper - lower) / volume.spacing * refinement).astype(int) + 1
    axes = [np.linspace(a, b, n) for a, b, n in zip(lower, upper, counts)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = volume.sample(grid) - surface.level
    starts = []
    for axis in range(3):
        a, b = (np.take(values, range(k, counts[axis] - 1 + k), axis) for k in (0, 1))
        p, q = (np.take(grid, range(k, counts[axis] - 1 + k), axis) for k in (0, 1))
        crossing = (a < 0) != (b < 0)
        part = (a / np.where(crossing, a - b, 1))[crossing][:, None]
        starts.append(p[crossing] + part * (q - p)[crossing])
    x = np.concatenate(starts)
    for _ in range(8):
        gradient = volume.sample(x, derivative=1)
        x = x - ((volume.sample(x) - surface.level) / (gradient**2).sum(1).clip(1e-6))[:, None] * gradient
    on_surface = np.abs(volume.sample(x) - surface.level) < 1e-10
    return x[on_surface & (x >= lower).all(1) & (x <= upper).all(1)]


@pytest.mark.sweep(2)
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_nothing_is_nearer_on_a_wild_surface(rng, degree):
    # The noise has sheets, handles and rims on the border of the volume; degree 1 has creases as well.
    volume = isospline.Volume(rng.normal(size=(6, 7, 8)), degree=degree, spacing=(1.0, 1.5, 0.7))
    surface = isospline.Isosurface(volume, 0.3)
    points = random_points(rng, volume, 400)
    nearest = surface.closest_points(points)
    assert check(surface, points, nearest).all()
    sampled = cKDTree(dense_points(surface, 12)).query(points)[0]
    assert (nearest["distances"] <= sampled + 1e-6).all()
    # The sampling is dense, so the bound is tight.
    assert np.median(sampled - nearest["distances"]) < 0.02 and (sampled - nearest["distances"]).max() < 0.3


def crossings_of_edges(surface, refinement):
    """Points of the surface by bisection of `Volume.sample` along the edges of a fine grid.

    Newton's method, as in `dense_points`, may end where f touches the level.
    """
    lower, upper = surface.volume.bounds
    counts = np.round((upper - lower) / surface.volume.spacing * refinement).astype(int) + 1
    axes = [np.linspace(a, b, n) for a, b, n in zip(lower, upper, counts)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    is_below = surface.volume.sample(grid) < surface.level
    ends = []
    for axis in range(3):
        first, second = (np.arange(step, counts[axis] - 1 + step) for step in (0, 1))
        changes = is_below.take(first, axis) != is_below.take(second, axis)
        one, other = grid.take(first, axis)[changes], grid.take(second, axis)[changes]
        is_one_below = is_below.take(first, axis)[changes][:, None]
        ends.append((np.where(is_one_below, one, other), np.where(is_one_below, other, one)))
    below, above = (np.concatenate(each) for each in zip(*ends))
    for _ in range(40):
        middle = (below + above) / 2
        is_below = (surface.volume.sample(middle) < surface.level)[:, None]
        below, above = np.where(is_below, middle, below), np.where(is_below, above, middle)
    return above


@pytest.mark.sweep(3)
@pytest.mark.slow
@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("largest", [4, 50])
def test_nothing_is_nearer_where_the_level_equals_samples(degree, largest):
    # The samples are coefficients, so f equals the level on whole edges, on faces and at isolated samples of degree 1.
    # With four values, nearly every cell has a corner at the level.
    for seed in range(2):
        rng = np.random.default_rng(seed)
        data = rng.integers(0, largest, (11, 11, 11)).astype(np.uint8)
        volume = isospline.Volume(data, degree=degree, spacing=(0.7, 0.9, 1.4), filter="none")
        surface = isospline.Isosurface(volume, largest // 2)
        points = random_points(rng, volume, 600, margin=0.0)
        nearest = surface.closest_points(points)
        # At ends of faces at the level, where no gradient is left, the search may end just above the tolerance, 0.7e-6.
        assert (nearest.error_bounds <= 1e-6).all() and (nearest.error_bounds > 0.7e-6).sum() <= 1
        least = nearest.distances - nearest.error_bounds - 1e-9
        # No answer to another question is nearer, nor the same question's answer within a limit.
        limits = (0.2, 0.5, 1.0)
        answers = [surface.closest_points(points, max_distance=limit) for limit in limits]
        for limit, answer in zip(limits, answers):
            assert (answer.distances >= least).all()
            assert (np.minimum(nearest.distances, limit) >= np.minimum(answer.distances, limit) - 1e-6).all()
        found = np.concatenate([each.points[np.isfinite(each.distances)] for each in (nearest, *answers)])
        assert (cKDTree(found).query(points)[0] >= least).all()
        assert (cKDTree(crossings_of_edges(surface, 3)).query(points)[0] >= least).all()


def test_a_sample_at_the_level_between_larger_ones_is_no_surface():
    # Zero counts as positive: f is nowhere below the level next to the sample in the middle, as rays find, too.
    data = np.full((9, 9, 9), 3)
    data[4, 4, 4] = 1
    data[0, 0, 0] = -2
    surface = isospline.Isosurface(isospline.Volume(data, degree=1), 1)
    assert isospline.Scene(surface).count_intersections([(4, 4, -1, 0, 0, 1)])[0] == 0
    nearest = surface.closest_points([(4.1, 4.2, 4.1), (4, 4, 4), (3.5, 4, 4)])
    assert (nearest.points < 1).all() and (nearest.error_bounds < 1e-6).all()


def least_value_near(data, point, reach):
    """The exact minimum of the trilinear model in a box about a point (x, y, z). In a cell it is at a corner."""
    ends = []
    for axis, center in enumerate(point):
        last = data.shape[2 - axis] - 1
        lower, upper = (Fraction(float(np.clip(center + d, 0, last))) for d in (-reach, reach))
        ends.append([lower, *(Fraction(k) for k in range(math.floor(lower) + 1, math.ceil(upper))), upper])

    def value(corner):
        cell = [min(math.floor(c), data.shape[2 - axis] - 2) for axis, c in enumerate(corner)]
        total = Fraction(0)
        for offset in itertools.product((0, 1), repeat=3):
            weight = math.prod(c - k if d else 1 + k - c for c, k, d in zip(corner, cell, offset, strict=True))
            total += weight * int(data[tuple(k + d for k, d in zip(cell, offset, strict=True))[::-1]])
        return total

    return min(value(corner) for corner in itertools.product(*ends))


def test_points_next_to_samples_at_the_level_are_on_the_surface(rng):
    """In each neighbourhood of a point of the surface there are values below the level."""
    checked = 0
    for seed in range(80):
        data = rng.integers(0, 3 if seed % 2 else 5, rng.integers(4, 12, 3))
        level = float(rng.integers(1, data.max() + 1))
        volume = isospline.Volume(data.astype(float), degree=1)
        surface = isospline.Isosurface(volume, level, inside=["above", "below"][seed // 2 % 2])
        samples = np.argwhere(data == level)[:, ::-1]
        shifts = rng.normal(size=(100, 3)) * rng.choice([0, 1e-3, 0.1, 0.5], (100, 1))
        nearest = surface.closest_points(samples[rng.integers(0, len(samples), 100)] + shifts)
        points = nearest.points[np.isfinite(nearest.distances)]
        # Values in double precision at some points nearby decide for most.
        near = np.clip(points[:, None] + rng.uniform(-0.01, 0.01, (1, 30, 3)), 0, np.array(data.shape[::-1]) - 1)
        values = scipy.ndimage.map_coordinates(data.astype(float), near[..., ::-1].reshape(-1, 3).T, order=1)
        for point in points[(values.reshape(near.shape[:2]) >= level).all(axis=1)]:
            assert least_value_near(data, point, 0.01) < level
            checked += 1
    assert checked > 100


def test_rim_of_a_clipped_ball(rng):
    height = 3.2
    clip = isospline.HalfSpace((0, 0, 12 + height), (0, 0, 1))
    surface, center = ball(7.0, clip=clip)
    points = random_points(rng, surface.volume, 300)
    nearest = surface.closest_points(points)
    assert check(surface, points, nearest).all()
    p = points - center
    radii = np.linalg.norm(p, axis=1)
    rim = np.sqrt(49 - height**2)
    on_cap = p[:, 2] * 7 / radii >= height
    expected = np.where(on_cap, np.abs(radii - 7), np.hypot(np.hypot(p[:, 0], p[:, 1]) - rim, p[:, 2] - height))
    assert 0.1 < on_cap.mean() < 0.9
    np.testing.assert_allclose(nearest["distances"], expected, atol=2e-6)
    assert (nearest["points"][:, 2] >= 12 + height - 1e-9).all()


def test_corners_of_cuts_and_of_the_volume(rng):
    # The plane z = 4.3 within the volume's box, and within a clip box: a rectangle.
    volume = isospline.Volume(np.broadcast_to(np.arange(10.0)[:, None, None], (10, 10, 10)), degree=1)
    points = rng.uniform(-5, 15, (300, 3))
    for minimum, maximum, clip in [(0, 9, None), (2.25, 6.6, isospline.Box((2.25,) * 3, (6.6,) * 3))]:
        surface = isospline.Isosurface(volume, 4.3, clip=clip)
        nearest = surface.closest_points(points)
        assert check(surface, points, nearest).all()
        expected = np.column_stack([points[:, :2].clip(minimum, maximum), np.full(300, 4.3)])
        np.testing.assert_allclose(nearest["points"], expected, atol=1e-5)
        np.testing.assert_allclose(nearest["distances"], np.linalg.norm(points - expected, axis=1), atol=1e-6)


def test_a_corner_where_the_gradient_vanishes_is_not_the_nearest_point():
    # Mirroring leaves no gradient at the corner. The search of the foot stopped there: all of its steps were short.
    data = [[[9, 3, 7], [5, 1, 7]], [[8, 2, 4], [6, 3, 5]], [[2, 5, 0], [7, 0, 6]], [[1, 3, 5], [8, 0, 2]]]
    data = np.array([*data, [[3, 5, 0], [3, 1, 5]]], float)
    volume = isospline.Volume(data, degree=3, direction=[(1, 0.5, 0), (0, 1, 0.5), (0.25, 0, 1)])
    surface = isospline.Isosurface(volume, 4.5)
    point = np.array((3.6478444401094867, 2.140926079200163, 6.4567367311197525))
    found = surface.sample_points(20000).points
    nearest = surface.closest_points(point)
    assert nearest.distances - nearest.error_bounds <= np.linalg.norm(found - point, axis=1).min()


def test_mask_cuts_cells_away(rng):
    values = np.broadcast_to(np.arange(10.0)[:, None, None], (10, 10, 10))
    mask = np.ones(values.shape, bool)
    mask[:, :, 6:] = False
    surface = isospline.Isosurface(isospline.Volume(values, filter="none"), 4.3, mask=mask)
    points = rng.uniform(-5, 15, (300, 3))
    expected = np.column_stack([points[:, 0].clip(-0.5, 5.5), points[:, 1].clip(-0.5, 9.5), np.full(300, 4.3)])
    nearest = surface.closest_points(points)
    assert check(surface, points, nearest).all()
    np.testing.assert_allclose(nearest["points"], expected, atol=1e-5)


def test_the_bound_holds_at_equidistant_points():
    surface, center = ball(7.0)
    nearest = surface.closest_points(center)
    assert nearest["distances"].shape == () and nearest["points"].shape == (3,)
    assert abs(nearest["distances"] - 7) < 1e-9 and 1e-6 < nearest["error_bounds"] < 0.1
    with pytest.warns(UserWarning, match="1 of 2 distances may be too large by more than the tolerance, 1e-06"):
        np.testing.assert_allclose(surface.signed_distance([center, center + (0, 0, 9)]), [-7, 2], atol=1e-6)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        surface.signed_distance(center, tolerance=0.1)


def test_points_on_the_surface(rng):
    surface, center = ball(7.0)
    directions = rng.normal(size=(200, 3))
    on_surface = center + 7 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    for offset in (0.0, 1e-9, 1e-4):
        points = on_surface + offset * (on_surface - center) / 7
        nearest = surface.closest_points(points)
        check(surface, points, nearest)
        np.testing.assert_allclose(nearest["distances"], offset, atol=2e-6)


def test_max_distance(rng):
    surface, center = ball(7.0)
    points = random_points(rng, surface.volume, 500, margin=-0.1)
    radii = np.linalg.norm(points - center, axis=1)
    expected = np.abs(radii - 7) <= 1.5
    nearest = surface.closest_points(points, max_distance=1.5)
    found = check(surface, points, nearest)
    np.testing.assert_array_equal(found, expected)
    assert 0.1 < found.mean() < 0.9 and (radii < 5).any()
    np.testing.assert_array_equal(nearest["primitive_ids"] == isospline.INVALID_PRIMITIVE_ID, ~found)
    assert np.isnan(nearest["points"][~found]).all() and (nearest["primitive_normals"][~found] == 0).all()
    signed = surface.signed_distance(points, max_distance=1.5)
    np.testing.assert_array_equal(np.isinf(signed), ~found)
    np.testing.assert_array_equal(signed < 0, radii < 7)


def test_tolerance_is_kept(rng):
    surface, center = ball(7.0)
    points = random_points(rng, surface.volume, 300)
    expected = np.abs(np.linalg.norm(points - center, axis=1) - 7)
    for tolerance in (1e-2, 1e-9):
        nearest = surface.closest_points(points, tolerance=tolerance)
        check(surface, points, nearest, tolerance)
        assert (nearest["distances"] >= expected - 1e-11).all()
        assert (nearest["distances"] - nearest["error_bounds"] <= expected + 1e-11).all()


def test_far_points():
    surface, center = ball(7.0)
    for distance in (1e3, 1e6, 1e9):
        nearest = surface.closest_points(center + (0, distance, 0))
        np.testing.assert_allclose(nearest["distances"], distance - 7, rtol=1e-15, atol=2e-6)


def test_another_level_and_no_surface():
    surface, center = ball(7.0)
    point = center + (9, 0, 0)
    assert abs(surface.closest_points(point)["distances"] - 2) < 1e-6
    surface.level = 49 - 25
    assert abs(surface.closest_points(point)["distances"] - 4) < 1e-6
    with pytest.warns(UserWarning, match="there is no surface"):
        surface.level = 1e6
    nearest = surface.closest_points(point)
    assert np.isinf(nearest["distances"]) and nearest["error_bounds"] == 0
    assert surface.signed_distance(np.zeros((0, 3))).shape == (0,)


def test_same_answers_for_any_number_of_threads(rng):
    volume = isospline.Volume(rng.normal(size=(6, 7, 8)))
    surface = isospline.Isosurface(volume, 0.3)
    points = random_points(rng, volume, 200)
    answers = []
    try:
        for count in (1, 4):
            isospline.set_thread_count(count)
            answers.append(surface.closest_points(points))
    finally:
        isospline.set_thread_count(0)
    for name in answers[0]:
        np.testing.assert_array_equal(answers[0][name], answers[1][name])


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="needs POSIX signals")
def test_a_signal_stops_it():
    class Stop(Exception):
        pass

    def stop(*_):
        raise Stop

    surface, center = ball(7.0)
    points = np.tile(center, (100000, 1))  # the slowest there are
    before = signal.signal(signal.SIGALRM, stop)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        start = time.monotonic()
        with pytest.raises(Stop):
            surface.closest_points(points)
        assert time.monotonic() - start < 5
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def test_bad_input():
    surface, _ = ball(7.0)
    for query in (surface.closest_points, surface.signed_distance):
        with pytest.raises(ValueError, match=r"points: expected shape \(..., 3\)"):
            query(np.zeros((3, 2)))
        with pytest.raises(ValueError, match=r"points: expected finite numbers"):
            query([(0, 0, 0), (0, np.inf, 0)])
        with pytest.raises(ValueError, match="points: expected coordinates of at most 1e100"):
            query((0, 1e101, 0))
        with pytest.raises(ValueError, match="max_distance: expected a number of at least 0"):
            query((0, 0, 0), max_distance=-1)
        with pytest.raises(ValueError, match="tolerance: expected a finite number above 0"):
            query((0, 0, 0), tolerance=0)


@pytest.mark.parametrize("radius", [30, 45])
def test_points_near_the_centre_of_a_large_ball_have_a_nearest_point(radius):
    """All parts of the surface are about equally near: more cells are nearer than the first box than are looked at."""
    middle = radius + 4
    z, y, x = np.mgrid[: 2 * middle + 1, : 2 * middle + 1, : 2 * middle + 1] - middle
    ball = isospline.Isosurface(isospline.Volume(np.sqrt(x**2 + y**2 + z**2)), radius, inside="below")
    offsets = np.array([(0, 0, 0), (0.5, 0, 0), (1, 1, 0.5), (4, 0, 3)])
    expected = radius - np.linalg.norm(offsets, axis=1)
    for found in (ball.closest_points(offsets + middle), isospline.Scene(ball).closest_points(offsets + middle)):
        np.testing.assert_allclose(found.distances, expected, atol=1e-3)
        assert (found.error_bounds < 0.05).all()
    np.testing.assert_allclose(isospline.Scene(ball).signed_distance(offsets + middle), -expected, atol=1e-3)
