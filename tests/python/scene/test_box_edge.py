"""The edge of Embree's boxes: a different index, but the same hits."""

import numpy as np
import pytest

import isospline

EDGES = [16, 8, 4, 2, 1]


@pytest.fixture(scope="module")
def surface():
    rng = np.random.default_rng(11)
    samples = rng.standard_normal((23, 38, 29))
    return isospline.Isosurface(isospline.Volume(samples), 0.4)


@pytest.fixture(scope="module")
def rays(surface):
    rng = np.random.default_rng(12)
    lower, upper = isospline.Scene([surface]).bounds
    origins = rng.uniform(lower - 5, upper + 5, (4000, 3))
    return np.hstack([origins, rng.uniform(lower, upper, (4000, 3)) - origins])


@pytest.mark.parametrize("edge", EDGES[1:])
def test_hits_do_not_depend_on_the_edge_of_boxes(surface, rays, edge):
    by_default, scene = isospline.Scene([surface]), isospline.research.scene([surface], box_edge=edge)
    for coherent in (False, True):
        expected = by_default.cast_rays(rays, coherent=coherent)
        hits = scene.cast_rays(rays, coherent=coherent)
        assert np.isfinite(expected["t_hit"]).mean() > 0.5
        for name in expected:
            np.testing.assert_array_equal(hits[name], expected[name])
    for coherent in (False, True):
        occluded = scene.test_occlusions(rays, coherent=coherent)
        np.testing.assert_array_equal(occluded, by_default.test_occlusions(rays))
    np.testing.assert_array_equal(scene.count_intersections(rays), by_default.count_intersections(rays))
    surface.level = 0.1
    np.testing.assert_array_equal(scene.cast_rays(rays)["t_hit"], by_default.cast_rays(rays)["t_hit"])
    surface.level = 0.4


@pytest.mark.parametrize("edge", [0, -1, 3, 32])
def test_an_edge_of_boxes_must_be_a_power_of_two(surface, edge):
    with pytest.raises(ValueError, match=f"box_edge: expected 1, 2, 4, 8 or 16 cells, got {edge}"):
        isospline.research.scene([surface], box_edge=edge)


def test_only_small_boxes_make_cells_before_a_ray_enters_them(surface):
    memory = {edge: isospline.research.scene([surface.with_level(0.4)], box_edge=edge).memory for edge in EDGES}
    assert memory[16] < memory[8] < memory[4] < memory[2] < memory[1]
