"""Packets of rays, Embree's instruction sets and its builders: none of them changes a hit."""

import functools
import os
import subprocess
import sys

import numpy as np
import pytest

import isospline

ALL_OUTPUTS = ("t_hit", "geometry_ids", "primitive_ids", "primitive_normals", "positions")


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_packets_find_the_same_bit_for_bit(rng, degree):
    surface = isospline.Isosurface(isospline.Volume(rng.normal(size=(17, 18, 19)), degree=degree), 0.3)
    scene = isospline.Scene([surface, isospline.Mesh([(0, 0, 8), (18, 0, 9), (0, 18, 8)], [(0, 1, 2)])])
    camera = isospline.camera_for(scene)
    for rays in (camera.rays((60, 44)), camera.rays((31, 17)), rng.normal(size=(1001, 6)) * 9 + 9):
        single, packets = (scene.cast_rays(rays, coherent=coherent) for coherent in (False, True))
        assert np.isfinite(single["t_hit"]).any()
        for name in single:
            np.testing.assert_array_equal(packets[name], single[name])
        occluded = scene.test_occlusions(rays, coherent=True)
        np.testing.assert_array_equal(occluded, np.isfinite(single["t_hit"]))
        np.testing.assert_array_equal(occluded, scene.test_occlusions(rays, coherent=False))


@pytest.mark.parametrize("tiny", [-1e-300, -1e-40, -1e-30, -1e-19, -1e-18, -3e-17, -1e-12, -0.0, 1e-30])
def test_packets_of_rays_that_are_nearly_parallel_to_an_axis(rng, tiny):
    """Rays of a packet with directions of the same signs, except the signs of nearly zero parts."""
    surface = isospline.Isosurface(isospline.Volume(rng.normal(size=(17, 18, 19))), 0.3)
    mesh = isospline.Mesh([(0, 0, 20), (18, 0, 20), (0, 18, 20)], [(0, 1, 2)])
    for shown, transform in ((surface, np.eye(4)), (mesh, np.eye(4)), (mesh, np.diag([-1, 1, 1, 1.0]))):
        scene = isospline.Scene()
        scene.add(shown, transform)
        targets = np.einsum("ij,nj->ni", transform[:3, :3], rng.uniform((1, 1, 20), (8, 8, 20), (64, 3)))
        directions = rng.uniform((-1, -1, 0.1), (0, 0, 1), (64, 3))
        directions[::5] = (tiny, tiny, 0.5)
        rays = np.hstack([targets - 40 * directions, directions])
        single, packets = (scene.cast_rays(rays, coherent=coherent) for coherent in (False, True))
        assert np.isfinite(single["t_hit"][::5]).any()
        for name in single:
            np.testing.assert_array_equal(packets[name], single[name])
        occluded = scene.test_occlusions(rays, coherent=True)
        np.testing.assert_array_equal(occluded, np.isfinite(single["t_hit"]))


@pytest.mark.sweep(3)
@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("settled", [False, True])
def test_packets_of_shadow_rays_find_the_same(rng, degree, settled):
    """Rays to one light from the hits of a picture, on the surface itself and beside it."""
    surface = isospline.Isosurface(isospline.Volume(rng.normal(size=(30, 31, 32)), degree=degree), 1.2)
    scene = isospline.Scene([surface, isospline.Mesh([(0, 0, 8), (18, 0, 9), (0, 18, 8)], [(0, 1, 2)])])
    if settled:
        scene.settle()
    rays = isospline.camera_for(scene).rays((120, 88)).reshape(-1, 6)
    rays = rays[np.isfinite(scene.cast_rays(rays)["t_hit"])]
    hits = scene.cast_rays(rays, outputs=ALL_OUTPUTS)
    light = np.array((60.0, 40.0, 70.0))
    leaving = scene.secondary_rays(rays, hits, light - hits["positions"])
    on_surface = np.hstack([hits["positions"], light - hits["positions"]])
    for shadow in (np.hstack([leaving[:, :3], light - leaving[:, :3]]), on_surface, leaving):
        for limits in ({}, {"t_far": 1.0}, {"t_near": 0.01, "t_far": 0.3}):
            single = scene.test_occlusions(shadow, coherent=False, **limits)
            assert 0.05 < single.mean() < 1
            np.testing.assert_array_equal(scene.test_occlusions(shadow, coherent=True, **limits), single)


