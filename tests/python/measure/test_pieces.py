"""Pieces of solids: both ways to list them, levels that equal samples, and clips; SciPy's labels, and closed forms."""

import math

import numpy as np
import pytest
from scipy import ndimage, spatial

import isospline


def listed(found):
    """The components in an order that does not depend on how they were listed."""
    return sorted(map(tuple, np.column_stack([found.bounds.reshape(-1, 6), found.cell_counts, found.inside_counts])))


def check_measures(surface):
    """Both ways list the same components, whose measures add up to those of the surface; returns the measured ones."""
    counted, measured = surface.components(), surface.components(measured=True, order=3)
    assert listed(counted) == listed(measured)
    assert np.all(measured.enclosed_volumes[:-1] >= measured.enclosed_volumes[1:])
    for parts, whole in (
        (measured.enclosed_volumes, surface.enclosed_volume(order=3)),
        (measured.areas, surface.area(order=3)),
    ):
        assert parts.sum() == pytest.approx(whole.value, rel=1e-9, abs=1e-9)
    return measured


def some_half_space(volume, rng):
    lower, upper = volume.bounds
    point = rng.uniform(0.7 * lower + 0.3 * upper, 0.3 * lower + 0.7 * upper)
    return isospline.HalfSpace(point, rng.normal(size=3))


