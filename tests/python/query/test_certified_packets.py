"""Proofs of rays that are proven together."""

import numpy as np
import pytest

import isospline

NAMES = ["statuses", "t_bounds", "level_bounds", "normal_axes", "normal_angles", "model_distances"]


def bytes_of(hits, order=slice(None)):
    return [getattr(hits, name)[order].tobytes() for name in NAMES]


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_a_proof_does_not_depend_on_the_rays_beside(degree):
    rng = np.random.default_rng(degree)
    volume = isospline.Volume(rng.normal(size=(30, 25, 20)), degree=degree, spacing=(1, 0.7, 1.3))
    far = np.eye(4)
    far[:3, 3] = 5, 3, 2
    surfaces = [isospline.Isosurface(volume, level) for level in (0.5, 1)]
    scene = isospline.Scene([surfaces[0], (surfaces[1], far)])
    rays = isospline.camera_for(scene).rays((40, 30)).reshape(-1, 6)
    hits, order = scene.cast_rays(rays, certify=True), rng.permutation(len(rays))
    assert bytes_of(scene.cast_rays(rays[order], certify=True)) == bytes_of(hits, order)
    for i in range(0, len(rays), 100):
        assert bytes_of(scene.cast_rays(rays[i : i + 1], certify=True)) == bytes_of(hits, slice(i, i + 1))
    assert (hits.statuses == 1).sum() > 300


def test_hits_next_to_another_surface_have_no_bound_on_the_level():
    volume = isospline.Volume(np.random.default_rng(1).normal(size=(20, 20, 20)))
    scene = isospline.Scene([isospline.Isosurface(volume, level) for level in (0.5, 0.5 + 1e-14)])
    hits = scene.cast_rays(isospline.camera_for(scene).rays((40, 40)), certify=True)
    assert (hits.statuses == 1).sum() > 100
    assert (hits.level_bounds[hits.statuses != 2] == 0).all()
