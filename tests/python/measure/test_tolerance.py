"""Integrals within a tolerance: closed forms, and quadrature in every cell where there is none."""

import math

import numpy as np
import pytest

import isospline

TOLERANCES = [1e-2, 1e-3, 1e-4]
NAMES = ("enclosed_volume", "area", "mean_curvature", "gaussian_curvature")


def assert_bounded(found, expected, tolerance, error=0.0):
    """The true error, but for one of what is expected, is at most the stated one, and that within the tolerance."""
    assert abs(found.value - expected) <= found.error + error + 2e-7 * abs(expected)
    assert found.error <= tolerance * abs(expected) * 1.01


def ellipsoid(rng, degree):
    """An ellipsoid that the model represents exactly, in a grid with different spacings, and its semi-axes."""
    size = 32
    weights, spacing = np.exp(rng.uniform(0, 1, 3)), np.exp(rng.uniform(-1, 1, 3))
    squares = [w * (np.arange(size) - c) ** 2 for w, c in zip(weights, size / 2 - 0.5 + rng.uniform(-1, 1, 3))]
    values = squares[2][:, None, None] + squares[1][None, :, None] + squares[0][None, None, :]
    square = 12**2 * weights.min() * rng.uniform(0.6, 1)
    volume = isospline.Volume(values, degree=degree, filter="none", spacing=spacing)
    level = square + {2: 0.25, 3: 1 / 3}[degree] * sum(weights)
    return isospline.Isosurface(volume, level, inside="below"), np.sqrt(square / weights) * spacing


@pytest.mark.sweep(3)
@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_ellipsoids(degree, tolerance):
    special = pytest.importorskip("scipy.special")
    rng = np.random.default_rng(degree)
    surface, axes = ellipsoid(rng, degree)
    exact = (
        4 / 3 * math.pi * axes.prod(),
        4 * math.pi * axes.prod() * special.elliprg(*axes**-2.0),
        4 * math.pi * special.elliprg(*axes**2.0),
        4 * math.pi,
    )
    for name, expected in zip(NAMES, exact):
        assert_bounded(getattr(surface, name)(tolerance=tolerance), expected, tolerance)


def test_errors_have_no_part_in_common_where_surfaces_pass_through_samples():
    """Whole numbers at a whole level: parts of the surface are alike around many samples.

    Stated errors are at least four standard deviations, so the mean of 12 errors is within 0.4 stated ones but for one
    case in a million.
    """
    ndimage = pytest.importorskip("scipy.ndimage")
    parts = []
    for seed in range(12):
        samples = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=(16,) * 3), 1.5)
        surface = isospline.Isosurface(isospline.Volume(np.round(3 * samples / samples.std())), 2.0)
        exact, found = surface.area(order=5), surface.area(tolerance=1e-2)
        assert_bounded(found, exact.value, 1e-2, exact.error)
        assert found != surface.area(order=4), "lines were not used"
        parts.append((found.value - exact.value) / found.error)
    assert abs(np.mean(parts)) < 0.4


@pytest.mark.sweep(1)
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_balls_across_many_bricks(degree):
    """A ball across about 900 bricks, which degrees 2 and 3 represent exactly, and degree 1 by chords.

    For degree 1, quadrature in every cell is the other method.
    """
    z, y, x = np.ogrid[:128, :128, :128]
    square, radius = (x - 64.2) ** 2 + (y - 63.1) ** 2 + (z - 63.7) ** 2, 57.0
    values, level = (np.sqrt(square), radius) if degree == 1 else (square, radius**2 + {2: 0.75, 3: 1}[degree])
    volume = isospline.Volume(values, degree=degree, filter="none")
    surface = isospline.Isosurface(volume, level, inside="below")
    exact = (4 / 3 * math.pi * radius**3, 4 * math.pi * radius**2)
    if degree == 1:
        by_chords = tuple(getattr(surface, name)(order=6).value for name in NAMES[:2])
        np.testing.assert_allclose(by_chords, exact, rtol=2e-4)
        exact = by_chords
    for tolerance in (1e-3, 1e-4) if degree == 3 else (1e-3, 1e-4, 1e-5):
        for name, expected in zip(NAMES, exact):
            assert_bounded(getattr(surface, name)(tolerance=tolerance), expected, tolerance)


