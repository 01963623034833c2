"""Nearest points, samples and thickness of solids with caps, against closed forms and a dense mesh."""

import numpy as np
import pytest
import scipy.ndimage
import scipy.stats
import trimesh

import isospline
from isospline import volumes

PLANES = [isospline.HalfSpace((0.05, 0, 0), (1, 0.3, 0.2)), isospline.HalfSpace((0, -0.3, 0), (0, 1, -0.4))]


def half_torus(n=48):
    field = volumes.torus(0.6, 0.25)
    volume = field.volume(n)
    return isospline.Isosurface(volume, field.level, clip=PLANES, capped=True)


@pytest.mark.slow
def test_nearest_points_see_caps_as_the_dense_mesh_does(rng):
    surface = half_torus()
    shape = surface.to_mesh().to_trimesh()
    points = rng.uniform(-1, 1, (400, 3))
    nearest = surface.closest_points(points)
    theirs = trimesh.proximity.closest_point(shape, points)[1]
    edge = min(surface.volume.spacing)
    np.testing.assert_allclose(nearest.distances, theirs, atol=0.05 * edge)  # the mesh is that coarse
    assert nearest.error_bounds.max() < 1e-4 * edge
    on_caps = nearest.primitive_ids >= surface.volume.cell_count
    assert 0.05 < on_caps.mean() < 0.8
    assert set(np.unique(nearest.primitive_ids[on_caps] - surface.volume.cell_count)) == {0, 1}
    planes = np.array([plane.normal for plane in PLANES])
    normals = planes[(nearest.primitive_ids[on_caps] - surface.volume.cell_count).astype(int)]
    np.testing.assert_allclose(nearest.primitive_normals[on_caps], -normals / np.linalg.norm(normals, axis=1)[:, None])
    signed = surface.signed_distance(points, tolerance=1e-4 * edge)
    np.testing.assert_array_equal(signed < 0, surface.contains(points))
    np.testing.assert_allclose(abs(signed), nearest.distances, atol=2e-4 * edge)
    inside = trimesh.proximity.signed_distance(shape, points) > 0
    far = nearest.distances > 0.05 * edge
    np.testing.assert_array_equal((signed < 0)[far], inside[far])


def test_nearest_points_of_a_half_ball_have_a_closed_form(rng):
    field = volumes.sphere(0.7)
    volume = field.volume(64)
    clip = isospline.HalfSpace((0, 0, 0), (0, 0, 1))
    surface = isospline.Isosurface(volume, field.level, clip=clip, capped=True)
    points = rng.uniform(-1, 1, (500, 3))
    radius = np.linalg.norm(points, axis=1)
    across = np.linalg.norm(points[:, :2], axis=1)
    to_disc = np.hypot(np.maximum(across - 0.7, 0), points[:, 2])
    to_ball = np.where(points[:, 2] >= 0, abs(radius - 0.7), np.inf)
    distances = surface.closest_points(points).distances
    np.testing.assert_allclose(distances, np.minimum(to_disc, to_ball), atol=1e-4)
    matrix = np.eye(4)
    matrix[:3, :3] = 2 * np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    matrix[:3, 3] = 1, 2, 3
    moved = isospline.Scene([(surface, matrix)]).closest_points(points @ matrix[:3, :3].T + matrix[:3, 3])
    np.testing.assert_allclose(moved["distances"], 2 * distances, atol=1e-9)
    unlimited = isospline.Isosurface(volume, field.level, clip=clip)
    assert (unlimited.closest_points(points).distances >= distances).all()
    near = surface.closest_points(points, max_distance=0.1).distances
    np.testing.assert_array_equal(near, np.where(distances <= 0.1, distances, np.inf))


def test_nearest_points_of_caps_end_at_a_mask(rng):
    data = np.ones((12, 12, 12))
    mask = np.ones((12, 12, 12), bool)
    mask[:, :, 6:] = False
    volume = isospline.Volume(data + rng.uniform(0, 0.1, data.shape))
    surface = isospline.Isosurface(
        volume, 0.5, mask=mask, clip=isospline.HalfSpace((0, 0, 5.2), (0, 0, 1)), capped=True
    )  # everything is solid: the surface has only the cap
    points = rng.uniform(0, 11, (300, 3))
    end = np.clip(points, (-0.5, -0.5, 5.2), (5.5, 11.5, 5.2))
    np.testing.assert_allclose(surface.closest_points(points).points, end, atol=1e-12)


