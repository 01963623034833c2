"""All crossings of rays: closed forms, an independent sampling by scipy, faces, edges and corners."""

import numpy as np
import pytest
from scipy import ndimage

import isospline


def sphere_volume(degree, radius_of_box=8):
    """f = squared distance from the origin; quadratic and cubic splines hold it exactly inside."""
    z, y, x = np.mgrid[
        -radius_of_box : radius_of_box + 1, -radius_of_box : radius_of_box + 1, -radius_of_box : radius_of_box + 1
    ].astype(float)
    return isospline.Volume(x**2 + y**2 + z**2, origin=(-radius_of_box,) * 3, degree=degree)


def random_rays(rng, count, reach):
    targets = rng.uniform(-0.3 * reach, 0.3 * reach, (count, 3))
    directions = rng.normal(size=(count, 3))
    units = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return np.concatenate([targets - 3 * units * reach, directions], axis=1)


def test_sphere_is_entered_and_left(rng):
    scene = isospline.Scene([isospline.Isosurface(sphere_volume(3, 20), 16.0, inside="below")])
    rays = random_rays(rng, 2000, 8)
    origins, directions = rays[:, :3], rays[:, 3:]
    square = (directions**2).sum(1)
    half = -(origins * directions).sum(1) / square
    discriminant = half**2 - ((origins**2).sum(1) - 16.0) / square
    hits = discriminant > 1e-3
    crossings = scene.list_intersections(rays)
    counts = np.diff(crossings["ray_splits"])
    np.testing.assert_array_equal(counts[hits], 2)
    np.testing.assert_array_equal(counts[discriminant < -1e-3], 0)
    first = crossings["ray_splits"][:-1][hits]
    # float32 coefficients of values up to 1200, of a slope of 8
    np.testing.assert_allclose(crossings["t_hit"][first], (half - np.sqrt(discriminant.clip(0)))[hits], atol=1e-4)
    np.testing.assert_allclose(crossings["t_hit"][first + 1], (half + np.sqrt(discriminant.clip(0)))[hits], atol=1e-4)
    assert crossings["entering"][first].all() and not crossings["entering"][first + 1].any()
    along = (crossings["primitive_normals"] * directions[crossings["ray_ids"]]).sum(1)
    np.testing.assert_array_equal(crossings["entering"], along < 0)
    np.testing.assert_array_equal(scene.count_intersections(rays), counts)
    np.testing.assert_allclose(scene.cast_rays(rays)["t_hit"][hits], crossings["t_hit"][first], rtol=1e-13)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_crossings_are_all_sign_changes(rng, degree):
    data = rng.normal(size=(9, 10, 11))
    volume = isospline.Volume(data, degree=degree)
    scene = isospline.Scene([isospline.Isosurface(volume, 0.1)])
    rays = random_rays(rng, 300, 10) + [5, 4.5, 4, 0, 0, 0]
    crossings = scene.list_intersections(rays)
    coefficients = ndimage.spline_filter(data, degree, mode="mirror") if degree > 1 else data

    def f(points):  # by an independent implementation
        return (
            ndimage.map_coordinates(coefficients, points[..., ::-1].T, order=degree, mode="mirror", prefilter=False)
            - 0.1
        )

    np.testing.assert_allclose(f(crossings["positions"]), 0, atol=2e-6)
    lower, upper = volume.bounds
    total = 0
    for i, ray in enumerate(rays):
        with np.errstate(divide="ignore"):
            sides = np.sort([(lower - ray[:3]) / ray[3:], (upper - ray[:3]) / ray[3:]], axis=0)
        t_in, t_out = sides[0].max(), sides[1].min()
        begin, end = crossings["ray_splits"][i : i + 2]
        if t_in >= t_out:
            assert begin == end
            continue
        t = crossings["t_hit"][begin:end]
        assert (np.diff(t) > 0).all() and (t >= t_in - 1e-8).all() and (t <= t_out + 1e-8).all()
        # Entries and exits alternate. Between two crossings, f keeps the sign that they imply.
        entering = crossings["entering"][begin:end]
        assert (entering[1:] != entering[:-1]).all()
        edges = np.concatenate([[t_in], t, [t_out]])
        samples = edges[:-1, None] + np.diff(edges)[:, None] * np.linspace(0.02, 0.98, 60)
        values = f((ray[:3] + samples[..., None] * ray[3:]).reshape(-1, 3)).reshape(samples.shape)
        signs = np.sign(np.where(np.abs(values) < 2e-6, 0, values))
        if len(t):
            expected = np.where(np.concatenate([[not entering[0]], entering]), 1, -1)
            assert ((signs == 0) | (signs == expected[:, None])).all()
        else:
            assert (signs >= 0).all() or (signs <= 0).all()
        total += len(t)
    assert total > 1000


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_a_crossing_on_a_face_edge_or_corner_of_cells_counts_once(degree):
    # f = x + y + z: at this level, the plane contains corners of cells. Rays run along their edges and diagonals.
    z, y, x = np.mgrid[0:9, 0:9, 0:9].astype(float)
    volume = isospline.Volume(x + y + z, degree=degree, filter="none")
    shift = 0.5 if degree % 2 == 0 else 0.0
    level = 12 - 3 * shift
    scene = isospline.Scene([isospline.Isosurface(volume, level)])
    corners = np.array([(i, j, 12 - i - j) for i in range(3, 6) for j in range(3, 6)], dtype=float) - shift
    for direction in [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1), (1, 1, 1), (1, 2, 0), (1, 2, 3)]:
        for sign in (1, -1):
            along = np.broadcast_to(sign * np.array(direction, float), corners.shape)
            rays = np.concatenate([corners - 2.0 * along, along], axis=1)
            crossings = scene.list_intersections(rays, t_far=2.5)
            np.testing.assert_array_equal(np.diff(crossings["ray_splits"]), 1)
            np.testing.assert_allclose(crossings["t_hit"], 2.0, atol=1e-9)
            assert (crossings["entering"] == (sign > 0)).all()


