"""Nearest points, distances and occupancy in scenes, against trimesh and closed forms."""

import numpy as np
import pytest
import trimesh

import isospline

MIRROR_AND_SHEAR = np.array([(-1.5, 0.4, 0.0, 3.0), (0.0, 0.7, 0.2, -1.0), (0.1, 0.0, 2.0, 0.5), (0, 0, 0, 1.0)])


def sphere(radius=0.7):
    field = isospline.volumes.sphere(0.7)
    return isospline.Isosurface(field.volume(32), 0.49 - radius**2)


@pytest.mark.parametrize("matrix", [np.eye(4), MIRROR_AND_SHEAR], ids=["in place", "mirrored and sheared"])
def test_meshes_agree_with_trimesh(rng, matrix):
    body = trimesh.creation.annulus(0.5, 1.0, 0.8, sections=24)
    scene = isospline.Scene()
    scene.add(isospline.Mesh.from_trimesh(body), transform=matrix)
    placed = body.copy().apply_transform(matrix)
    points = placed.bounds.mean(0) + rng.normal(size=(2000, 3)) * 2
    nearest = scene.closest_points(points)
    expected, distances, _ = trimesh.proximity.closest_point(placed, points)
    np.testing.assert_allclose(nearest["distances"], distances, atol=1e-9)
    assert (np.linalg.norm(points - nearest["points"], axis=1) <= distances + 1e-9).all()
    u, v = nearest["primitive_uvs"].T[..., None]
    a, b, c = np.moveaxis(np.asarray(placed.vertices)[np.asarray(body.faces)[nearest["primitive_ids"]]], 1, 0)
    b, c = (b, c)
    np.testing.assert_allclose((1 - u - v) * a + u * b + v * c, nearest["points"], atol=1e-9)
    assert (nearest["geometry_ids"] == 0).all() and (nearest["error_bounds"] == 0).all()
    inside = placed.contains(points)
    near_wall = distances < 1e-9
    np.testing.assert_array_equal(scene.occupancy(points)[~near_wall], inside[~near_wall])
    np.testing.assert_allclose(scene.signed_distance(points), np.where(inside, -distances, distances), atol=1e-9)


def test_surfaces_under_transforms(rng):
    matrix = np.diag([1.0, 1.0, -1.0, 1.0])
    matrix[:3, 3] = (5, 0, 1)
    scene = isospline.Scene()
    scene.add(sphere(), transform=matrix)
    points = np.array([5, 0, 1]) + rng.normal(size=(500, 3))
    radii = np.linalg.norm(points - (5, 0, 1), axis=1)
    points, radii = points[radii > 0.1], radii[radii > 0.1]
    np.testing.assert_allclose(scene.signed_distance(points), radii - 0.7, atol=1e-4)
    nearest = scene.closest_points(points)
    outward = (points - (5, 0, 1)) / radii[:, None]
    np.testing.assert_allclose(nearest["primitive_normals"], outward, atol=5e-3)


def test_a_sheared_surface_is_as_near_as_its_densest_samples(rng):
    surface = sphere()
    scene = isospline.Scene()
    scene.add(surface, transform=MIRROR_AND_SHEAR)
    samples = surface.sample_points(100000)["points"] @ MIRROR_AND_SHEAR[:3, :3].T + MIRROR_AND_SHEAR[:3, 3]
    points = MIRROR_AND_SHEAR[:3, 3] + rng.normal(size=(200, 3)) * 2
    from scipy.spatial import cKDTree

    sampled = cKDTree(samples).query(points)[0]
    nearest = scene.closest_points(points)
    assert (nearest["distances"] <= sampled + 1e-9).all() and (sampled - nearest["distances"]).max() < 0.02
    np.testing.assert_allclose(np.linalg.norm(points - nearest["points"], axis=1), nearest["distances"], atol=1e-12)


def test_the_nearest_of_several_objects(rng):
    cube = isospline.Mesh.from_trimesh(trimesh.creation.box((1, 1, 1)))
    scene = isospline.Scene()
    first = scene.add(cube, transform=np.array([(1, 0, 0, 3.0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)]))
    second = scene.add(sphere())
    hidden = scene.add(sphere(), transform=np.diag([3.0, 3, 3, 1]), visible=False)
    points = rng.uniform(-2, 5, (1000, 3))
    outside = abs(points - (3, 0, 0)) - 0.5
    of_cube = np.linalg.norm(outside.clip(0), axis=1) + outside.max(1).clip(max=0)
    of_sphere = np.linalg.norm(points, axis=1) - 0.7
    signed = scene.signed_distance(points)
    expected = np.where(abs(of_cube) < abs(of_sphere), of_cube, of_sphere)
    np.testing.assert_allclose(signed, expected, atol=1e-4)
    nearest = scene.closest_points(points)
    clear = abs(abs(of_cube) - abs(of_sphere)) > 1e-3
    assert (nearest["geometry_ids"] == np.where(abs(of_cube) < abs(of_sphere), first, second))[clear].all()
    assert hidden not in nearest["geometry_ids"]
    near = scene.closest_points(points, max_distance=0.5)
    np.testing.assert_array_equal(np.isfinite(near["distances"]), nearest["distances"] <= 0.5)
    np.testing.assert_array_equal(near["geometry_ids"] == isospline.INVALID_ID, np.isinf(near["distances"]))


def test_far_points_and_no_objects():
    scene = isospline.Scene([isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]), sphere()])
    for distance in (1e6, 1e20, 1e50):
        assert abs(scene.closest_points((0, 0, distance))["distances"] / distance - 1) < 1e-5
    empty = isospline.Scene().closest_points([(0, 0, 0)])
    assert np.isinf(empty["distances"]).all() and (empty["geometry_ids"] == isospline.INVALID_ID).all()
    assert not isospline.Scene().occupancy([(0, 0, 0)]).any()


def test_open3d_names(rng):
    scene = isospline.Scene([sphere()])
    points = rng.uniform(-1, 1, (50, 3)).astype(np.float32)
    np.testing.assert_array_equal(scene.compute_signed_distance(points), scene.signed_distance(points))
    np.testing.assert_array_equal(scene.compute_distance(points), abs(scene.signed_distance(points)))
    occupancy = scene.compute_occupancy(points, nsamples=3)
    assert occupancy.dtype == np.float32
    np.testing.assert_array_equal(occupancy, scene.occupancy(points))
    closest = scene.compute_closest_points(query_points=points)
    assert {"points", "geometry_ids", "primitive_ids", "primitive_uvs", "primitive_normals"} <= closest.keys()
    with pytest.raises(ValueError, match="nsamples: expected an odd number above 0"):
        scene.compute_occupancy(points, 2)


def test_bad_input():
    scene = isospline.Scene([sphere()])
    for query in (scene.closest_points, scene.signed_distance, scene.occupancy):
        with pytest.raises(ValueError, match=r"points: expected shape \(..., 3\)"):
            query(np.zeros((3, 2)))
        with pytest.raises(ValueError, match=r"points: expected finite numbers"):
            query([(0, 0, 0), (0, np.inf, 0)])
    with pytest.raises(ValueError, match="max_distance: expected a number of at least 0"):
        scene.closest_points((0, 0, 0), max_distance=-1)
