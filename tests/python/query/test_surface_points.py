"""Points of surfaces, thickness, and distances between surfaces."""

import math

import numpy as np
import pytest
import trimesh
from scipy.ndimage import gaussian_filter

import isospline


def sphere(radius, size=32, **options):
    field = isospline.volumes.sphere(0.7)
    return isospline.Isosurface(field.volume(size), 0.49 - radius**2, **options)


def test_samples_are_on_the_surface_and_uniform_by_area():
    # An ellipsoid: its area by height is known from samples of a sphere that is mapped to it.
    field = isospline.volumes.sphere(0.7)
    spacing = np.array([1.0, 1.0, 4.0]) / 16
    volume = isospline.Volume(field.values(32), spacing=spacing, origin=-15.5 * spacing)
    surface = isospline.Isosurface(volume, field.level)
    found = surface.sample_points(40000, seed=3)
    x = found["points"]
    assert abs(volume.sample(x)).max() < 1e-9
    gradient = volume.sample(x, derivative=1)
    normals = -gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
    np.testing.assert_allclose(found["primitive_normals"], normals, atol=1e-9)
    heights = np.linspace(-1, 1, 20001)
    density = np.sqrt(1 + 15 * (1 - heights**2))  # of the area of an ellipsoid with half-axes 1, 1, 4
    cumulated = np.cumsum(density) / density.sum()
    samples = np.sort(x[:, 2] / (0.7 * 4))
    expected = np.interp(samples, heights, cumulated)
    assert abs(expected - np.arange(40000) / 40000).max() < 1.95 / 200  # Kolmogorov and Smirnov, 0.1%
    again = surface.sample_points(100, seed=3)["points"]
    np.testing.assert_array_equal(again, x[:100])
    assert not np.array_equal(again, surface.sample_points(100, seed=4)["points"])


def test_samples_keep_to_cuts_and_an_empty_surface_is_an_error():
    clip = isospline.HalfSpace((0, 0, 0.3), (0, 0, 1))
    assert sphere(0.7, clip=clip).sample_points(500)["points"][:, 2].min() >= 0.3
    assert sphere(0.7).sample_points(0)["points"].shape == (0, 3)
    with pytest.warns(UserWarning, match="there is no surface"):
        empty = sphere(0.7).with_level(1e6)
    with pytest.raises(ValueError, match="surface: expected one with points to sample"):
        empty.sample_points(1)
    with pytest.raises(ValueError, match="count: expected a number of at least 0"):
        sphere(0.7).sample_points(-1)
    with pytest.raises(ValueError, match="seed: expected 0 to 4294967295"):
        sphere(0.7).sample_points(1, seed=-1)


@pytest.mark.slow
def test_thickness_of_a_torus_and_a_shell():
    field = isospline.volumes.torus(0.6, 0.25)
    torus = isospline.Isosurface(field.volume(48, degree=3), field.level)
    points = torus.sample_points(150)["points"]
    for method in ("max_sphere", "ray"):
        # Balls are more sensitive to the spline's difference from the formula: they curve as much as the tube.
        np.testing.assert_allclose(torus.thickness(points, method=method), 0.5, atol=1.6e-2)

    # A wall between radii 0.4 and 0.7; measured outwards from its inside, rays and balls are as long as it is thick.
    samples = isospline.volumes.Field(lambda p: -((np.linalg.norm(p, axis=-1) - 0.55) ** 2), None, 0.0).values(80)
    shell = isospline.Isosurface(isospline.Volume(samples, **field.grid(80)), -(0.15**2))
    outer = np.array([(0.7, 0, 0), (0, 0, 0.7), (0.7 / math.sqrt(2), 0.7 / math.sqrt(2), 0)])
    for method in ("max_sphere", "ray"):
        np.testing.assert_allclose(shell.thickness(outer, method=method), 0.3, atol=2e-3)
    inner = outer * (0.4 / 0.7)
    np.testing.assert_allclose(shell.thickness(inner, method="ray"), 0.3, atol=2e-3)


def noisy(shape, signed_distance, noise, rng):
    """A solid where a signed distance in voxels is negative: an edge of one voxel, blurred, of contrast 1."""
    position = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).astype(float)
    data = gaussian_filter(np.clip(signed_distance(position) + 0.5, 0, 1), 0.8)
    data += rng.normal(0, noise, shape)
    return isospline.Isosurface(isospline.Volume(data), 0.5, inside="below", closed=True, largest=1)


