"""VoxelHopper against a dense march in float64, against the scene, and by itself."""

import numpy as np
import pytest
from scipy import ndimage, optimize

import isospline

SHAPE = (12, 15, 19)
MODES = {"mirror": "mirror", "periodic": "grid-wrap"}
TURNED = {
    "spacing": (0.5, 1.25, 2.0),
    "origin": (-3.0, 20.0, 1.0),
    "direction": [[0.6, 0.8, 0], [0.8, -0.6, 0], [0, 0, 1]],
}


@pytest.fixture
def data(rng):
    # integers used as coefficients are exact in single precision
    return rng.integers(-100, 101, SHAPE).astype(np.float32)


@pytest.fixture
def smooth(rng):
    return ndimage.gaussian_filter(rng.normal(size=(24, 30, 37)), 2.0).astype(np.float32)


def rays_through(volume, rng, count):
    """Rays at random points of a volume's box: from outside, from inside, and along the axes of the world."""
    lower, upper = volume.bounds
    targets = rng.uniform(lower, upper, (count, 3))
    origins = targets + rng.normal(size=(count, 3)) * (upper - lower)
    origins[::4] = rng.uniform(lower, upper, (len(origins[::4]), 3))
    axis = rng.integers(0, 3, len(origins[1::4]))
    origins[1::4] = targets[1::4] - 2 * (upper - lower) * np.eye(3)[axis]
    return np.concatenate([origins, targets - origins], axis=1)


def model_along(ray, volume, coefficients, degree, mode):
    """f of t along a world ray, from coefficients and SciPy alone."""
    to_index = np.linalg.inv(volume.affine)
    origin = to_index[:3, :3] @ ray[:3] + to_index[:3, 3]
    direction = to_index[:3, :3] @ ray[3:]

    def f(t):
        points = origin + np.multiply.outer(t, direction)
        coordinates = np.moveaxis(points[..., ::-1], -1, 0).reshape(3, -1)
        values = ndimage.map_coordinates(coefficients, coordinates, order=degree, mode=mode, prefilter=False)
        return values.reshape(np.shape(t))

    margin = 0.5 if degree % 2 == 0 else 0.0
    planes = np.array([np.full(3, -margin), np.array(SHAPE[::-1]) - 1 + margin])
    with np.errstate(divide="ignore"):
        t = np.sort((planes - origin) / direction, axis=0)
    return f, max(t[0].max(), 0.0), t[1].min()


@pytest.mark.sweep(4)
@pytest.mark.parametrize("boundary", ["mirror", "periodic"])
@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("strides", [False, True])
def test_hits_are_the_first_crossings_of_a_dense_march(data, rng, degree, boundary, strides):
    volume = isospline.Volume(data, degree=degree, boundary=boundary, filter="none", **TURNED)
    level = 12.5
    hopper = isospline.research.VoxelHopper(isospline.Isosurface(volume, level), strides=strides)
    rays = rays_through(volume, rng, 60)
    found = 0
    for ray, t_hit in zip(rays, hopper.cast_rays(rays)["t_hit"]):
        f, enter, leave = model_along(ray, volume, data.astype(np.float64), degree, MODES[boundary])
        if not enter < leave:
            assert t_hit == np.inf
            continue
        t = np.linspace(enter, leave, 6000)
        above = f(t) >= level
        changes = np.flatnonzero(above[1:] != above[:-1])
        if len(changes) == 0:
            # roots that the march misses are valid, too
            assert t_hit == np.inf or abs(f(t_hit) - level) < 1e-6
            continue
        found += 1
        bracket = t[changes[0]], t[changes[0] + 1]
        expected = optimize.brentq(lambda at: float(f(at)) - level, *bracket, xtol=1e-14)
        if t_hit < bracket[0]:
            assert abs(f(t_hit) - level) < 1e-6
        else:
            assert t_hit == pytest.approx(expected, abs=1e-9)
    assert found > 20


@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("method", ["exact", "reference", "bracket"])
def test_same_hits_as_the_scene(smooth, rng, degree, method):
    volume = isospline.Volume(smooth, degree=degree, **TURNED)
    clip = [isospline.HalfSpace(volume.bounds.mean(axis=0), (0.2, 0.3, -0.1))]
    surface = isospline.research.isosurface(volume, 0.02, method=method, clip=clip)
    scene = isospline.Scene([surface])
    rays = rays_through(volume, rng, 4000)
    for limits in ({}, {"t_near": 0.7, "t_far": 1.3}):
        expected = scene.cast_rays(rays, **limits)
        hit = np.isfinite(expected["t_hit"])
        assert hit.sum() > 300
        for strides in (False, True):
            hits = isospline.research.VoxelHopper(surface, strides=strides).cast_rays(rays, **limits)
            assert set(hits) == set(expected)
            np.testing.assert_allclose(hits["t_hit"], expected["t_hit"], atol=1e-9)
            np.testing.assert_allclose(hits["primitive_normals"], expected["primitive_normals"], atol=1e-6)
            for name in ("geometry_ids", "primitive_ids"):
                np.testing.assert_array_equal(hits[name], expected[name])


