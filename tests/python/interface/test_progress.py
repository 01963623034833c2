"""Progress of queries: finished fractions, and cancellation."""

import numpy as np
import pytest

import isospline
from isospline import volumes

RANDOM = np.random.default_rng(5)


@pytest.fixture(scope="module")
def surface():
    field = volumes.torus()
    return isospline.Isosurface(field.volume(48), field.level)


@pytest.fixture(scope="module")
def scene(surface):
    return isospline.Scene(surface)


POINTS = RANDOM.uniform(-1, 1, (20_000, 3))
RAYS = np.concatenate([3 * POINTS, -POINTS + RANDOM.uniform(-0.3, 0.3, POINTS.shape)], axis=1)

QUERIES = {
    "Volume.sample": lambda scene, surface, progress: surface.volume.sample(POINTS, progress=progress),
    "Volume.coefficient_weights": lambda scene, surface, progress: surface.volume.coefficient_weights(
        POINTS[:200], progress=progress
    ),
    **{
        f"Isosurface.{name}": lambda scene, surface, progress, name=name: getattr(surface, name)(
            POINTS[:200], progress=progress
        )
        for name in ("contains", "closest_points", "signed_distance", "thickness")
    },
    "Isosurface.contains, proven": lambda scene, surface, progress: surface.contains(
        POINTS, certify=True, progress=progress
    ),
    "Isosurface.sample_points": lambda scene, surface, progress: surface.sample_points(20_000, progress=progress),
    **{
        f"Scene.{name}": lambda scene, surface, progress, name=name: getattr(scene, name)(
            POINTS[:200], progress=progress
        )
        for name in ("closest_points", "signed_distance", "occupancy")
    },
    **{
        f"Scene.{name}": lambda scene, surface, progress, name=name: getattr(scene, name)(RAYS, progress=progress)
        for name in ("cast_rays", "test_occlusions", "list_intersections", "count_intersections")
    },
    **{
        f"Scene.{name}, proven": lambda scene, surface, progress, name=name: getattr(scene, name)(
            RAYS, certify=True, progress=progress
        )
        for name in ("cast_rays", "test_occlusions", "count_intersections")
    },
    "VoxelHopper.cast_rays": lambda scene, surface, progress: isospline.research.VoxelHopper(surface).cast_rays(
        RAYS, progress=progress
    ),
}


def test_what_a_query_makes_on_its_way_is_not_told_as_the_query(rng):
    surface = isospline.Isosurface(isospline.Volume(rng.normal(size=(128, 128, 128))), 3.0)
    told = []
    surface.closest_points(rng.uniform(-900, 900, (2000, 3)), progress=told.append)
    assert len(told) > 2 and told == sorted(told) and 0 < told[-1] <= 1


@pytest.mark.parametrize("name", QUERIES)
def test_queries_tell_what_is_finished(scene, surface, name):
    told = []
    found = QUERIES[name](scene, surface, told.append)
    assert told[0] == 0 and told == sorted(told) and told[-1] <= 1
    without = QUERIES[name](scene, surface, None)
    same = np.testing.assert_array_equal
    if isinstance(found, dict):
        for key, values in without.items():
            same(found[key], values)
    else:
        same(
            np.asarray(found[0] if isinstance(found, tuple) else found),
            without[0] if isinstance(found, tuple) else without,
        )


@pytest.mark.parametrize("name", QUERIES)
def test_queries_can_be_cancelled(scene, surface, name):
    with pytest.raises(isospline.Cancelled):
        QUERIES[name](scene, surface, lambda fraction: False)


def test_a_long_query_ends_soon_after_it_is_cancelled(scene):
    told = []
    rays = np.concatenate([RAYS] * 100)

    def progress(fraction):
        told.append(fraction)
        return fraction == 0

    with pytest.raises(isospline.Cancelled):
        scene.cast_rays(rays, coherent=False, progress=progress)
    assert told[-1] < 1