@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_torus(tolerance):
    """The model differs from the torus by less than the smallest stated error."""
    field = isospline.volumes.torus(0.6, 0.25)
    surface = isospline.Isosurface(field.volume(64, degree=3), field.level)
    model = 1e-5
    assert_bounded(surface.enclosed_volume(tolerance=tolerance), 2 * math.pi**2 * 0.6 * 0.25**2, tolerance, model)
    assert_bounded(surface.area(tolerance=tolerance), 4 * math.pi**2 * 0.6 * 0.25, tolerance, 10 * model)


def rough(degree, size=12, seed=0):
    ndimage = pytest.importorskip("scipy.ndimage")
    samples = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=(size,) * 3), 1.0)
    return isospline.Volume(samples / samples.std(), degree=degree, spacing=(0.5, 1, 2))


@pytest.mark.sweep(3)
@pytest.mark.slow
@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("cut", ["open", "closed", "clipped", "capped"])
def test_rough_surfaces_have_the_integrals_of_quadrature_in_every_cell(degree, cut):
    volume = rough(degree)
    clip = isospline.HalfSpace(np.mean(volume.bounds, axis=0), (1, 2, 3))
    options = {
        "open": {},
        "closed": {"closed": True},
        "clipped": {"clip": clip},
        "capped": {"clip": clip, "capped": True},
    }
    surface = isospline.Isosurface(volume, 0.4, **options[cut])
    for name in NAMES[:2]:
        exact = getattr(surface, name)(order=5)
        for tolerance in TOLERANCES[:2]:
            assert_bounded(getattr(surface, name)(tolerance=tolerance), exact.value, tolerance, exact.error)


def test_planes_along_which_all_cells_are_alike():
    """All cells are cut in the same way, so what their errors have in common does not cancel."""
    z, y, x = np.mgrid[0:40, 0:40, 0:40].astype(float)
    for degree, slope in ((1, (1, 0.25)), (2, (0.5, 1)), (3, (1, 1))):
        f = z - 20.3 + slope[0] * (x - 20) + slope[1] * (y - 19.6)
        surface = isospline.Isosurface(isospline.Volume(f, degree=degree, filter="none"), 0.0)
        for name in NAMES[:2]:
            exact = getattr(surface, name)(order=4)
            for tolerance in TOLERANCES:
                assert_bounded(getattr(surface, name)(tolerance=tolerance), exact.value, tolerance, exact.error)


def test_each_component_is_within_the_tolerance():
    """Four balls that the model represents exactly but for where their fields meet: the smallest has 40 cells."""
    size, balls = 64, [((20, 21, 20), 14.0), ((48, 16, 17), 9.0), ((48, 46, 44), 6.0), ((16, 48, 46), 2.5)]
    z, y, x = np.mgrid[0:size, 0:size, 0:size].astype(float)
    squares = [r**2 - (x - a) ** 2 - (y - b) ** 2 - (z - c) ** 2 + 0.75 for (a, b, c), r in balls]
    surface = isospline.Isosurface(isospline.Volume(np.max(squares, axis=0), degree=2, filter="none"), 0.0)
    radii = np.array([r for _, r in balls])
    for tolerance in TOLERANCES:
        found = surface.components(measured=True, tolerance=tolerance)
        volumes, areas = 4 / 3 * math.pi * radii**3, 4 * math.pi * radii**2
        assert np.all(abs(found.enclosed_volumes - volumes) <= found.volume_errors + 2e-7 * volumes)
        assert np.all(abs(found.areas - areas) <= found.area_errors + 2e-7 * areas)
        assert np.all(found.volume_errors <= tolerance * volumes * 1.01)
        assert np.all(found.area_errors <= tolerance * areas * 1.01)


def test_the_default_is_a_tolerance_of_1e_4():
    surface, _ = ellipsoid(np.random.default_rng(5), 2)
    assert surface.area() == surface.area(tolerance=1e-4)
    assert surface.area() != surface.area(tolerance=1e-2)
    found = surface.components(measured=True)
    assert found.areas == surface.components(measured=True, tolerance=1e-4).areas