def test_samples_of_capped_surfaces_are_uniform_by_area():
    field = volumes.sphere(0.7)
    volume = field.volume(48)
    surface = isospline.Isosurface(volume, field.level, clip=isospline.HalfSpace((0, 0, 0.1), (0, 0, 1)), capped=True)
    count = 40_000
    samples = surface.sample_points(count, seed=3)
    on_cap = samples["primitive_ids"] == volume.cell_count
    disc, dome = np.pi * (0.49 - 0.01), 2 * np.pi * 0.7 * 0.6
    part = disc / (disc + dome)
    assert abs(on_cap.mean() - part) < 5 * np.sqrt(part * (1 - part) / count)
    np.testing.assert_allclose(samples["points"][on_cap, 2], 0.1, atol=1e-12)
    np.testing.assert_array_equal(samples["primitive_normals"][on_cap], [[0, 0, -1]] * on_cap.sum())
    squares = (samples["points"][on_cap, :2] ** 2).sum(axis=1) / 0.48  # uniform in a disc
    assert scipy.stats.kstest(squares, "uniform").pvalue > 1e-4
    again = surface.sample_points(100, seed=3)
    np.testing.assert_array_equal(again["points"], samples["points"][:100])


def test_samples_of_nothing_but_caps():
    volume = isospline.Volume(np.ones((6, 6, 6)) + 0.01 * np.arange(6))
    surface = isospline.Isosurface(volume, 0.5, clip=isospline.HalfSpace((2, 2, 2), (1, 1, 1)), capped=True)
    samples = surface.sample_points(200)
    np.testing.assert_allclose(samples["points"].sum(axis=1), 6, atol=1e-12)
    assert (samples["primitive_ids"] == volume.cell_count).all()


def test_thickness_ends_at_caps():
    field = volumes.sphere(0.7)
    volume = field.volume(48)
    surface = isospline.Isosurface(volume, field.level, clip=isospline.HalfSpace((0, 0, 0.5), (0, 0, 1)), capped=True)
    assert surface.thickness((0, 0, 0.7)) == pytest.approx(0.2, abs=1e-3)
    assert surface.thickness((0, 0, 0.5)) == pytest.approx(0.2, abs=1e-3)
    assert surface.thickness((0, 0, 0.7), method="ray") == pytest.approx(0.2, abs=1e-3)
    balls = surface.thickness(surface.sample_points(50)["points"])
    assert (balls <= 0.2 + 1e-3).all()


def test_distances_of_surfaces_count_caps():
    field = volumes.sphere(0.7)
    volume = field.volume(32)
    ball = isospline.Isosurface(volume, field.level)
    half = isospline.Isosurface(volume, field.level, clip=isospline.HalfSpace((0, 0, 0), (0, 0, 1)), capped=True)
    # The middle of the cap is the farthest point from the ball's surface.
    lower, upper = isospline.surface_distance(half, ball, samples=500).maximum
    assert lower <= 0.7 + 1e-3 and 0.7 - 1e-3 <= upper < 0.75
    assert lower > 0.65


def points_about_a_box(rng, extent, count):
    """Points about the box from 0 to `extent`, of which many are exactly on planes of its faces, edges and corners."""
    relative = rng.uniform(-0.3, 1.3, (count, 3))
    special = rng.random((count, 3)) < rng.choice([0, 0.4, 1], count)[:, None]
    return np.where(special, rng.integers(0, 2, (count, 3)), relative) * extent


