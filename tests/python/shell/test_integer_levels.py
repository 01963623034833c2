"""Levels that equal samples, of volumes of few integers: all queries agree that zero counts as above the level.

The samples are coefficients (`filter="none"`), so f equals the level on plateaus, faces, edges and at isolated points.
"""

import numpy as np
import pytest
from scipy import ndimage

import isospline

pytestmark = pytest.mark.filterwarnings("ignore:level .* (has an empty shell|is out of the data's range)")

CASES = [(degree, largest) for degree in (1, 2, 3) for largest in (2, 4, 50)]


def integers(seed, largest, *, smooth, shape=(7, 8, 9)):
    """Random integers in [0, largest), or smooth ones with plateaus of the same number; in the order z, y, x."""
    rng = np.random.default_rng(seed)
    data = rng.integers(0, largest, shape)
    if smooth:
        field = ndimage.gaussian_filter(rng.normal(size=shape), 1.5)
        data = np.floor((field - field.min()) / np.ptp(field) * (largest - 1e-3)).astype(int)
    return data.astype(np.float32)


def levels(largest):
    return sorted({0, 1, largest // 2, largest - 1})


def surfaces(degree, largest, *, inside=("above", "below"), **options):
    for smooth in (False, True):
        data = integers(int(smooth), largest, smooth=smooth)
        volume = isospline.Volume(data, degree=degree, filter="none", spacing=(0.7, 0.9, 1.4))
        for level in levels(largest):
            for side in inside:
                yield isospline.Isosurface(volume, level, inside=side, **options), data


def is_in_plateau(surface, data, points):
    """Whether all coefficients of a point's cell equal the level, and the point is not on the border of the cell."""
    degree = surface.volume.degree
    padded = np.pad(data.transpose(), degree // 2, mode="reflect")
    windows = np.lib.stride_tricks.sliding_window_view(padded, (degree + 1,) * 3)
    is_plateau = (windows == surface.level).all(axis=(3, 4, 5))
    lattice = (points - surface.volume.bounds[0]) / surface.volume.spacing
    cell = np.clip(lattice.astype(int), 0, np.array(is_plateau.shape) - 1)
    near_face = (np.abs(lattice - np.round(lattice)) < 1e-6).any(axis=-1)
    return is_plateau[tuple(cell.T)] & ~near_face


def is_solid(surface, data, points):
    """Whether points are in the solid, by `Volume.sample`; and whether they are far from the rounding of its border."""
    value = surface.volume.sample(points) - surface.level
    plateau = is_in_plateau(surface, data, points)
    lower, upper = surface.volume.bounds
    in_volume = ((points > lower + 1e-6) & (points < upper - 1e-6)).all(axis=-1)
    return ((value >= 0) | plateau) == (surface.inside == "above"), in_volume & ((np.abs(value) > 1e-5) | plateau)


def random_points(surface, count, rng):
    lower, upper = surface.volume.bounds
    return rng.uniform(lower, upper, (count, 3))


@pytest.mark.parametrize("degree, largest", CASES)
def test_contains_is_the_sign_of_the_samples(rng, degree, largest):
    plateau = 0
    for surface, data in surfaces(degree, largest):
        points = random_points(surface, 2000, rng)
        # Samples, faces and edges, within the volume.
        lower, upper = surface.volume.bounds
        on_grid = lower + np.round(2 * (points[:500] - lower) / surface.volume.spacing) / 2 * surface.volume.spacing
        points = np.concatenate([points, np.clip(on_grid, lower, upper)])
        expected, is_sure = is_solid(surface, data, points)
        assert np.array_equal(surface.contains(points)[is_sure], expected[is_sure])
        plateau += np.count_nonzero(is_sure & is_in_plateau(surface, data, points))
    assert largest == 50 or plateau > 50


@pytest.mark.parametrize("degree, largest", CASES)
def test_the_number_of_crossings_tells_the_side(rng, degree, largest):
    """From a point of a closed solid, each ray leaves it once more often than it enters it."""
    for surface, data in surfaces(degree, largest, closed=True):
        points = random_points(surface, 1000, rng)
        directions = rng.normal(size=points.shape)
        crossings = isospline.Scene(surface).count_intersections(np.concatenate([points, directions], axis=1))
        expected, is_sure = is_solid(surface, data, points)
        assert np.array_equal(crossings[is_sure] % 2 == 1, expected[is_sure])


@pytest.mark.slow
@pytest.mark.sweep(3)
@pytest.mark.parametrize("degree, largest", CASES)
def test_the_solids_above_and_below_fill_the_volume_and_share_the_surface(degree, largest):
    for above, _ in surfaces(degree, largest, inside=["above"]):
        below = isospline.Isosurface(above.volume, above.level, inside="below")
        whole = np.prod(np.diff(above.volume.bounds, axis=0))
        volumes = above.enclosed_volume(order=4), below.enclosed_volume(order=4)
        assert abs(sum(each.value for each in volumes) - whole) <= sum(each.error for each in volumes) + 1e-9 * whole
        areas = above.area(order=4), below.area(order=4)
        assert abs(areas[0].value - areas[1].value) <= sum(each.error for each in areas) + 1e-9 * areas[0].value


@pytest.mark.slow
@pytest.mark.sweep(3)
@pytest.mark.parametrize("degree, largest", CASES)
def test_measures_agree_with_points_and_lines(rng, degree, largest):
    """Volumes against shares of random points; areas against crossings of random lines (Crofton's formula)."""
    for surface, _ in surfaces(degree, largest):
        lower, upper = surface.volume.bounds
        points = random_points(surface, 20000, rng)
        share = ((surface.volume.sample(points) >= surface.level - 1e-9) == (surface.inside == "above")).mean()
        volume, whole = surface.enclosed_volume(order=4), np.prod(upper - lower)
        # A share of none or all may be wrong by some points.
        assert abs(volume.value - share * whole) <= volume.error + 5 * whole * np.sqrt(
            max(share * (1 - share), 4 / 20000) / 20000
        )

        # Lines with isotropic directions, through points of a disc perpendicular to each, that covers the volume.
        directions = rng.normal(size=(20000, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        radius = np.linalg.norm(upper - lower) / 2
        across = np.cross(directions, rng.normal(size=directions.shape))
        across *= radius * np.sqrt(rng.random((20000, 1))) / np.linalg.norm(across, axis=1, keepdims=True)
        origins = (lower + upper) / 2 + across - 2 * radius * directions
        crossings = isospline.Scene(surface).count_intersections(np.concatenate([origins, directions], axis=1))
        area = surface.area(order=4)
        expected = 2 * np.pi * radius**2 * crossings.mean()
        deviation = 2 * np.pi * radius**2 * max(crossings.std(), 0.02) / np.sqrt(20000)
        assert abs(area.value - expected) <= area.error + 5 * deviation, surface


def test_areas_of_known_solids_of_degree_1():
    # A plateau of 3 x 3 x 3 samples at the level, in a lower volume: f >= level on 2 x 2 x 2 cells.
    data = np.zeros((7, 7, 7), np.float32)
    data[2:5, 2:5, 2:5] = 1
    cube = isospline.Isosurface(isospline.Volume(data, degree=1), 1)
    around = isospline.Isosurface(cube.volume, 1, inside="below")
    for surface, volume in ((cube, 8.0), (around, 6.0**3 - 8.0)):
        assert surface.enclosed_volume().value == pytest.approx(volume, abs=1e-9)
        assert surface.area().value == pytest.approx(24.0, abs=1e-9)
    assert cube.contains([(3.2, 3.3, 2.8)])[0] and not around.contains([(3.2, 3.3, 2.8)])[0]
    assert isospline.Scene(cube).count_intersections([(3.3, 3.2, -1, 0, 0, 1)])[0] == 2
    assert len(cube.components(measured=True).areas) == 1
    # Without lower samples there is no surface, and everything is above.
    flat = isospline.Isosurface(isospline.Volume(data, degree=1), 0)
    assert flat.area().value == 0 and flat.enclosed_volume().value == pytest.approx(216)
    assert isospline.Scene(flat).count_intersections([(3.3, 3.2, -1, 0, 0, 1)])[0] == 0
    # A chequered volume: f is a product, and the surface three planes in each cell.
    chequered = (-1.0) ** np.indices((5, 5, 5)).sum(axis=0)
    for inside in ("above", "below"):
        surface = isospline.Isosurface(isospline.Volume(chequered, degree=1), 0, inside=inside)
        assert surface.area().value == pytest.approx(3 * 64, abs=1e-6)
        assert surface.enclosed_volume().value == pytest.approx(32, abs=1e-6)


def test_areas_of_faces_end_at_the_clip():
    data = np.broadcast_to(np.array([0, 0, 1, 1, 1, 0], np.float32), (6, 6, 6))
    oblique = isospline.HalfSpace((2.5, 2.5, 2.5), (0.3, 1, 0.5))
    for inside in ("above", "below"):
        surface = isospline.Isosurface(isospline.Volume(data, degree=1), 1, inside=inside, clip=oblique)
        # The planes x = 2 and x = 4. On each, the half-space keeps half of the square, moved along y by a term of x.
        kept = [25 / 2 - 5 * 0.3 * step for step in (0.5, -1.5)]
        assert surface.area().value == pytest.approx(sum(kept), abs=1e-9)


@pytest.mark.parametrize("largest", [2, 4])
@pytest.mark.parametrize("inside", ["above", "below"])
def test_components_of_degree_1_are_those_of_scipy(largest, inside):
    for surface, data in surfaces(1, largest, inside=[inside]):
        solid = (data >= surface.level) == (inside == "above")
        assert len(surface.components().cell_counts) == ndimage.label(solid, np.ones((3, 3, 3)))[1]


@pytest.mark.slow
@pytest.mark.parametrize("degree, largest", CASES)
def test_closed_meshes_are_closed(degree, largest):
    for surface, _ in surfaces(degree, largest, closed=True):
        mesh = surface.to_mesh()
        if len(mesh.faces) == 0:
            continue
        edges = np.concatenate([mesh.faces[:, [i, (i + 1) % 3]] for i in range(3)])
        # Each edge has as many faces in one direction as in the other.
        balance = {}
        for start, end in edges.tolist():
            key, step = ((start, end), 1) if start < end else ((end, start), -1)
            balance[key] = balance.get(key, 0) + step
        assert not any(balance.values())