def test_same_for_any_number_of_threads():
    surfaces = [isospline.Isosurface(rough(1, 30), 0.4), *(ellipsoid(np.random.default_rng(6), d)[0] for d in (2, 3))]
    answers = set()
    try:
        for count in (1, 2, 5):
            isospline.set_thread_count(count)
            for surface in surfaces:
                for tolerance in TOLERANCES[1:]:
                    found = [surface.enclosed_volume(tolerance=tolerance), surface.area(tolerance=tolerance)]
                    answers.add((tolerance, *(number for each in found for number in (each.value, each.error))))
    finally:
        isospline.set_thread_count(0)
    assert len(answers) == 2 * len(surfaces)


def test_progress_and_cancelling():
    surface = isospline.Isosurface(rough(2), 0.4)
    seen = []
    surface.area(tolerance=1e-4, progress=seen.append)
    assert seen == sorted(seen) and seen[0] >= 0 and seen[-1] <= 1
    for limit in (0.0, 0.4):
        with pytest.raises(isospline.Cancelled):
            surface.area(tolerance=1e-4, progress=lambda done, limit=limit: done < limit)


def test_tolerances_that_no_error_reaches_are_none():
    field = np.sqrt(sum(grid**2 for grid in np.mgrid[-8:9, -8:9, -8:9]))
    ball = isospline.Isosurface(isospline.Volume(field), 5.0, inside="below")
    for measure in (ball.enclosed_volume, ball.area):
        huge, known = measure(tolerance=1e308), measure()
        assert math.isfinite(huge.error) and abs(huge - known) <= huge.error + known.error
        with pytest.raises(ValueError, match="tolerance: expected a positive number that is finite, got inf"):
            measure(tolerance=math.inf)


def test_bad_input():
    surface = isospline.Isosurface(rough(2, 8), 0.4)
    for tolerance in (0, -1e-3, math.nan):
        with pytest.raises(ValueError, match="tolerance: expected a positive number"):
            surface.area(tolerance=tolerance)
        with pytest.raises(ValueError, match="tolerance: expected a positive number"):
            surface.components(measured=True, tolerance=tolerance)
    with pytest.raises(ValueError, match="order: expected None with a tolerance"):
        surface.enclosed_volume(tolerance=1e-3, order=4)


@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("seed", [0, 3])
def test_blobs_of_a_voxel_have_the_area_of_fine_meshes(degree, seed):
    # Parts of the surface are nearly parallel to all axes beside the planes where cells are halved.
    measure = pytest.importorskip("skimage.measure")
    samples = 1e-3 * np.random.default_rng(seed).normal(size=(9, 9, 9))
    samples[4, 4, 4] = 1
    volume = isospline.Volume(samples, degree=degree)

    def area_of_mesh(step):
        places = np.arange(2.5, 5.5 + step / 2, step)
        points = np.stack(np.meshgrid(places, places, places, indexing="ij"), -1)
        vertices, faces, _, _ = measure.marching_cubes(volume.sample(points), 0.7, spacing=(step,) * 3)
        return measure.mesh_surface_area(vertices, faces)

    expected = (4 * area_of_mesh(1 / 40) - area_of_mesh(1 / 20)) / 3  # the error falls with the square of the step
    blob = isospline.Isosurface(volume, 0.7, largest=1)
    for order in (4, 10):
        found = blob.area(order=order)
        assert abs(found.value - expected) < found.error + 1e-4 * expected
        assert found.error < 0.01 * expected


@pytest.mark.parametrize("place", [(8, 19, 21), (8, 18, 21), (7, 20, 20)])
def test_errors_of_lines_know_of_the_only_rough_part(place):
    # Lines are exact where the surface is flat, and few of them meet the bump.
    samples = np.broadcast_to(np.arange(33.0)[:, None, None] - 16.3, (33, 33, 33)).copy()
    samples[place] = 3
    surface = isospline.Isosurface(samples, 0.0)
    for found, expected in (
        (surface.area(tolerance=1e-5), surface.area(order=10)),
        (surface.enclosed_volume(), surface.enclosed_volume(order=6)),
    ):
        assert abs(found.value - expected.value) < found.error + expected.error