@pytest.mark.parametrize("way", ["closed", "clip"])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_nearest_points_of_solid_boxes_have_a_closed_form(rng, degree, way):
    """f = 1 everywhere, so the solid is a box. A foot on its edges may be mapped to a point beside the domain."""
    for case in range(60):
        spacing = np.ones(3) if case % 3 == 0 else np.round(rng.uniform(0.1, 3, 3), 2)
        direction = np.eye(3) if case % 2 == 0 or way == "clip" else np.linalg.qr(rng.normal(size=(3, 3)))[0]
        origin = rng.choice([0, 200]) * rng.uniform(-1, 1, 3)
        volume = isospline.Volume(
            np.ones(rng.integers(2, 20, 3)), degree=degree, spacing=spacing, origin=origin, direction=direction
        )
        lower = np.full(3, -0.5 if degree == 2 else 0.0) * spacing
        extent = (np.array(volume.shape[::-1]) - (0 if degree == 2 else 1)) * spacing
        clip = isospline.Box(*volume.bounds) if way == "clip" else None
        surface = isospline.Isosurface(volume, 0.5, clip=clip, capped=way == "clip", closed=way == "closed")
        local = points_about_a_box(rng, extent, 200)
        outside = np.linalg.norm(np.maximum(np.maximum(-local, local - extent), 0), axis=1)
        expected = np.where(outside > 0, outside, np.abs(np.minimum(local, extent - local).min(axis=1)))
        nearest = surface.closest_points(origin + (lower + local) @ direction.T)
        np.testing.assert_allclose(nearest.distances, expected, atol=1e-9 * extent.max())
        assert nearest.error_bounds.max() == 0.0


def test_levels_equal_to_samples_give_no_caps_below_them(rng):
    """The level counts as above: a solid below has no cap around border samples at the level between larger ones."""
    for degree in (1, 2, 3):
        level = isospline.Isosurface(
            isospline.Volume(np.ones((5, 5, 5)), degree=degree), 1, inside="below", closed=True
        )
        assert np.isinf(level.closest_points([(2, 2, -1), (2, 2, 0)]).distances).all()
    found = 0
    for _ in range(60):
        data = rng.integers(0, 4, rng.integers(3, 9, 3)).astype(float)
        isolated = (data == 1) & (scipy.ndimage.minimum_filter(data, 3) == 1)
        border = np.ones(data.shape, bool)
        border[1:-1, 1:-1, 1:-1] = False
        points = np.argwhere(isolated & border)[:, ::-1].astype(float)
        if len(points) == 0:
            continue
        surface = isospline.Isosurface(isospline.Volume(data, degree=1), 1, inside="below", closed=True)
        distances = surface.closest_points(points).distances
        # All cells at such a sample have no value below the level, and the next cells are half an edge away at least.
        assert distances.min() > 0.5
        beside = surface.closest_points(points + 1e-6 * rng.normal(size=points.shape)).distances
        np.testing.assert_allclose(beside, distances, atol=1e-5)
        found += len(points)
    assert found > 20


def test_the_thickness_where_planes_meet():
    """A ball may leave a corner by the ripple r: its radius is r / (sqrt(3) - 1), if the solid is not too thin."""
    solid = isospline.Volume(np.ones((12, 12, 12)))
    for lower, upper, ripple in (((2, 2, 2), (6, 6, 6), 0.5), ((1.3, 2.1, 3.7), (9.4, 7.2, 8.8), 0.2)):
        surface = isospline.Isosurface(solid, 0.5, clip=isospline.Box(lower, upper), capped=True)
        corners = np.stack(np.meshgrid(*zip(lower, upper)), axis=-1).reshape(-1, 3)
        np.testing.assert_allclose(surface.thickness(corners, ripple=ripple), 2 * ripple / (np.sqrt(3) - 1), rtol=0.02)
    closed = isospline.Isosurface(solid, 0.5, closed=True)
    assert closed.thickness((-0.5, -0.5, -0.5), ripple=0.5) == pytest.approx(1 / (np.sqrt(3) - 1), rel=0.02)

    field = isospline.volumes.torus(0.6, 0.25)
    cut = isospline.HalfSpace((0, 0, 0), (1, 0, 0))
    half = isospline.Isosurface(field.volume(24), field.level, clip=cut, capped=True)
    vertices = half.to_mesh().vertices
    rim = vertices[np.abs(vertices[:, 0]) < 1e-6][:40]
    np.testing.assert_allclose(half.thickness(rim), half.thickness(rim + (1e-6, 0, 0)), rtol=0.1)
