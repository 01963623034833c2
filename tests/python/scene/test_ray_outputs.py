"""Outputs of cast_rays: their names, their precision, and the precision of rays."""

import itertools

import numpy as np
import pytest
from hit_outputs import ALL_OUTPUTS
from spheres import CENTER, mesh_sphere, moved, sphere

import isospline

DEFAULT = ("t_hit", "geometry_ids", "primitive_ids", "primitive_normals")
REAL = (
    *("t_hit", "primitive_normals", "positions", "gradient_magnitudes", "dt_dlevel", "dt_dorigin", "dt_ddirection"),
    *("dnormal_dlevel", "dnormal_dorigin", "dnormal_ddirection", "coefficient_weights"),
    "coefficient_gradients",
)


@pytest.fixture(scope="module")
def scene():
    scene = isospline.Scene([sphere()])
    scene.add(mesh_sphere(5.0), moved(*(CENTER + (9, 0, 4))))
    return scene


@pytest.fixture(scope="module")
def rays():
    """Rays of a picture in single precision: hits of both objects, and misses of the scene's box."""
    camera = isospline.PerspectiveCamera(np.add(CENTER, (5, -60, 8)), CENTER, field_of_view=45)
    return camera.rays((44, 36)).astype(np.float32)


@pytest.mark.parametrize("coherent", [False, True])
def test_each_output_is_the_same_whatever_is_asked_for_beside_it(scene, rays, coherent):
    everything = scene.cast_rays(rays, coherent=coherent, outputs=ALL_OUTPUTS)
    assert tuple(everything) == ALL_OUTPUTS
    assert {0, 1, isospline.INVALID_ID} == set(np.unique(everything["geometry_ids"]))
    pairs = [(name,) for name in ALL_OUTPUTS] + list(itertools.combinations(ALL_OUTPUTS, 2))
    for asked in [*pairs, DEFAULT]:
        hits = scene.cast_rays(rays, coherent=coherent, outputs=asked)
        assert set(hits) == set(asked)
        for name in asked:
            np.testing.assert_array_equal(hits[name], everything[name])
    assert tuple(scene.cast_rays(rays, coherent=coherent)) == DEFAULT
    assert scene.cast_rays(rays, coherent=coherent, outputs=()) == {}


@pytest.mark.parametrize("coherent", [False, True])
def test_float32_outputs_are_the_float64_ones_rounded(scene, rays, coherent):
    double, single = (
        scene.cast_rays(rays, coherent=coherent, outputs=ALL_OUTPUTS, dtype=dtype) for dtype in (np.float64, "float32")
    )
    for name in ALL_OUTPUTS:
        if name in REAL:
            assert double[name].dtype == np.float64 and single[name].dtype == np.float32
            np.testing.assert_array_equal(single[name], double[name].astype(np.float32))
        else:
            np.testing.assert_array_equal(single[name], double[name])


@pytest.mark.parametrize("coherent", [False, True])
def test_a_hit_has_a_finite_t_in_float32(scene, coherent):
    """Of a short direction, it is beyond the largest float32: inf would say that the ray misses."""
    ray = np.array([(*np.add(CENTER, (0, -30, 0)), 0, 1e-40, 0)], np.float32)
    hits = scene.cast_rays(ray, coherent=coherent)
    assert hits.geometry_ids[0] == 0 and hits.t_hit[0] == np.finfo(np.float32).max


@pytest.mark.parametrize("count", [0, 1, 15, 16, 17, 1023, 1025, 1584])
@pytest.mark.parametrize("coherent", [False, True])
def test_float32_rays_are_those_of_float64(scene, rays, coherent, count):
    """In one packet, in many, and in one that is not full."""
    some = rays.reshape(-1, 6)[:count]
    single = scene.cast_rays(some, coherent=coherent, dtype=np.float64)
    double = scene.cast_rays(some.astype(np.float64), coherent=coherent)
    for name in DEFAULT:
        np.testing.assert_array_equal(single[name], double[name])
    np.testing.assert_array_equal(scene.test_occlusions(some), np.isfinite(double["t_hit"]))


def test_the_hopper_has_the_same_outputs(rays):
    surface = sphere()
    scene, hopper = isospline.Scene([surface]), isospline.research.VoxelHopper(surface)
    for asked in [(name,) for name in ALL_OUTPUTS] + [ALL_OUTPUTS]:
        expected, found = (each.cast_rays(rays, outputs=asked) for each in (scene, hopper))
        for name in asked:
            np.testing.assert_array_equal(found[name], expected[name])


@pytest.mark.parametrize(
    "outputs, error, message",
    [
        (("t_hit", "uv"), ValueError, 'outputs: expected names among "t_hit", .*"coefficient_gradients", got "uv"'),
        ("t_hit", TypeError, r"outputs: expected a sequence of names, such as \(\"t_hit\",\), got 't_hit'"),
        (None, TypeError, "outputs: expected a sequence of names, .* got None"),
        ((1,), TypeError, "outputs: expected names, got 1"),
    ],
)
def test_bad_outputs(scene, rays, outputs, error, message):
    for caster in (scene, isospline.research.VoxelHopper(sphere())):
        with pytest.raises(error, match=f"^{message}"):
            caster.cast_rays(rays, outputs=outputs)


@pytest.mark.parametrize("dtype", ["float16", "int32", "real", ">f4", 3])
def test_bad_dtypes(scene, rays, dtype):
    with pytest.raises((ValueError, TypeError), match="^dtype: expected float32 or float64"):
        scene.cast_rays(rays, dtype=dtype)


def test_secondary_rays_need_the_outputs_that_they_come_from(scene):
    ray, towards = [(*np.add(CENTER, (0, -30, 0)), 0, 1, 0)], [(0, -1, 0)]
    hits = scene.cast_rays(ray, outputs=("t_hit", "geometry_ids", "primitive_normals"))
    with pytest.raises(ValueError, match='^hits: expected what cast_rays returned, with "primitive_ids" among its'):
        scene.secondary_rays(ray, hits, towards)
    with pytest.raises(ValueError, match=r'^hits\["t_hit"\]: expected float64, .* got float32'):
        scene.secondary_rays(ray, scene.cast_rays(ray, dtype="float32"), towards)
    assert not scene.test_occlusions(scene.secondary_rays(ray, scene.cast_rays(ray), towards))[0]


@pytest.mark.parametrize("shape", [(), (0,), (2, 0), (2, 3)])
def test_a_list_without_numbers_has_no_columns(shape):
    scene = isospline.Scene(mesh_sphere(5.0))
    hits = scene.cast_rays(
        np.broadcast_to((0, 0, 9, 0, 0, -1.0), (*shape, 6)), outputs=("t_hit", "coefficient_weights")
    )
    assert hits.coefficient_weights.shape == (*shape, 0)
    assert hits.to_csv().splitlines() == ["t_hit", *map(str, hits.t_hit.ravel())]
