"""Volume, area and curvature of surfaces: closed forms, and the documented orders of convergence."""

import json
import math

import numpy as np
import pytest

import isospline
from isospline.cli import main as cli

ROTATION = np.array([(0.8, -0.6, 0.0), (0.48, 0.64, -0.6), (0.36, 0.48, 0.8)])
SHEAR = np.array([(1.0, 0.3, 0.0), (0.0, 1.0, -0.2), (0.0, 0.0, 1.0)])
CENTER = np.array([12.25, 11.5, 12.125])


def ball(radius=7.0, degree=2, size=25, sign=1, **options):
    """f = R^2 - |x - c|^2 without error, in index space; in the world, an ellipsoid if the grid is not cubic."""
    z, y, x = np.mgrid[0:size, 0:size, 0:size].astype(float)
    squares = (x - CENTER[0]) ** 2 + (y - CENTER[1]) ** 2 + (z - CENTER[2]) ** 2
    values = radius**2 - squares + 3 * {2: 0.25, 3: 1 / 3}[degree]
    grid = {name: options.pop(name) for name in ("spacing", "origin", "direction") if name in options}
    volume = isospline.Volume(sign * values, degree=degree, filter="none", **grid)
    return isospline.Isosurface(volume, 0.0, **options)


def assert_within(measurement, expected, relative):
    assert measurement.error >= 0
    assert abs(measurement.value - expected) <= relative * abs(expected)
    # float32 coefficients and rounding aside, the stated error holds.
    assert abs(measurement.value - expected) <= measurement.error + 1e-9 * abs(expected)


@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("sign, inside", [(1, "above"), (-1, "below")])
def test_ball(degree, sign, inside):
    surface = ball(degree=degree, sign=sign, inside=inside)
    assert_within(surface.enclosed_volume(order=6), 4 / 3 * math.pi * 343, 1e-8)
    assert_within(surface.area(order=6), 4 * math.pi * 49, 1e-8)
    assert_within(surface.mean_curvature(order=6), 4 * math.pi * 7, 1e-8)
    assert_within(surface.gaussian_curvature(order=6), 4 * math.pi, 1e-8)


@pytest.mark.parametrize("direction", [ROTATION, ROTATION * [1, 1, -1]], ids=["rotated", "mirrored"])
def test_rotated_and_mirrored_grids(direction):
    surface = ball(spacing=(0.5, 0.5, 0.5), direction=direction, origin=(3, 4, 5))
    assert_within(surface.enclosed_volume(order=6), 4 / 3 * math.pi * 3.5**3, 1e-8)
    assert_within(surface.area(order=6), 4 * math.pi * 3.5**2, 1e-8)
    assert_within(surface.mean_curvature(order=6), 4 * math.pi * 3.5, 1e-8)


def test_ellipsoid_of_an_oblique_grid():
    spacing = np.array([1.0, 2.0, 0.5])
    surface = ball(spacing=spacing, direction=SHEAR)
    linear = SHEAR * spacing
    assert_within(surface.enclosed_volume(order=6), 4 / 3 * math.pi * 343 * abs(np.linalg.det(linear)), 1e-8)
    assert_within(surface.gaussian_curvature(order=8), 4 * math.pi, 1e-6)
    # Area and mean curvature of the image of a sphere, by a product rule over its parameters.
    nodes, weights = np.polynomial.legendre.leggauss(60)
    phi = np.arange(120) * (2 * math.pi / 120)
    ring = np.sqrt(1 - nodes**2)
    unit = np.stack([np.outer(ring, np.cos(phi)), np.outer(ring, np.sin(phi)), np.outer(nodes, np.ones(120))], axis=-1)
    stretch = np.linalg.norm(unit @ np.linalg.inv(linear), axis=-1) * abs(np.linalg.det(linear))
    area = 49 * (stretch * weights[:, None]).sum() * (2 * math.pi / 120)
    assert_within(surface.area(order=8), area, 1e-6)


@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("capped", [False, True])
def test_cuts_through_the_centre(degree, capped):
    volume, area, disc = 2 / 3 * math.pi * 343, 2 * math.pi * 49, math.pi * 49
    oblique = ball(degree=degree, clip=isospline.HalfSpace(CENTER, (1, 2, 3)), capped=capped)
    assert_within(oblique.enclosed_volume(), volume, 1e-7)
    assert_within(oblique.area(), area + capped * disc, 1e-7)
    lower, upper = ball(degree=degree).volume.bounds
    box = isospline.Box((CENTER[0], CENTER[1], lower[2]), upper)
    quarter = ball(degree=degree, clip=box, capped=capped)
    assert_within(quarter.enclosed_volume(), volume / 2, 1e-7)
    assert_within(quarter.area(), area / 2 + capped * disc, 1e-7)