@pytest.mark.parametrize("rays_of", ["tiles", "rows", "shuffled", "scattered", "one hit"])
def test_how_rays_are_traced_is_found_out_and_changes_no_answer(rng, rays_of):
    """Close rays are traced in packets, those of rows and in no order are sorted, others are traced as they come."""
    scene = isospline.Scene([isospline.Isosurface(isospline.Volume(rng.normal(size=(72, 71, 70))), 0.6)])
    picture = isospline.camera_for(scene).rays((96, 80))
    origins = rng.uniform(-10, 80, (8_000, 3))
    rays = {
        "tiles": picture,
        "rows": picture.reshape(-1, 6),
        "shuffled": rng.permutation(picture.reshape(-1, 6)),
        "scattered": np.hstack([origins, rng.uniform(0, 70, (8_000, 3)) - origins]),
        "one hit": np.hstack([np.full((999, 3), 35.2), rng.normal(size=(999, 3))]),
    }[rays_of]
    expected = scene.cast_rays(rays, coherent=False, outputs=ALL_OUTPUTS)
    hits = scene.cast_rays(rays, outputs=ALL_OUTPUTS)
    assert np.isfinite(hits.t_hit).mean() > 0.05
    assert hits == expected
    occluded = scene.test_occlusions(rays, t_far=2.0)
    np.testing.assert_array_equal(occluded, scene.test_occlusions(rays, t_far=2.0, coherent=False))
    crossings = scene.list_intersections(rays)
    first = crossings.ray_splits[:-1][np.diff(crossings.ray_splits) > 0]
    np.testing.assert_array_equal(crossings.t_hit[first], hits.t_hit[np.isfinite(hits.t_hit)])


def test_bad_rays_are_named_by_their_place_however_rays_are_traced(rng):
    scene = isospline.Scene([isospline.Isosurface(isospline.Volume(rng.normal(size=(72, 71, 70))), 0.6)])
    rays = rng.permutation(isospline.camera_for(scene).rays((160, 128)).reshape(-1, 6))
    rays[[12_345, 17_000], 4] = np.nan
    for coherent in (None, False, True):
        with pytest.raises(ValueError, match="rays: expected finite origins and directions, got nan in ray 12345"):
            scene.cast_rays(rays, coherent=coherent)


def test_build_quality_changes_memory_and_no_hit(rng):
    surface = isospline.Isosurface(isospline.Volume(rng.normal(size=(80, 80, 80))), 0.3)
    rays = np.concatenate([rng.uniform(0, 79, (500, 3)), rng.normal(size=(500, 3))], axis=1)
    scenes = {quality: isospline.Scene([surface], build_quality=quality) for quality in ("low", "medium", "high")}
    hits = {quality: scene.cast_rays(rays) for quality, scene in scenes.items()}
    for name, expected in hits["medium"].items():
        np.testing.assert_array_equal(hits["low"][name], expected)
        np.testing.assert_array_equal(hits["high"][name], expected)
    assert scenes["low"].memory < scenes["medium"].memory
    with pytest.raises(ValueError, match='build_quality: expected "low" or "medium" or "high", got "best"'):
        isospline.Scene(build_quality="best")


TRACE = """
import sys
import numpy as np
import isospline
rng = np.random.default_rng(7)
scene = isospline.Scene([isospline.Isosurface(isospline.Volume(rng.normal(size=(16, 16, 16))), 0.2)])
rays = isospline.camera_for(scene).rays((40, 40))
hits = [scene.cast_rays(rays, coherent=coherent) for coherent in (False, True)]
occluded = [scene.test_occlusions(rays, coherent=coherent) for coherent in (False, True)]
scene.settle()
hits += [scene.cast_rays(rays, coherent=coherent) for coherent in (False, True)]
picture = isospline.render(scene, size=(40, 40))
np.savez(sys.argv[1], *[array for one in hits for array in one.values()], *occluded, picture)
"""


@pytest.fixture(scope="module")
def trace(tmp_path_factory):
    """What a process of its own finds, by its environment."""
    file = tmp_path_factory.mktemp("traces") / "found.npz"

    @functools.cache
    def trace(**environment):
        finished = subprocess.run(
            [sys.executable, "-c", TRACE, str(file)],
            env=os.environ | environment,
            capture_output=True,
            encoding="utf-8",
        )
        if "the processor does not have the instructions" in finished.stderr:
            pytest.skip(f"this processor has no {environment['ISOSPLINE_EMBREE']}")
        assert finished.returncode == 0, finished.stderr
        with np.load(file) as arrays:
            return [arrays[array] for array in arrays]

    return trace


@pytest.mark.slow
@pytest.mark.parametrize("isa", ["sse2", "sse4.2", "avx", "avx2", "avx512"])
def test_instruction_sets_of_embree(trace, isa):
    expected, actual = trace(), trace(ISOSPLINE_EMBREE=f"isa={isa}")
    assert np.isfinite(expected[0]).mean() > 0.3
    for one, other in zip(expected, actual):
        np.testing.assert_array_equal(one, other)