@pytest.mark.sweep(1)
@pytest.mark.parametrize("noise", [0, 0.01, 0.04])
def test_thickness_on_noisy_data(noise, rng):
    """Balls in ripples are smaller than the ideal one by about the height of two of them."""
    middle = np.array([11.3, 10.8, 11.1])
    # The shape, the signed distance, the part of the surface that is far from ends and edges, and the thickness.
    solids = {
        "bore": ((26, 22, 22), lambda p: np.hypot(*(p[..., 1:] - middle[:2]).T).T - 7.3, (4, 11, 11), 14.6),
        "slab": ((24, 24, 14), lambda p: abs(p[..., 2] - 6.6) - 3.4, (7, 7, 7), 6.8),
        "ball": ((22, 22, 22), lambda p: np.linalg.norm(p - middle, axis=-1) - 8, (11, 11, 11), 16),
    }
    for name, (shape, signed_distance, within, thickness) in solids.items():
        surface = noisy(shape, signed_distance, noise, rng)
        points = surface.sample_points(400)["points"]
        index = points[:, ::-1]
        is_inner = (abs(index - (np.array(shape) - 1) / 2) < within).all(axis=1) & (abs(signed_distance(index)) < 1)
        found = surface.thickness(points[is_inner][:40]) / thickness
        assert len(found) > 20 and abs(np.quantile(found, [0.05, 0.5, 0.95]) - 1).max() < 0.02 + noise, name


def test_thickness_beside_an_edge():
    """In a box, a ball that is `ripple` away from a point at distance a from an edge touches both sides of the edge."""
    box = isospline.Isosurface(isospline.Volume(np.ones((30, 11, 11)), spacing=0.5), 0.0, closed=True)
    a = np.array([0.0, 1e-6, 1e-3, 0.01, 0.2, 0.5, 1.1, 2.5])
    lower, upper = box.volume.bounds
    points = lower + np.stack([a, 0 * a, 0 * a + 7], axis=1)
    for ripple in (0, 0.1, 0.25, 0.4):
        radius = np.minimum((upper - lower)[0] / 2, a + ripple + np.sqrt(2 * a * ripple + 2 * ripple**2))
        np.testing.assert_allclose(box.thickness(points, ripple=ripple), 2 * radius, atol=0.03 * ripple + 2e-3)
    np.testing.assert_array_equal(box.thickness(points), box.thickness(points, ripple=0.25))
    np.testing.assert_allclose(box.thickness(points, ripple=1e6), (upper - lower)[0], atol=0.02)  # anywhere in the box
    with pytest.raises(ValueError, match="^ripple: expected a finite number of at least 0"):
        box.thickness(points, ripple=-1)


def test_thickness_with_ripples_is_at_least_that_of_the_touching_ball():
    z, y, x = np.mgrid[0:24, 0:24, 0:24] * 0.4
    gyroid = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    wall = isospline.Isosurface(isospline.Volume(0.5 - abs(gyroid)), 0.0, closed=True)
    points = wall.sample_points(300).points
    touching = wall.thickness(points, ripple=0)
    for ripple in (0.1, 0.5, 1):
        assert (wall.thickness(points, ripple=ripple) > touching - 0.03).all()


def test_thickness_where_the_solid_is_open_or_capped():
    clip = isospline.HalfSpace((0, 0, 0), (0, 0, 1))
    top = (0, 0, 0.7)
    assert np.isinf(sphere(0.7, clip=clip).thickness(top, method="ray"))
    assert abs(sphere(0.7, clip=clip, capped=True).thickness(top, method="ray") - 0.7) < 1e-4
    # Two plates, the first without its other side: what is beyond the gap is not its other side.
    samples = np.zeros((3, 3, 24))
    samples[..., 3:9] = samples[..., 13:20] = 1
    index = np.arange(24)
    plates = isospline.Isosurface(isospline.Volume(samples), 0.5, mask=((index < 5) | (index > 10)) & (samples >= 0))
    for options in ({"method": "ray"}, {"ripple": 0}, {}):
        np.testing.assert_allclose(plates.thickness([(2.5, 1, 1), (12.5, 1, 1)], **options), [np.inf, 7], atol=0.02)
    with pytest.raises(ValueError, match='method: expected "max_sphere" or "ray", got "balls"'):
        sphere(0.7).thickness(top, method="balls")