def test_caps_close_the_solid_at_the_border_of_the_volume():
    # Everything except a ball is solid. With the volume's own box as clip, the box's faces are caps.
    surface = ball(inside="below", clip=isospline.Box(*ball().volume.bounds), capped=True)
    assert_within(surface.enclosed_volume(), 25**3 - 4 / 3 * math.pi * 343, 1e-8)
    assert_within(surface.area(order=6), 6 * 25**2 + 4 * math.pi * 49, 1e-8)


def test_mask_cuts_cells_away():
    mask = np.ones((25, 25, 25), bool)
    mask[:, :, :12] = False  # cells up to x = 11.5
    surface = ball(mask=mask)
    height = 7 - (11.5 - CENTER[0])
    assert_within(surface.enclosed_volume(order=6), math.pi * height**2 * (21 - height) / 3, 1e-8)
    assert_within(surface.area(order=6), 2 * math.pi * 7 * height, 1e-8)


@pytest.mark.sweep(3)
def test_stated_errors_hold_and_fall_with_the_order():
    surface = ball()
    for measure, expected in ((surface.enclosed_volume, 4 / 3 * math.pi * 343), (surface.area, 4 * math.pi * 49)):
        errors = []
        for order in (2, 3, 4, 6):
            found = measure(order=order)
            errors.append(abs(found.value - expected))
            assert errors[-1] <= found.error
        assert errors[1] < errors[0] / 20 and errors[2] < errors[1] / 20


@pytest.mark.sweep(2)
@pytest.mark.slow
@pytest.mark.parametrize("degree, order_of_volume", [(1, 2), (2, 4), (3, 4)])
def test_sampled_torus_converges(degree, order_of_volume):
    field = isospline.volumes.torus(0.6, 0.25)
    errors = []
    for size in (12, 24, 48):
        volume = isospline.Volume(field.values(size, np.float64), **field.grid(size), degree=degree)
        surface = isospline.Isosurface(volume, field.level)
        volume_error = abs(surface.enclosed_volume(order=4).value / (2 * math.pi**2 * 0.6 * 0.25**2) - 1)
        area_error = abs(surface.area(order=4).value / (4 * math.pi**2 * 0.6 * 0.25) - 1)
        errors.append((volume_error, area_error))
    rates = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert (rates[-1] > order_of_volume - 0.5).all()
    if degree > 1:
        assert abs(surface.gaussian_curvature().value) < 1e-3  # a handle: 2 pi (2 - 2)


def test_gyroid_halves_the_cube():
    field = isospline.volumes.gyroid(2)
    volume = field.volume(40, boundary="periodic")
    surface = isospline.Isosurface(volume, field.level)
    assert abs(surface.enclosed_volume(tolerance=1e-6).value - 4) < 1e-5
    # Two periods along each edge: 8 cells of Euler characteristic -8 of a surface that is periodic.
    assert abs(surface.gaussian_curvature().value / (2 * math.pi) + 64) < 0.05
    # The level set of the nodal approximation, 3.0915 in units of the squared period (of length 1).
    assert abs(surface.area().value / 8 - 3.0915) < 2e-3


def test_planes_of_degree_1_on_faces_of_cells():
    values = np.broadcast_to(np.arange(10.0)[:, None, None], (10, 10, 10))
    for level in (4.0, 4.3):
        for inside, thickness in (("above", 9 - level), ("below", level)):
            surface = isospline.Isosurface(isospline.Volume(values, degree=1), level, inside=inside)
            assert_within(surface.enclosed_volume(), 81 * thickness, 1e-7)
            assert_within(surface.area(), 81, 1e-7)


@pytest.mark.slow
def test_same_for_any_number_of_threads(rng):
    volume = isospline.Volume(rng.normal(size=(11, 12, 13)))
    surface = isospline.Isosurface(volume, 0.3)
    answers = set()
    try:
        for count in (1, 4):
            isospline.set_thread_count(count)
            answers.add((surface.enclosed_volume().value, surface.area(tolerance=1e-3).error))
    finally:
        isospline.set_thread_count(0)
    assert len(answers) == 1


