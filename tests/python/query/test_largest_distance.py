"""Bounds on the largest distance of a surface: closed forms, dense samples, and how loose they are."""

import itertools
import math

import numpy as np
import pytest
import trimesh
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

import isospline
from isospline.farthest import parts
from isospline.farthest.slabs import HessianBounds, Slabs

CUT = isospline.HalfSpace((5.3, 5.1, 4.8), (1, 0.4, -0.3))
#: What a surface of noise may have besides, by a name.
OPTIONS = {
    "plain": {},
    "mask": {},
    "below": {"inside": "below"},
    "closed": {"closed": True},
    "closed below": {"closed": True, "inside": "below"},
    "clip": {"clip": CUT},
    "capped": {"clip": CUT, "capped": True},
    "all": {"clip": isospline.Box((2, 2, 2), (9, 8, 9)), "capped": True, "closed": True, "largest": 1},
}


def noise(rng, degree, shape=(12, 11, 13), sigma=1.2, **options):
    data = gaussian_filter(rng.normal(size=shape), sigma)
    return isospline.Volume(data / data.std(), degree=degree, **options)


def sheared(rng):
    """Spacing, origin and direction of a volume that is neither cubic nor rectangular."""
    return {
        "spacing": rng.uniform(0.6, 1.5, 3),
        "origin": rng.uniform(-1, 1, 3),
        "direction": np.eye(3) + rng.uniform(-0.3, 0.3, (3, 3)),
    }


def icosphere(radius, subdivisions=3):
    ball = trimesh.creation.icosphere(subdivisions, radius)
    return isospline.Mesh(ball.vertices, ball.faces)


def sphere(radius, size=24):
    field = isospline.volumes.sphere(0.7)
    return isospline.Isosurface(field.volume(size), 0.49 - radius**2)


@pytest.mark.parametrize("degree", [2, 3])
def test_hessian_bounds_of_blocks_hold(rng, degree):
    volume = noise(rng, degree, **sheared(rng))
    bounds = HessianBounds(volume)
    cells = np.array(list(np.ndindex(*(volume.cell_at(volume.cell_count - 1) + 1))))
    lower = cells[rng.integers(len(cells), size=300)]
    upper = np.minimum(lower + rng.integers(0, 3, (300, 3)), cells.max(axis=0))
    index = lower + rng.uniform(size=(200, 300, 3)) * (upper - lower + 1) - (0.5 if degree == 2 else 0)
    points = index @ volume.affine[:3, :3].T + volume.affine[:3, 3]
    norms = np.linalg.norm(volume.sample(points, derivative=2), ord=2, axis=(-2, -1)).max(axis=0)
    found = bounds.of_blocks(lower, upper)
    assert (found >= norms).all()
    assert np.median(found / norms) < 2  # Frobenius norms are up to sqrt(3) larger
    assert np.isinf(bounds.of_blocks(np.zeros((1, 3), int), np.full((1, 3), 9))).all()
    # Blocks end at the domain.
    np.testing.assert_array_equal(bounds.of_blocks(lower[:1] * 0 - 2, lower[:1] * 0), bounds.of_cells(lower[:1] * 0))


@pytest.mark.parametrize("degree", [2, 3])
def test_hessian_bounds_of_a_quadratic_are_exact(degree):
    """Its coefficients are quadratic too, apart from a constant, and the mirrors are far away."""
    z, y, x = np.meshgrid(*(np.arange(-10, 11),) * 3, indexing="ij")
    data = x**2 + y**2 + z**2 + 0.0
    bounds = HessianBounds(isospline.Volume(data, degree=degree, spacing=0.5, filter="none"))
    np.testing.assert_allclose(bounds.of_cells(np.full((1, 3), 9)), 8, rtol=1e-5)
    bounds = HessianBounds(isospline.Volume(x * y + 0.0, degree=degree, filter="none"))
    np.testing.assert_allclose(bounds.of_cells(np.full((1, 3), 9)), 1, rtol=1e-5)