def test_bracket_loses_roots_and_finds_none_that_is_not_there(data, rng):
    volume = isospline.Volume(data, filter="none")
    rays = rays_through(volume, rng, 3000)
    exact, bracket = (
        isospline.research.VoxelHopper(isospline.research.isosurface(volume, 12.5, method=method)).cast_rays(rays)[
            "t_hit"
        ]
        for method in ("exact", "bracket")
    )
    assert (bracket >= exact - 1e-9).all()
    assert 0.01 < (bracket > exact + 1e-9).mean() < 0.5


def test_shape_of_results_and_statistics(smooth):
    surface = isospline.Isosurface(isospline.Volume(smooth), 0.02)
    plain, striding = (isospline.research.VoxelHopper(surface, strides=strides) for strides in (False, True))
    rays = isospline.camera_for(surface.volume, size=(40, 30)).rays((40, 30))
    hits = plain.cast_rays(rays.astype(np.float32))
    assert hits["t_hit"].shape == (30, 40)
    assert hits["primitive_normals"].shape == (30, 40, 3)
    missed = np.isinf(hits["t_hit"])
    assert (hits["primitive_ids"][missed] == isospline.INVALID_PRIMITIVE_ID).all()

    striding.cast_rays(rays)
    assert plain.statistics["strides"] == 0
    assert 0.5 < plain.statistics["mean_hop_length"] < 1
    assert striding.statistics["hops"] + striding.statistics["strides"] <= plain.statistics["hops"]
    assert plain.memory >= smooth.size
    assert plain.surface is surface and striding.strides and not plain.strides


def test_another_level_takes_effect():
    z, y, x = np.mgrid[-8:9, -8:9, -8:9]
    volume = isospline.Volume(np.sqrt(x**2 + y**2 + z**2), origin=(-8, -8, -8))
    surface = isospline.Isosurface(volume, 5.0, inside="below")
    hopper = isospline.research.VoxelHopper(surface)
    for level in (5.0, 4.0):
        surface.level = level
        hits = hopper.cast_rays([(-20, 0.1, 0.2, 1, 0, 0)])
        assert hits["t_hit"][0] == pytest.approx(20 - np.sqrt(level**2 - 0.05), abs=5e-3)
        assert volume.cell_at(hits["primitive_ids"][0]).tolist() == [round(8 - level), 8, 8]
        assert hits["primitive_normals"][0] == pytest.approx([-1, 0.1 / level, 0.2 / level], abs=0.02)


def test_same_hits_for_any_number_of_threads(smooth, rng):
    volume = isospline.Volume(smooth)
    hopper = isospline.research.VoxelHopper(isospline.Isosurface(volume, 0.02))
    rays = rays_through(volume, rng, 5000)
    expected, statistics = hopper.cast_rays(rays), hopper.statistics
    isospline.set_thread_count(1)
    try:
        hits = hopper.cast_rays(rays)
    finally:
        isospline.set_thread_count(0)
    for name in expected:
        np.testing.assert_array_equal(hits[name], expected[name])
    assert hopper.statistics == pytest.approx(statistics)


@pytest.mark.parametrize(
    ("rays", "message"),
    [
        (np.zeros((2, 5)), r"rays: expected shape \(\.\.\., 6\)"),
        ([[0, 0, 0, 0, 0, 0]], "rays: .*zero"),
        ([[0, 0, 0, 1, 0, 0], [0, np.nan, 0, 1, 0, 0]], "rays: .*ray 1"),
        ([[0, 0, 0, 1, np.inf, 0]], "rays: .*ray 0"),
    ],
)
def test_bad_rays(smooth, rays, message):
    hopper = isospline.research.VoxelHopper(isospline.Isosurface(isospline.Volume(smooth), 0.02))
    with pytest.raises(ValueError, match=message):
        hopper.cast_rays(rays)


def test_bad_arguments(smooth):
    hopper = isospline.research.VoxelHopper(isospline.Isosurface(isospline.Volume(smooth), 0.02))
    with pytest.raises(ValueError, match="t_near"):
        hopper.cast_rays(np.ones((1, 6)), t_near=np.nan)
    with pytest.raises(TypeError):
        hopper.cast_rays(np.ones((1, 6)), 0.0)
    with pytest.raises(TypeError):
        isospline.research.VoxelHopper(None)