@pytest.mark.sweep(4)
@pytest.mark.filterwarnings("ignore:level")
@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("seed", range(8))
def test_both_ways_list_the_same_components(degree, seed):
    """Small volumes of integers and of real numbers, at levels that equal samples, with and without a clip."""
    rng = np.random.default_rng([seed, degree])
    shape = rng.integers(3, 7, 3)
    samples = rng.integers(0, rng.choice([2, 3, 5]), shape).astype(float) if seed % 4 else rng.random(shape)
    samples = samples.astype(np.float32)  # as coefficients
    volume = isospline.Volume(samples, degree=degree, spacing=rng.uniform(0.5, 2, 3), origin=rng.uniform(-9, 9, 3))
    inside = ("above", "below")[seed // 2 % 2]
    clip = [some_half_space(volume, rng) for _ in range(1 + seed % 3)]
    for level in (samples.max(), samples.min(), rng.choice(samples.ravel())):
        for options in ({}, {"clip": clip, "capped": bool(seed % 2)}):
            surface = isospline.Isosurface(volume, level, inside=inside, closed=bool(seed % 3), **options)
            found = check_measures(surface)
            if degree == 1 and not options:
                solid = (samples >= level) == (inside == "above")
                assert len(found.areas) == ndimage.label(solid, np.ones((3, 3, 3)))[1]


@pytest.mark.parametrize("measured", [False, True])
def test_pieces_without_volume_are_components(measured):
    """At the maximum: an isolated sample, a line of samples, a plate of them, and a cube."""
    samples = np.zeros((9, 9, 20))
    samples[4, 4, 1] = samples[4, 4, 4:7] = samples[3:6, 4, 9:12] = samples[3:6, 3:6, 15:18] = 1
    surface = isospline.Isosurface(isospline.Volume(samples, degree=1), 1)
    found = surface.components(measured=measured)
    assert len(found.bounds) == 4
    if measured:
        np.testing.assert_allclose(found.enclosed_volumes, [8, 0, 0, 0], atol=1e-12)
        assert found.areas.sum() == pytest.approx(surface.area().value)


@pytest.mark.sweep(1)
@pytest.mark.filterwarnings("ignore:level")
@pytest.mark.parametrize("degree", [2, 3])
def test_touching_the_level_makes_no_component_of_smooth_models_but_a_plate_does(degree):
    """Coefficients, not samples: the model's maximum over the middle of a ridge is known exactly."""
    peak = {2: 0.75, 3: 4 / 6}[degree]
    single, ridge, plate = np.zeros((3, 7, 7, 7))
    single[3, 3, 3] = ridge[3, :, 3] = plate[3] = 1
    for coefficients, dimension in ((single, 3), (ridge, 2), (plate, 1)):
        volume = isospline.Volume(coefficients * 2.0**10, degree=degree, filter="none")
        (level,) = volume.sample([(3, 3, 3)])
        assert level == pytest.approx(2.0**10 * peak**dimension, rel=1e-6)
        for factor, count in ((0.999, 1), (1.001, 0)):
            assert len(check_measures(isospline.Isosurface(volume, factor * level)).areas) == count
        surface = isospline.Isosurface(volume, level)
        assert len(check_measures(surface).areas) <= 1
        if degree == 2:  # all numbers are exact
            assert len(surface.components().bounds) == (dimension == 1)


def test_a_clip_cuts_a_dumbbell_in_two_and_changes_measures():
    """Two balls of radius 6 joined by a thin rod, whose middle is cut away on one side of an oblique plane."""
    z, y, x = np.mgrid[0:20, 0:24, 0:48].astype(float)
    balls = [6 - np.sqrt((x - c) ** 2 + (y - 10) ** 2 + (z - 9.6) ** 2) for c in (10, 36)]
    rod = np.minimum(1.5 - np.hypot(y - 10, z - 9.6), np.minimum(x - 10, 36 - x))
    volume = isospline.Volume(np.maximum(np.maximum(*balls), rod), degree=3)
    assert len(isospline.Isosurface(volume, 0).components().bounds) == 1
    # Each ball keeps a cap of height 3: the rod is outside of the clip.
    clip = isospline.HalfSpace((0, 13, 0), (0, 1, 0))
    surface = isospline.Isosurface(volume, 0, clip=clip, capped=True)
    found = check_measures(surface)
    np.testing.assert_allclose(found.enclosed_volumes, math.pi * 9 * (6 - 1), rtol=0.01)
    np.testing.assert_allclose(found.areas, 2 * math.pi * 6 * 3 + math.pi * (36 - 9), rtol=0.01)
    assert np.all(found.bounds[:, 0, 1] == 13) and np.all(
        found.bounds[:, 1, 1] == 16 + 1 * (found.bounds[:, 1, 1] > 16)
    )
    # Those that the largest piece is cut into are all kept.
    kept = isospline.Isosurface(volume, 0, clip=clip, capped=True, largest=1)
    assert listed(kept.components()) == listed(surface.components())
    # A plane across the rod: a ball with half of the rod, and nothing else.
    half = isospline.Isosurface(volume, 0, clip=isospline.HalfSpace((23, 0, 0), (-1, 0, 0)))
    assert len(check_measures(half).areas) == 1
    assert half.components().bounds[0, 1, 0] == 23
    # Masks end at the clip: exactly, or with the cells that it cuts.
    whole = isospline.Isosurface(volume, 0)
    places = np.indices(volume.shape)[::-1].reshape(3, -1).T
    samples = (whole.contains(places) & surface.contains(places)).reshape(volume.shape)
    np.testing.assert_array_equal(surface.to_mask(), samples)
    cells = surface.to_mask(whole_cells=True)
    assert (cells >= samples).all() and cells.sum() < whole.to_mask(whole_cells=True).sum()


@pytest.mark.sweep(6)
@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_clipped_components_are_those_of_finely_sampled_points(degree, seed):
    """Two tori, whose holes are some cells wide, in an oblique slab, and cut by a third plane."""
    rng = np.random.default_rng([seed, degree])
    z, y, x = np.mgrid[0:24, 0:16, 0:42].astype(float)
    tori = [3 - np.hypot(np.hypot(x - c, z - 11.3) - 6.5, y - 7.6) for c in (10.4, 30.5)]
    volume = isospline.Volume(np.maximum(tori[0], tori[1] - 1), degree=degree)
    normals = np.array([(0.05, 0.2, 1), (-0.05, 0.1, -1), (1, 0.2, -0.1)]) + rng.uniform(-0.05, 0.05, (3, 3))
    starts = [(20, 8, 9.2), (20, 8, 13.7), (rng.uniform(2, 5), 8, 11)]
    clip = [isospline.HalfSpace(start, normal) for start, normal in zip(starts, normals)]
    surface = isospline.Isosurface(volume, 0, clip=clip)
    found = check_measures(surface)
    step = 0.25
    points = np.stack(np.mgrid[0:23:step, 0:15:step, 0:41:step][::-1], axis=-1) + step / 2
    solid = volume.sample(points.reshape(-1, 3)).reshape(points.shape[:3]) > 0
    for half_space in clip:
        solid &= (points - half_space.point) @ half_space.normal > 0
    labels, _ = ndimage.label(solid)
    volumes = np.bincount(labels[solid])[1:] * step**3
    order = [i for i in np.argsort(-volumes) if volumes[i] > 0.5]  # no slivers at edges, where few points are
    assert len(found.areas) == len(order) > 2
    np.testing.assert_allclose(found.enclosed_volumes, volumes[order], rtol=0.03)
    where = ndimage.find_objects(labels)
    for box, label in zip(found.bounds, order):
        inner = np.array([(each.start, each.stop) for each in where[label]])[::-1].T * step
        assert np.all(box[0] < inner[0] + step) and np.all(box[1] > inner[1] - step)
        assert np.all(box[0] > inner[0] - 1.5) and np.all(box[1] < inner[1] + 1.5)


@pytest.mark.parametrize("count", range(1, 6))
def test_boxes_of_clipped_components_are_those_of_the_polyhedron(count):
    """A solid that fills the volume; SciPy's corners of the part in several half-spaces."""
    rng = np.random.default_rng(count)
    volume = isospline.Volume(np.ones((4, 5, 6)), degree=1, spacing=(1, 2, 0.5), origin=(3, 4, 5))
    clip = []
    while len(clip) < count:
        half_space = some_half_space(volume, rng)
        if (np.mean(volume.bounds, axis=0) - half_space.point) @ half_space.normal > 0.1:
            clip.append(half_space)
    surface = isospline.Isosurface(volume, 0.5, clip=clip, capped=True)
    sides = [(*-np.asarray(each.normal), np.dot(each.normal, each.point)) for each in clip]
    lower, upper = volume.bounds
    sides += [(*-axis, low) for axis, low in zip(np.eye(3), lower)] + [
        (*axis, -high) for axis, high in zip(np.eye(3), upper)
    ]
    corners = spatial.HalfspaceIntersection(np.array(sides), np.mean(volume.bounds, axis=0)).intersections
    expected = [[corners.min(axis=0), corners.max(axis=0)]]
    np.testing.assert_allclose(surface.components().bounds, expected, atol=1e-9)
    assert surface.components(measured=True).enclosed_volumes == pytest.approx(spatial.ConvexHull(corners).volume)