@pytest.mark.sweep(4)
@pytest.mark.parametrize("name", OPTIONS)
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_bounds_of_boxes_hold_for_dense_samples(rng, degree, name):
    """Each sample is within the bound of its box from any point, such as a near one of a parallel surface."""
    smaller = 0
    for is_sheared in (False, True):
        volume = noise(rng, degree, **(sheared(rng) if is_sheared else {}))
        mask = {"mask": left_part(volume)} if name == "mask" or (name == "all" and degree == 2) else {}
        surface = isospline.Isosurface(volume, 0.4, **OPTIONS[name], **mask)
        samples = surface.sample_points(6000).points
        others = cKDTree(isospline.Isosurface(volume, 0.6).sample_points(6000).points)
        index = (samples - volume.affine[:3, 3]) @ np.linalg.inv(volume.affine[:3, :3]).T
        slabs = Slabs(surface)
        for half in (0.53, 0.21, 0.06):
            boxes, place = np.unique(np.floor(index / (2 * half)), axis=0, return_inverse=True)
            centers, halves = (2 * boxes + 1) * half, np.full(len(boxes), half)
            world, radius = slabs.to_world(centers), slabs.radius(halves)
            points = surface.closest_points(world, max_distance=1.01 * radius.max()).points
            for targets in (others.data[others.query(points)[1]], rng.uniform(-3, 15, points.shape)):
                bounds = slabs.bounds(centers, halves, points, targets, 0.0)
                each = place.reshape(-1)
                assert (np.linalg.norm(samples - targets[each], axis=1) <= bounds[each] * (1 + 1e-9)).all()
                of_boxes = np.linalg.norm(world - targets, axis=1) + radius
                assert (bounds <= of_boxes).all()
                smaller += (bounds < 0.99 * of_boxes).sum()
    assert smaller > 1000 if degree > 1 else smaller == 0


def left_part(volume):
    mask = np.ones(volume.shape, bool)
    mask[:, :, 8:] = False
    return mask


@pytest.mark.sweep(4)
@pytest.mark.parametrize("name", ["plain", "closed below", "all"])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_largest_distances_hold_for_dense_samples(rng, degree, name):
    grid = sheared(rng)
    surface = isospline.Isosurface(noise(rng, degree, (11, 10, 11), **grid), 0.3, **OPTIONS[name])
    other = isospline.Isosurface(noise(rng, degree, (11, 10, 11), **grid), 0.3, closed=True)
    points = surface.sample_points(2000, seed=7).points
    largest = other.closest_points(points).distances.max()
    lower, upper = isospline.surface_distance(surface, other, samples=300, tolerance=0.1 * largest).maximum
    assert lower - 1e-6 <= largest * 1.1 and largest <= upper * (1 + 1e-9)
    assert upper <= lower + 0.1 * largest + 1e-9


@pytest.mark.parametrize("degree", [2, 3])
def test_levels_of_a_linear_field_are_parallel_planes(degree):
    """With a closed border, the caps of the solid are there as well, and those between the planes are farthest away."""
    data = np.broadcast_to(np.arange(16.0), (16, 16, 16))
    volume = isospline.Volume(data, degree=degree, filter="none")  # mirrors are at least 4 away from the planes
    one, other = (isospline.Isosurface(volume, level) for level in (7.2, 7.9))
    lower, upper = isospline.surface_distance(one, other, samples=100).maximum
    assert lower == pytest.approx(0.7, abs=1e-6) and 0.7 - 1e-6 <= upper <= 0.77 + 1e-9
    lower, upper = isospline.surface_distance(one, other, samples=100, tolerance=0.021).maximum
    assert lower == pytest.approx(0.7, abs=1e-6) and 0.7 - 1e-6 <= upper <= 0.721 + 1e-6
    one, other = (isospline.Isosurface(volume, level, closed=True) for level in (7.2, 7.9))
    for here, there in itertools.permutations((one, other)):
        lower, upper = isospline.surface_distance(here, there, samples=100, tolerance=0.03).maximum
        assert lower - 1e-6 <= 0.7 <= upper + 1e-6 and upper - lower <= 0.03 + 1e-9