def test_edges_and_corners_of_a_mesh_count_once():
    vertices = np.array([(i & 1, i >> 1 & 1, i >> 2) for i in range(8)], dtype=float)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    scene = isospline.Scene([isospline.Mesh(vertices, faces)])
    rays = [(0.5, 0.5, -1, 0, 0, 1), (0.25, 0.5, -1, 0, 0, 1), (-1, -1, -1, 1, 1, 1), (0.3, 0.3, 5, 0, 0, -1)]
    crossings = scene.list_intersections(rays)
    np.testing.assert_array_equal(np.diff(crossings["ray_splits"])[[0, 1, 3]], 2)
    np.testing.assert_allclose(crossings["t_hit"][:4], [1, 2, 1, 2], atol=1e-9)
    np.testing.assert_array_equal(crossings["entering"][:4], [True, False, True, False])
    # weights of corners give the position back
    a, b, c = (vertices[np.asarray(faces)[crossings["primitive_ids"], i]] for i in range(3))
    u, v = crossings["primitive_uvs"].T[:, :, None]
    np.testing.assert_allclose(a + u * (b - a) + v * (c - a), crossings["positions"], atol=1e-5)


def test_objects_limits_and_shapes(rng):
    volume = sphere_volume(2)
    scene = isospline.Scene([isospline.Isosurface(volume, level, inside="below") for level in (9.0, 25.0)])
    ray = (-20, 0.1, 0.2, 1, 0, 0)
    crossings = scene.list_intersections(ray)
    assert crossings["geometry_ids"].tolist() == [1, 0, 0, 1]
    assert crossings["entering"].tolist() == [True, True, False, False]
    assert scene.count_intersections(ray).shape == () and scene.count_intersections(ray) == 4
    inner = crossings["t_hit"][1:3]
    assert scene.count_intersections(ray, t_near=inner[0] - 1e-6, t_far=inner[1] + 1e-6) == 2
    assert scene.count_intersections(ray, t_near=inner[0] + 1e-6, t_far=inner[1] - 1e-6) == 0
    assert scene.count_intersections(random_rays(rng, 12, 8).reshape(3, 4, 6)).shape == (3, 4)
    nothing = scene.list_intersections(np.zeros((0, 6)))
    assert nothing["ray_splits"].tolist() == [0] and nothing["primitive_normals"].shape == (0, 3)
    assert isospline.Scene().list_intersections(ray)["ray_splits"].tolist() == [0, 0]
    with pytest.raises(ValueError, match="rays: expected finite"):
        scene.list_intersections((0, 0, np.nan, 1, 0, 0))


def test_many_chunks_keep_their_order(rng):
    scene = isospline.Scene([isospline.Isosurface(sphere_volume(2), 16.0)])
    rays = random_rays(rng, 5000, 8)
    crossings = scene.list_intersections(rays)
    np.testing.assert_array_equal(np.repeat(np.arange(5000), np.diff(crossings["ray_splits"])), crossings["ray_ids"])
    where = rays[crossings["ray_ids"]]
    np.testing.assert_allclose(where[:, :3] + crossings["t_hit"][:, None] * where[:, 3:], crossings["positions"])
