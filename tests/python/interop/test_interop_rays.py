"""Rays with the interface of trimesh. The oracle is trimesh on the same meshes, and closed forms on isosurfaces."""

import copy
import inspect
import pickle

import numpy as np
import pytest

import isospline
from isospline import RayMeshIntersector, volumes

trimesh = pytest.importorskip("trimesh")
pytest.importorskip("rtree")


@pytest.fixture(params=["sphere", "torus", "two boxes", "cavity", "far away"])
def shape(request):
    if request.param == "sphere":
        return trimesh.creation.icosphere(subdivisions=3)
    if request.param == "torus":
        return trimesh.creation.torus(0.7, 0.3)
    if request.param == "two boxes":
        return trimesh.util.concatenate([trimesh.creation.box(), trimesh.creation.box().apply_translation((2, 1, 0.5))])
    if request.param == "cavity":
        inner = trimesh.creation.icosphere(radius=0.5)
        inner.invert()
        return trimesh.util.concatenate([trimesh.creation.icosphere(radius=1), inner])
    return trimesh.creation.torus(7, 3).apply_translation((1000, -2000, 500))


def rays_at(shape, rng, count=300):
    """Rays from a sphere around the shape, and from within it, at points of its box."""
    lower, upper = shape.bounds
    center, radius = (lower + upper) / 2, np.linalg.norm(upper - lower)
    origins = rng.normal(size=(count, 3))
    origins *= radius / np.linalg.norm(origins, axis=1)[:, None]
    origins[: count // 3] *= rng.uniform(0, 0.5, (count // 3, 1))
    directions = rng.uniform(lower, upper, (count, 3)) - center - origins
    return center + origins, directions * rng.uniform(0.1, 10, (count, 1))


def native(shape):
    return trimesh.ray.ray_triangle.RayMeshIntersector(shape)


def in_order(origins, directions, locations, index_ray, index_tri):
    """The same crossings, sorted by ray and then along it."""
    t = ((locations - origins[index_ray]) * directions[index_ray]).sum(axis=1)
    order = np.lexsort([t, index_ray])
    return locations[order], index_ray[order], index_tri[order]


def test_all_crossings_are_those_of_trimesh(shape, rng):
    origins, directions = rays_at(shape, rng)
    expected = in_order(origins, directions, *native(shape).intersects_location(origins, directions))
    assert len(expected[1]) > len(np.unique(expected[1])) > 50

    intersector = RayMeshIntersector(shape)
    locations, index_ray, index_tri = intersector.intersects_location(origins, directions)
    np.testing.assert_array_equal(index_ray, expected[1])
    np.testing.assert_array_equal(index_tri, expected[2])
    np.testing.assert_allclose(locations, expected[0], atol=1e-6 * shape.scale)
    assert (index_ray.dtype, index_tri.dtype) == (np.int64, np.int64)
    for got, same in zip(intersector.intersects_id(origins, directions), (index_tri, index_ray)):
        np.testing.assert_array_equal(got, same)


@pytest.mark.slow
def test_first_and_any_crossings_are_those_of_trimesh(shape, rng):
    origins, directions = rays_at(shape, rng)
    intersector, oracle = RayMeshIntersector(shape), native(shape)
    np.testing.assert_array_equal(
        intersector.intersects_first(origins, directions), oracle.intersects_first(origins, directions)
    )
    np.testing.assert_array_equal(
        intersector.intersects_any(origins, directions), oracle.intersects_any(origins, directions)
    )
    expected = in_order(origins, directions, *oracle.intersects_location(origins, directions, multiple_hits=False))
    locations, index_ray, index_tri = intersector.intersects_location(origins, directions, multiple_hits=False)
    np.testing.assert_array_equal(index_ray, expected[1])
    np.testing.assert_array_equal(index_tri, expected[2])
    np.testing.assert_allclose(locations, expected[0], atol=1e-6 * shape.scale)


@pytest.mark.slow
def test_points_inside_are_those_of_trimesh(shape, rng):
    lower, upper = shape.bounds
    points = rng.uniform(lower - 0.2, upper + 0.2, (1000, 3))
    expected = native(shape).contains_points(points)
    assert 50 < expected.sum() < 950
    np.testing.assert_array_equal(RayMeshIntersector(shape).contains_points(points), expected)


@pytest.mark.parametrize("wrong", [-3, 1.5, float("nan")])
def test_max_hits_is_a_whole_number(wrong):
    intersector = isospline.RayMeshIntersector(trimesh.creation.box())
    for multiple_hits in (True, False):
        with pytest.raises(ValueError, match="^max_hits: expected a whole number of at least 0, got"):
            intersector.intersects_id([(0, 0, 5)], [(0, 0, -1)], multiple_hits=multiple_hits, max_hits=wrong)
        found = intersector.intersects_id([(0, 0, 5)], [(0, 0, -1)], multiple_hits=multiple_hits, max_hits=0)
        assert [len(each) for each in found] == [0, 0]


def test_max_hits_keeps_the_first_ones(shape, rng):
    origins, directions = rays_at(shape, rng)
    intersector = RayMeshIntersector(shape)
    every = intersector.intersects_id(origins, directions)
    for count in (0, 1, 3):
        index_tri, index_ray = intersector.intersects_id(origins, directions, max_hits=count)
        kept = np.concatenate([np.flatnonzero(every[1] == ray)[:count] for ray in range(len(origins))])
        np.testing.assert_array_equal(index_tri, every[0][kept])
        np.testing.assert_array_equal(index_ray, every[1][kept])


def test_it_takes_the_place_of_trimesh_s_own(shape, rng):
    lower, upper = shape.bounds
    points = rng.uniform(lower, upper, (200, 3))
    expected = trimesh.proximity.signed_distance(shape, points), trimesh.proximity.thickness(shape, *surface(shape))
    contained = shape.contains(points)
    shape.ray = RayMeshIntersector(shape)
    np.testing.assert_allclose(trimesh.proximity.signed_distance(shape, points), expected[0], atol=1e-9 * shape.scale)
    np.testing.assert_allclose(
        trimesh.proximity.thickness(shape, *surface(shape)), expected[1], rtol=1e-5, atol=1e-5 * shape.scale
    )
    np.testing.assert_array_equal(shape.contains(points), contained)


def surface(shape):
    """Arguments for the thickness by rays: points on the surface and their normals."""
    rows = np.arange(0, len(shape.faces), 7)
    return shape.triangles_center[rows], True, shape.face_normals[rows], "ray"


def test_edges_and_corners_are_crossed_once():
    rays = RayMeshIntersector(trimesh.creation.box())
    origins = np.array([(0.25, 0.25, 3.0), (0, 0, 3.0), (-0.125, -0.125, 3.0)])  # above diagonals of top and bottom
    _, index_ray = rays.intersects_id(origins, np.full((3, 3), (0, 0, -1.0)))
    np.testing.assert_array_equal(index_ray, [0, 0, 1, 1, 2, 2])


def test_isosurfaces_are_crossed_where_the_sphere_is(rng):
    field = volumes.sphere(radius=0.7)
    surface = isospline.Isosurface(field.volume(48), field.level)
    origins, targets = rng.normal(size=(500, 3)), rng.uniform(-0.7, 0.7, (500, 3))
    origins *= 3 / np.linalg.norm(origins, axis=1)[:, None]
    directions = targets - origins
    # The roots of |o + t d|^2 = r^2, for rays that do not graze the sphere.
    a, b = (directions**2).sum(1), (origins * directions).sum(1)
    square = b * b - a * ((origins**2).sum(1) - 0.7**2)
    kept = np.abs(square) > 0.01 * a
    origins, directions, a, b, square = (values[kept] for values in (origins, directions, a, b, square))
    hit = square > 0
    root = np.sqrt(square[hit])
    t = np.stack([(-b[hit] - root) / a[hit], (-b[hit] + root) / a[hit]], axis=1)
    expected = origins[hit][:, None] + t[..., None] * directions[hit][:, None]

    rays = RayMeshIntersector(surface)
    locations, index_ray, index_tri = rays.intersects_location(origins, directions)
    np.testing.assert_array_equal(index_ray, np.repeat(np.flatnonzero(hit), 2))
    np.testing.assert_allclose(locations, expected.reshape(-1, 3), atol=2e-3)
    # Cells are unit cubes centred on the samples.
    index = (locations - surface.volume.origin) / surface.volume.spacing
    assert np.abs(index - surface.volume.cell_at(index_tri)).max() < 0.5 + 1e-6
    np.testing.assert_array_equal(rays.intersects_any(origins, directions), hit)
    np.testing.assert_array_equal(rays.intersects_first(origins, directions) >= 0, hit)

    points = rng.uniform(-1, 1, (2000, 3))
    distance = np.linalg.norm(points, axis=1) - 0.7
    points, distance = points[np.abs(distance) > 1e-3], distance[np.abs(distance) > 1e-3]
    np.testing.assert_array_equal(rays.contains_points(points), distance < 0)


def test_of_several_objects_each_contains_its_points(rng):
    field = volumes.sphere(radius=0.7)
    surface = isospline.Isosurface(field.volume(48), field.level)
    box = trimesh.creation.box()
    scene = isospline.Scene([surface, isospline.Mesh.from_trimesh(box)])
    scene.add(surface, trimesh.transformations.translation_matrix((2, 0, 0)))
    points = rng.uniform(-1, 1, (2000, 3)) * (2, 1, 1) + (1, 0, 0)
    distances = np.linalg.norm(points[:, None] - [(0, 0, 0), (2, 0, 0)], axis=2) - 0.7
    in_box = (np.abs(points) < 0.5).all(axis=1)
    clear = (np.abs(distances) > 1e-3).all(axis=1)
    np.testing.assert_array_equal(
        RayMeshIntersector(scene).contains_points(points)[clear], ((distances < 0).any(axis=1) | in_box)[clear]
    )


def test_interface_is_that_of_trimesh():
    for module in ("ray_triangle", "ray_pyembree"):
        try:
            theirs = __import__(f"trimesh.ray.{module}", fromlist=["RayMeshIntersector"]).RayMeshIntersector
        except ImportError:  # embreex is not installed
            continue
        for name, function in inspect.getmembers(theirs, inspect.isfunction):
            if name.startswith("_"):
                continue
            ours = inspect.signature(getattr(RayMeshIntersector, name)).parameters
            for parameter in inspect.signature(function).parameters.values():
                is_any = parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
                assert parameter.name in ours or is_any, (module, name, parameter)


def test_first_hits_only_as_a_third_argument():
    rays, box = RayMeshIntersector(trimesh.creation.box()), trimesh.creation.box()
    assert rays.scene.bounds.tolist() == box.bounds.tolist()
    origins, directions = [(0.1, 0.2, 3.0)], [(0, 0, -1.0)]
    assert [len(found) for found in rays.intersects_id(origins, directions, False)] == [1, 1]
    assert [len(found) for found in rays.intersects_location(origins, directions, False)] == [1, 1, 1]
    assert [len(found) for found in rays.intersects_location(origins, directions)] == [2, 2, 2]


@pytest.mark.parametrize("query", ["intersects_id", "intersects_location", "intersects_first", "intersects_any"])
def test_rays_without_a_direction_miss(query):
    rays = RayMeshIntersector(trimesh.creation.box(), scale_to_box=False)
    origins = np.tile((0.1, 0.2, 3.0), (3, 1))
    found = getattr(rays, query)(origins, [(0, 0, 0), (0, 0, -1), (0, 0, 0)])
    if query == "intersects_first":
        np.testing.assert_array_equal(found >= 0, [False, True, False])
    elif query == "intersects_any":
        np.testing.assert_array_equal(found, [False, True, False])
    else:
        np.testing.assert_array_equal(found[1], [1, 1])  # rows of rays as they were given
    assert len(rays.intersects_id(origins, np.zeros((3, 3)))[0]) == 0


def test_it_sees_changes_of_a_mesh_of_trimesh():
    mesh = trimesh.Trimesh()
    mesh.ray = RayMeshIntersector(mesh)
    assert mesh.ray.mesh is mesh
    box = trimesh.creation.box()
    mesh.vertices, mesh.faces = box.vertices, box.faces
    ray = [(0.9, 0.0, 3.0)], [(0, 0, -1.0)]
    assert not mesh.ray.intersects_any(*ray).any()
    scene = mesh.ray.scene
    assert mesh.ray.scene is scene  # built once
    mesh.apply_scale(2)
    assert mesh.ray.intersects_any(*ray).all()
    assert mesh.contains([(0.9, 0.9, 0.9), (1.1, 0, 0)]).tolist() == [True, False]


def test_pickles_and_copies_cast_the_same_rays(shape, rng):
    origins, directions = rays_at(shape, rng)
    rays = RayMeshIntersector(shape, scale_to_box=False)
    expected = rays.intersects_location(origins, directions)
    for other in (pickle.loads(pickle.dumps(rays)), copy.copy(rays), copy.deepcopy(rays)):
        for got, same in zip(other.intersects_location(origins, directions), expected):
            np.testing.assert_array_equal(got, same)
    shape.ray = rays
    assert copy.copy(rays).mesh is shape
    assert len(pickle.loads(pickle.dumps(shape)).ray.intersects_first(origins, directions)) == len(origins)
    scene = RayMeshIntersector(isospline.Scene([isospline.Mesh.from_trimesh(shape)]))
    np.testing.assert_array_equal(
        copy.deepcopy(scene).intersects_first(origins, directions), rays.intersects_first(origins, directions)
    )


@pytest.mark.parametrize("scale", [1e-4, 0.1, 1.0, 10, 1e4, 1e8])
def test_a_ray_that_begins_on_the_surface_meets_it(scale):
    mesh = trimesh.creation.box().subdivide().subdivide()
    mesh.apply_scale(scale)
    rays = RayMeshIntersector(mesh)
    for direction in ((0, 0, -1.0), (0.3, 0.2, -1.0), (-3, 5, -7e-5)):
        _, index_ray, index_tri = rays.intersects_location([(0, 0, scale / 2)], [direction])
        assert len(index_tri) == 2 and index_tri[0] != index_tri[1]


def test_no_rays_have_no_crossings():
    rays, none = RayMeshIntersector(trimesh.creation.box()), np.empty((0, 3))
    locations, index_ray, index_tri = rays.intersects_location(none, none)
    assert (locations.shape, index_ray.shape, index_tri.shape) == ((0, 3), (0,), (0,))
    assert rays.intersects_first(none, none).shape == rays.contains_points(none).shape == (0,)
    assert not rays.contains_points([(5, 5, 5), (np.nan, 0, 0)]).any()


def test_bad_rays_and_geometry_are_refused():
    rays = RayMeshIntersector(trimesh.creation.box())
    with pytest.raises(ValueError, match=r"ray_origins: expected shape \(N, 3\)"):
        rays.intersects_first((0, 0, 0), (1, 0, 0))
    with pytest.raises(ValueError, match="ray_directions: expected as many as ray_origins, 2"):
        rays.intersects_any(np.zeros((2, 3)), np.ones((1, 3)))
    with pytest.raises(ValueError, match=r"points: expected shape \(N, 3\)"):
        rays.contains_points(np.zeros((4, 2)))
    with pytest.raises(ValueError, match="rays: expected finite origins and directions"):
        rays.intersects_id(np.zeros((1, 3)), np.full((1, 3), np.nan))
    with pytest.raises(TypeError, match="geometry: expected a Scene, an Isosurface"):
        RayMeshIntersector(np.zeros((3, 3)))
    with pytest.raises(TypeError, match=r"mesh: expected a trimesh.Trimesh"):
        RayMeshIntersector(trimesh.PointCloud(np.zeros((3, 3))))