@pytest.mark.parametrize("degree", [2, 3])
def test_levels_of_a_quadratic_field_are_concentric_spheres(degree):
    """A sum of squares of a distance in voxels, as coefficients, is the same sum plus a constant."""
    z, y, x = np.meshgrid(*(np.arange(-9, 10.0),) * 3, indexing="ij")
    volume = isospline.Volume(
        x**2 + y**2 + z**2, degree=degree, filter="none", spacing=0.1, origin=(-0.9, -0.9, -0.9), direction=np.eye(3)
    )
    at_center = float(volume.sample((0, 0, 0)))
    assert at_center == pytest.approx({2: 0.75, 3: 1.0}[degree], abs=1e-4)
    large, small = (isospline.Isosurface(volume, at_center + (10 * r) ** 2, inside="below") for r in (0.65, 0.59))
    for here, there in itertools.permutations((large, small)):
        lower, upper = isospline.surface_distance(here, there, samples=100).maximum
        assert lower == pytest.approx(0.06, abs=1e-5) and 0.06 - 1e-5 <= upper <= 0.066 + 1e-9
    lower, upper = isospline.hausdorff_distance(large, small, tolerance=0.01)
    assert lower == pytest.approx(0.06, abs=1e-5) and 0.06 - 1e-5 <= upper <= 0.07 + 1e-9


def test_meshes_of_concentric_spheres():
    """The middles of triangles are nearer to the centre, by about 0.09^2 / 1.4 = 0.006."""
    large, small = icosphere(0.7), icosphere(0.65)
    for here, there in itertools.permutations((large, small)):
        lower, upper = isospline.surface_distance(here, there, samples=100, tolerance=0.002).maximum
        assert abs(lower - 0.05) < 6e-3 and lower <= upper <= lower + 0.002 + 1e-12
    # One look at each triangle is enough: its corners are r = 0.08 at most from its centre.
    lower, upper = isospline.surface_distance(large, small, samples=100, tolerance=0.05).maximum
    assert upper <= math.hypot(lower, 0.08)


def test_meshes_of_parallel_planes():
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0.0)])
    faces = [(0, 1, 2), (0, 2, 3)]
    one, other = isospline.Mesh(corners, faces), isospline.Mesh(corners * 3 - 1 + (0, 0, 1.1), faces)
    lower, upper = isospline.surface_distance(one, other, samples=100, tolerance=1e-3).maximum
    assert lower == pytest.approx(0.1, abs=1e-12) and 0.1 - 1e-12 <= upper <= 0.101 + 1e-12
    # A vertex that no triangle has is no part of the surface.
    more = isospline.Mesh(np.concatenate([corners, [(0, 0, 9)]]), faces)
    assert isospline.surface_distance(more, other, samples=100, tolerance=1e-3).maximum == (lower, upper)


@pytest.mark.parametrize("closed", [False, True])
def test_bounds_of_nearly_parallel_surfaces_are_within_a_tenth(rng, closed):
    """A volume that is shifted by 0.7 voxels, whose caps are 0.7 apart, too; boxes alone need radii of 0.07."""
    data = gaussian_filter(rng.normal(size=(14, 14, 14)), 2.5)
    one, other = (
        isospline.Isosurface(isospline.Volume(data / data.std(), origin=(x, 0, 0)), 0.5, closed=closed)
        for x in (0, 0.7)
    )
    lower, upper = isospline.surface_distance(one, other, samples=500).maximum
    assert 0.69 < lower <= 0.7 + 1e-9 and 0.7 <= upper <= 1.1 * lower + 1e-9
    lower, upper = isospline.surface_distance(one, other, samples=500, tolerance=0.03).maximum
    assert 0.7 <= upper <= lower + 0.03 + 1e-9