@pytest.mark.slow
def test_distance_of_spheres():
    apart = isospline.surface_distance(sphere(0.7, 24), sphere(0.5, 24), samples=1000)
    assert abs(apart.mean.value - 0.2) < 2e-4 and abs(apart.rms.value - 0.2) < 2e-4
    lower, upper = apart.maximum
    assert lower <= 0.2 + 2e-4 and 0.2 - 2e-4 <= upper <= lower + 0.25 / 12 + 1e-12
    assert apart.distances.shape == (1000,) and apart.points.shape == (1000, 3)
    lower, upper = isospline.hausdorff_distance(sphere(0.7, 24), sphere(0.5, 24), tolerance=0.03)
    assert lower - 2e-4 <= 0.2 <= upper + 2e-4 and upper - lower <= 0.03


@pytest.mark.slow
def test_one_sided_distances_differ():
    whole, half = sphere(0.7), sphere(0.7, clip=isospline.HalfSpace((0, 0, 0), (0, 0, 1)))
    assert isospline.surface_distance(half, whole, samples=500).maximum[1] < 0.25 / 16 + 1e-9
    lower, upper = isospline.surface_distance(whole, half, samples=500).maximum
    farthest = 0.7 * math.sqrt(2)  # of the south pole from the rim
    assert lower <= farthest + 1e-4 and farthest - 1e-4 <= upper < lower + 0.25 / 16 + 1e-9


def test_distance_from_a_mesh(rng):
    vertices = np.array([(-1, -1, -1), (1, -1, -1), (0, 1, -1.0)]) * 9
    apart = isospline.surface_distance(sphere(0.7), isospline.Mesh(vertices, [(0, 1, 2)]), samples=2000)
    assert abs(apart.mean.value - 9) < 5 * apart.mean.error
    assert apart.maximum[0] - 1e-4 <= 9.7 <= apart.maximum[1] + 1e-4


@pytest.mark.slow
def test_distance_of_a_mesh_from_a_sphere():
    """Of the points of a cube, its corners are farthest from a ball in it, and the middles of its faces nearest."""
    box = trimesh.creation.box(extents=(2, 2, 2))
    cube = isospline.Mesh(box.vertices, box.faces)
    apart = isospline.surface_distance(cube, sphere(0.7, 28), samples=2000, seed=3)
    assert abs(abs(apart.points).max(axis=1) - 1).max() < 1e-12 and len(apart.points) == 2000
    u = (np.arange(1000) + 0.5) / 1000
    radius = np.sqrt(1 + u[:, None] ** 2 + u**2)  # on a quarter of a face
    assert abs(apart.mean.value - (radius - 0.7).mean()) < 5 * apart.mean.error + 1e-4
    assert abs(apart.rms.value - np.sqrt(((radius - 0.7) ** 2).mean())) < 5 * apart.rms.error + 1e-4
    np.testing.assert_allclose(apart.distances, np.linalg.norm(apart.points, axis=1) - 0.7, atol=1e-4)
    lower, upper = apart.maximum
    assert lower - 1e-4 <= math.sqrt(3) - 0.7 <= upper + 1e-4 and upper - lower <= 0.25 / 14 + 1e-12
    back = isospline.surface_distance(sphere(0.7, 28), cube, samples=500).maximum
    both = isospline.hausdorff_distance(cube, sphere(0.7, 28))
    assert both == isospline.hausdorff_distance(sphere(0.7, 28), cube) == (max(lower, back[0]), max(upper, back[1]))


@pytest.mark.slow
def test_distances_of_meshes_are_those_of_trimesh(rng):
    ball, box = trimesh.creation.icosphere(2, 0.8), trimesh.creation.box(extents=(1, 2, 0.6))
    one, other = isospline.Mesh(ball.vertices, ball.faces), isospline.Mesh(box.vertices, box.faces)
    for mesh, shape, target, theirs in ((one, ball, other, box), (other, box, one, ball)):
        apart = isospline.surface_distance(mesh, target, samples=1000)
        assert trimesh.proximity.closest_point(shape, apart.points)[1].max() < 1e-12
        np.testing.assert_allclose(apart.distances, trimesh.proximity.closest_point(theirs, apart.points)[1], atol=1e-9)
        # The largest distance, from a dense subdivision.
        dense = shape.subdivide_to_size(0.04)
        largest = trimesh.proximity.closest_point(theirs, dense.vertices)[1].max()
        lower, upper = apart.maximum
        assert lower - 1e-9 <= largest + 0.04 and largest <= upper + 1e-9
        assert upper - lower <= 1e-3 * np.linalg.norm(np.ptp(shape.bounds, axis=0)) + 1e-12
    lower, upper = isospline.hausdorff_distance(one, other, tolerance=1e-3)
    assert upper - lower <= 1e-3 + 1e-12
    # Samples are uniform by area: each of the box's faces has its share.
    points = isospline.surface_distance(other, one, samples=20_000).points
    for axis, part in enumerate(np.array([1.2, 0.6, 2.0]) / 3.8):
        found = (abs(abs(points[:, axis]) - (0.5, 1, 0.3)[axis]) < 1e-12).mean()
        assert abs(found - part) < 5 * math.sqrt(part * (1 - part) / 20_000)
    same = isospline.surface_distance(one, one, samples=100)
    assert same.mean.value < 1e-12 and same.maximum[1] < 0.02  # parallel: the bound ends at 2^18 triangles


