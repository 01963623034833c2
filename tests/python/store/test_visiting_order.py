"""Points and rays in random order are visited chunk by chunk; results are in the caller's order."""

import numpy as np
import pytest

import isospline

pytest.importorskip("zarr")

SHAPE = (144, 128, 160)
#: The bytes of the finest level's coefficients.
SIZE = 4 * int(np.prod(SHAPE))
#: Just above the smallest limit: a tenth of the chunks fits into what the bricks leave.
LIMIT = "4.5MB"


def smooth_noise(shape, seed):
    """Noise with features of some eight samples, so that the surface is in every brick."""
    coarse = np.random.default_rng(seed).standard_normal([size // 8 + 4 for size in shape]).astype(np.float32)
    model = isospline.Volume(coarse, degree=3, filter="none")
    z, y, x = np.meshgrid(*(np.arange(size) / 8 + 1 for size in shape), indexing="ij")
    return model.sample(np.stack([x, y, z], axis=-1)).astype(np.float32)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The folder of a store, and the same volume in memory."""
    data = smooth_noise(SHAPE, 0)
    folder = tmp_path_factory.mktemp("store") / "noise.zarr"
    placed = {"spacing": (1, 1.5, 0.75), "origin": (3, -4, 5)}
    isospline.convert(data, folder, chunk=16, image=False, **placed)
    return folder, isospline.Volume(data, **placed)


@pytest.fixture
def opened(made):
    return isospline.open_volume(made[0], memory_limit=LIMIT)


@pytest.fixture
def one_thread():
    """Threads share the few chunks that stay in memory, and what they read differs from run to run."""
    isospline.set_thread_count(1)
    yield
    isospline.set_thread_count(0)


def rays_at(volume, count, seed=1):
    """Rays from random points of a volume, or from outside of it, in random directions."""
    rng = np.random.default_rng(seed)
    lower, upper = volume.bounds
    origins = rng.uniform(lower, upper, (count, 3))
    directions = rng.standard_normal((count, 3))
    origins[::2] -= 400 * directions[::2] / np.linalg.norm(directions[::2], axis=1, keepdims=True)
    return np.concatenate([origins, directions], axis=1)


def bytes_of(volume, query):
    before = volume.paging["bytes_read"]
    query()
    return volume.paging["bytes_read"] - before


def test_points_read_a_store_about_once(made, opened):
    rng = np.random.default_rng(2)
    points = rng.uniform(*opened.bounds, (40_000, 3))
    values = []
    assert bytes_of(opened, lambda: values.append(opened.sample(points))) < 2.5 * SIZE
    np.testing.assert_array_equal(values[0], made[1].sample(points))
    # In parts, which are sorted one by one, a tenth of the points reads more.
    assert bytes_of(opened, lambda: [opened.sample(part) for part in np.split(points[:4000], 80)]) > 3 * SIZE


@pytest.mark.slow
def test_points_of_a_scene_read_a_store_about_once(made, opened):
    transform = np.array([[0, -1, 0, 3], [1, 0, 0, 2], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    ours, theirs = isospline.Scene(), isospline.Scene()
    for scene, volume in ((ours, opened), (theirs, made[1])):
        scene.add(isospline.Isosurface(volume, 0.0), transform=transform)
    points = np.random.default_rng(3).uniform(*opened.bounds, (12_000, 3)) @ transform[:3, :3].T + transform[:3, 3]
    assert bytes_of(opened, lambda: ours.occupancy(points)) < 3 * SIZE
    np.testing.assert_array_equal(ours.occupancy(points), theirs.occupancy(points))
    some = points[:2000]
    np.testing.assert_array_equal(ours.signed_distance(some), theirs.signed_distance(some))


@pytest.mark.slow
@pytest.mark.usefixtures("one_thread")
def test_sorted_rays_read_a_fraction(opened):
    scene = isospline.Scene([isospline.Isosurface(opened, 0.0)])
    rays = rays_at(opened, 2000)
    read = [bytes_of(opened, lambda: query(rays)) for query in (scene.cast_rays, scene.test_occlusions)]
    # Coherent rays keep their order, and here they are not coherent.
    assert 5 * max(read) < bytes_of(opened, lambda: scene.cast_rays(rays, coherent=True))


def test_rays_in_memory_that_suffices_read_a_store_once(made):
    opened = isospline.open_volume(made[0], memory_limit="200MB")
    scene = isospline.Scene([isospline.Isosurface(opened, 0.0)])
    rays = rays_at(opened, 10_000)
    for query in ("cast_rays", "test_occlusions", "list_intersections", "count_intersections"):
        getattr(scene, query)(rays)
    assert opened.paging["bytes_read"] < 1.2 * SIZE


@pytest.mark.slow
@pytest.mark.parametrize("options", [{}, {"clip": isospline.HalfSpace((60, 90, 70), (1, 2, 3)), "capped": True}])
def test_results_are_those_of_the_volume_in_memory_in_the_given_order(made, opened, options):
    surfaces = [isospline.Isosurface(volume, 0.1, **options) for volume in (opened, made[1])]
    transform = np.array([[1, 0.2, 0, -20], [0, 1, 0, 5], [0, 0, 2, 1], [0, 0, 0, 1.0]])
    corner = opened.bounds[0] - 30
    mesh = isospline.Mesh(corner + 60 * np.eye(3), [(0, 1, 2)])
    scenes = []
    for surface in surfaces:
        scene = isospline.Scene([surface, mesh])
        scene.add(surface, transform=transform, visible=False)
        scenes.append(scene)
    ours, theirs = scenes
    rays = rays_at(opened, 200, seed=4).reshape(10, 20, 6)
    rays[0, 0, :3], rays[0, 1, 3:] = 1e12, (1e150, 0, 0)  # far out of any grid of integers
    for limits in ({}, {"t_near": 0.5, "t_far": 60}):
        out = {"t_hit": np.empty(rays.shape[:2])}
        hits = ours.cast_rays(rays, out=out, **limits)
        assert hits["t_hit"] is out["t_hit"]
        for name, array in theirs.cast_rays(rays, **limits).items():
            np.testing.assert_array_equal(hits[name], array)
        for name in ("test_occlusions", "count_intersections"):
            np.testing.assert_array_equal(getattr(ours, name)(rays, **limits), getattr(theirs, name)(rays, **limits))
        occluded = theirs.test_occlusions(rays, **limits)
        for scene in scenes:
            np.testing.assert_array_equal(scene.test_occlusions(rays, coherent=True, **limits), occluded)
        crossings = ours.list_intersections(rays, **limits)
        for name, array in theirs.list_intersections(rays, **limits).items():
            np.testing.assert_array_equal(crossings[name], array)


@pytest.mark.slow
def test_bad_rays_are_named_by_their_place_in_the_array(opened):
    scene = isospline.Scene([isospline.Isosurface(opened, 0.0)])
    for wrong, said in ((np.nan, "finite origins and directions, got nan in ray 77"), (0.0, "zero, got .* in ray 77")):
        rays = rays_at(opened, 201)
        rays[[77, 200], 3:] = wrong
        for query in (scene.cast_rays, scene.test_occlusions, scene.list_intersections, scene.count_intersections):
            with pytest.raises(ValueError, match=said):
                query(rays)