def test_bounds_of_a_shell_are_within_a_tenth():
    """Between isosurfaces, and between one and a mesh, either way."""
    for here, there in ((sphere(0.7), sphere(0.65)), (sphere(0.7), icosphere(0.65)), (icosphere(0.7), sphere(0.65))):
        lower, upper = isospline.surface_distance(here, there, samples=500).maximum
        assert abs(lower - 0.05) < 6e-3 and lower <= upper <= 1.1 * lower + 1e-9


def test_the_default_tolerance_follows_the_distance():
    """Of a quarter voxel e: e if they are far apart or the same, and the larger of d / 10 and sqrt(d^2 + e^2) - d."""
    quarter = 0.25 / 12
    for radius, expected in ((0.7, quarter), (0.69, math.hypot(0.01, quarter) - 0.01), (0.63, 0.007), (0.2, quarter)):
        lower, upper = isospline.surface_distance(sphere(0.7), sphere(radius), samples=500).maximum
        assert 0.2 * expected < upper - lower <= expected * 1.02, radius


def test_a_smaller_tolerance_gives_no_looser_bounds(monkeypatch):
    """Boxes with the largest bounds are divided first, as far as the number of boxes allows."""
    monkeypatch.setattr(parts, "MOST_PARTS", 1 << 16)
    bounds = [
        isospline.surface_distance(sphere(0.7), sphere(0.65), samples=100, tolerance=tolerance).maximum[1]
        for tolerance in (0.02, 0.01, 0.005, 1e-4)
    ]
    assert bounds == sorted(bounds, reverse=True) and bounds[0] <= 0.07 + 1e-4
    assert 0.0502 < bounds[3] < 0.054  # d + r would be 0.065 for boxes of this number


@pytest.mark.parametrize("measure", [isospline.surface_distance, isospline.hausdorff_distance])
def test_surfaces_in_two_units_are_refused(measure):
    data = 5 - np.linalg.norm(np.indices((12, 12, 12)) - 5.5, axis=0)

    def ball(unit, spacing):
        return isospline.Isosurface(isospline.Volume(data, spacing=spacing, unit=unit), 0.0)

    with pytest.raises(ValueError, match=r"other: expected an isosurface in mm.*, got one in µm: scale it by 0\.001"):
        measure(ball("mm", 1.0), ball("µm", 1000.0))
    with pytest.raises(ValueError, match="other: expected an isosurface in mm.*, got one in furlong: scale it, in"):
        measure(ball("mm", 1.0), ball("furlong", 1.0))
    for unit, same in (("mm", "millimeter"), ("mm", ""), ("µm", "um"), ("furlong", "furlong")):
        measure(ball(unit, 1.0), ball(same, 1.0))
    if measure is isospline.surface_distance:
        scaled = isospline.Scene([(ball("µm", 1000.0), np.diag([0.001, 0.001, 0.001, 1]))])
        assert measure(ball("mm", 1.0), scaled, samples=100).rms.value < 1e-5


def test_the_lower_bound_allows_for_the_error_of_distances():
    """Distances are less exact at the centre of a ball. |p - q| is convex, so corners bound the true one from above."""
    trimesh = pytest.importorskip("trimesh")
    field = isospline.volumes.sphere(0.7)
    surface = isospline.Isosurface(field.volume(24), field.level)
    mesh = isospline.Mesh.from_trimesh(trimesh.creation.icosphere(1, 1e-4))
    points = surface.sample_points(100_000).points
    from_vertices = [np.linalg.norm(points - vertex, axis=1) for vertex in mesh.vertices]
    most = max(np.max([from_vertices[i] for i in face], axis=0).min() for face in mesh.faces)
    least, largest = isospline.surface_distance(mesh, surface, samples=50, tolerance=1e-6).maximum
    assert least <= most and largest >= max(each.min() for each in from_vertices) - 1e-4