def test_noise_against_counting(rng):
    volume = isospline.Volume(rng.normal(size=(8, 9, 10)))
    surface = isospline.Isosurface(volume, 0.3)
    points = rng.uniform(*volume.bounds, (200000, 3))
    share = surface.contains(points).mean()
    total = 720
    assert abs(surface.enclosed_volume().value - share * total) < 5 * total * math.sqrt(share * (1 - share) / 2e5)


def test_bad_input():
    surface = ball()
    for order in (1, 11):
        with pytest.raises(ValueError, match="order: expected 2 to 10"):
            surface.area(order=order)
    flat = isospline.Isosurface(isospline.Volume(np.arange(64.0).reshape(4, 4, 4), degree=1), 31.3)
    with pytest.raises(ValueError, match="degree: expected 2 or 3 of a volume whose surfaces have curvatures"):
        flat.mean_curvature()
    with pytest.raises(isospline.Cancelled):
        surface.area(progress=lambda fraction: False)


def test_command_line(tmp_path, capsys):
    field = isospline.volumes.sphere(0.7)
    path = tmp_path / "ball.npy"
    np.save(path, field.values(32))
    assert cli.main(["measure", str(path), "--level", "0", "--spacing", "0.0625,0.0625,0.0625", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert abs(found["enclosed_volume"]["value"] / (4 / 3 * math.pi * 0.7**3) - 1) < 1e-4
    assert abs(found["gaussian_curvature"]["value"] / (4 * math.pi) - 1) < 1e-3
    assert cli.main(["measure", str(path), "--level", "0"]) == 0
    table = capsys.readouterr().out
    assert "enclosed volume" in table and "+-" in table


def ellipsoid(degree, center, weights, square, spacing):
    """An ellipsoid that the model represents exactly, and its semi-axes."""
    k = np.arange(24)
    x, y, z = (weight * (k - at) ** 2 for weight, at in zip(weights, center))
    values = z[:, None, None] + y[None, :, None] + x[None, None, :]
    volume = isospline.Volume(values.astype(np.float32), degree=degree, filter="none", spacing=spacing)
    level = square + {2: 0.25, 3: 1 / 3}[degree] * sum(weights)
    return isospline.Isosurface(volume, level, inside="below"), np.sqrt(square / np.array(weights)) * spacing


def errors_of_ellipsoid(surface, axes, order):
    """The true errors, by closed forms, and the stated ones."""
    special = pytest.importorskip("scipy.special")
    exact = {
        "enclosed_volume": 4 / 3 * math.pi * axes.prod(),
        "area": 4 * math.pi * axes.prod() * special.elliprg(*axes**-2.0),
        "mean_curvature": 4 * math.pi * special.elliprg(*axes**2.0),
        "gaussian_curvature": 4 * math.pi,
    }
    found = {name: getattr(surface, name)(order=order) for name in exact}
    return {name: (abs(each.value - exact[name]), each.error + 1e-12 * exact[name]) for name, each in found.items()}


@pytest.mark.parametrize(
    "body, order",
    [
        ((2, (11.125, 12, 10.875), (6.0, 1.0, 6.0), 51.252271492648696, (2.23213117, 1.23621508, 0.29568383)), 4),
        ((3, (11.0, 11.625, 12.0), (4.0, 3.0, 4.0), 29.45732733154571, (0.31210115, 2.24240168, 0.23706032)), 10),
        # The differences from rules with two nodes less are 5.2 and 2.5 times too small here.
        ((2, (12.75, 10.875, 11.875), (1.0, 6.0, 3.0), 6.430152148929443, (0.32198107, 0.25767621, 2.2242244)), 5),
        ((2, (12.5, 12.75, 10.75), (2.0, 1.0, 4.0), 15.473860419168812, (0.40081746, 2.20814110, 0.29977968)), 10),
    ],
)
def test_stated_errors_hold_for_flat_and_long_bodies(body, order):
    for true, stated in errors_of_ellipsoid(*ellipsoid(*body), order).values():
        assert true <= stated


@pytest.mark.sweep(3)
@pytest.mark.slow
@pytest.mark.parametrize("order", range(2, 11))
def test_stated_errors_hold_for_ellipsoids_of_any_proportions(order):
    rng = np.random.default_rng(order)
    for trial in range(8):
        weights = rng.choice([1.0, 2.0, 3.0, 4.0, 6.0], 3)
        square, spacing = rng.uniform(6, 50) * weights.min(), np.exp(rng.uniform(-1.5, 1, 3))
        body = ellipsoid(2 + trial % 2, rng.integers(80, 104, 3) / 8, weights, square, spacing)
        for true, stated in errors_of_ellipsoid(*body, order).values():
            assert true <= stated