def test_meshes_without_area_have_no_distances():
    flat = isospline.Mesh([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)])
    none = isospline.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    for mesh in (flat, none):
        with pytest.raises(ValueError, match="^surface: expected a surface with points to sample"):
            isospline.surface_distance(mesh, sphere(0.7))
    with pytest.raises(ValueError, match="^other: expected a surface with points"):
        isospline.surface_distance(sphere(0.7), none)


def test_bad_distances():
    with pytest.raises(TypeError, match="other: expected an Isosurface, a Mesh or a Scene"):
        isospline.surface_distance(sphere(0.7), 3)
    with pytest.raises(TypeError, match="surface: expected an Isosurface or a Mesh"):
        isospline.surface_distance(3, sphere(0.7))
    with pytest.raises(ValueError, match="samples: expected at least 2"):
        isospline.surface_distance(sphere(0.7), sphere(0.5), samples=1)
    with pytest.raises(ValueError, match="tolerance: expected a finite number above 0"):
        isospline.surface_distance(sphere(0.7), sphere(0.5), tolerance=0)
    with pytest.raises(TypeError, match="tolerance: expected a number, got 'a'"):
        isospline.surface_distance(sphere(0.7), sphere(0.5), tolerance="a")
    for count in (100.5, "a"):
        with pytest.raises(TypeError, match="samples: expected a whole number, got"):
            isospline.surface_distance(sphere(0.7), sphere(0.5), samples=count)


def test_bad_hausdorff_distances_name_the_argument(monkeypatch):
    flat = isospline.Mesh([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)])
    monkeypatch.setattr(isospline.distances, "surface_distance", None)  # neither direction is measured
    with pytest.raises(TypeError, match="other: expected an Isosurface or a Mesh, got Scene"):
        isospline.hausdorff_distance(sphere(0.7), isospline.Scene([sphere(0.5)]))
    with pytest.raises(ValueError, match="other: expected a surface with points to sample, got a mesh without area"):
        isospline.hausdorff_distance(sphere(0.7), flat)


def test_signed_distances_and_their_quantiles():
    x, y, z = 0.1, 0.0, 0.0  # the centre of a ball that is cut by the surface of the other one
    ball = trimesh.creation.icosphere(5, 0.7)
    ball.apply_translation((x, y, z))
    moved = isospline.Mesh.from_trimesh(ball)
    for one, other in ((sphere(0.7), moved), (moved, sphere(0.7))):
        apart = isospline.surface_distance(one, other, samples=4000, signed=True)
        center = np.array((x, y, z)) if other is moved else np.zeros(3)
        expected = np.linalg.norm(apart.points - center, axis=1) - 0.7
        np.testing.assert_allclose(apart.distances, expected, atol=5e-4)
        assert apart.mean.value == pytest.approx(expected.mean(), abs=5e-4)
        # The distance is about 0.1 cos(angle), whose cosine is uniform: half of it is below 0.05.
        np.testing.assert_allclose(apart.quantiles, (0.05, 0.095, 0.099), atol=3e-3)
        assert apart.maximum[0] <= 0.1005 and apart.maximum[1] >= 0.0995
        plain = isospline.surface_distance(one, other, samples=4000)
        np.testing.assert_array_equal(plain.distances, np.abs(apart.distances))
        assert plain.rms == apart.rms and plain.maximum == apart.maximum


def test_distances_are_a_table():
    pytest.importorskip("pandas")
    apart = isospline.surface_distance(sphere(0.7), sphere(0.5), samples=50, signed=True)
    frame = apart.to_frame()
    assert list(frame.columns) == ["points_x", "points_y", "points_z", "distances"] and len(frame) == 50
    np.testing.assert_array_equal(frame["distances"], apart.distances)
