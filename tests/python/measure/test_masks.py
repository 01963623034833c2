"""`Isosurface.to_mask`: the samples of the solid, beside `Volume.sample` at all samples and the labels of SciPy."""

import numpy as np
import pytest
from scipy import ndimage

import isospline

pytestmark = pytest.mark.filterwarnings("ignore:level .* is out of the data's range")
GRID = {"spacing": (0.7, 0.9, 1.4), "origin": (3.0, -2.0, 1.0)}


def noise(seed=0, shape=(15, 18, 21), scale=1.2):
    return ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=shape), scale).astype(np.float32)


def positions(volume):
    """World positions of all samples, in the order of the array."""
    shape = volume.shape if volume.axes == "zyx" else volume.shape[::-1]
    index = np.indices(shape)[::-1].transpose(1, 2, 3, 0)
    world = np.asarray(volume.origin) + index * volume.spacing @ np.asarray(volume.direction).T
    return world if volume.axes == "zyx" else world.transpose(2, 1, 0, 3)


def kept_by(mask, degree):
    """The samples in the cells that a mask keeps: those with all corners True, for odd degrees."""
    if degree % 2 == 0:
        return mask
    cells = ndimage.minimum_filter(mask, size=2, origin=-1, mode="nearest")[:-1, :-1, :-1]
    return ndimage.maximum_filter(np.pad(cells, ((0, 1),) * 3), size=2, origin=0, mode="constant")


@pytest.mark.parametrize("axes", ["zyx", "xyz"])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_the_mask_is_f_at_the_samples(degree, axes):
    turned = np.array([(0.8, -0.6, 0), (0.6, 0.8, 0), (0, 0, 1)])
    volume = isospline.Volume(noise(), degree=degree, axes=axes, direction=turned, **GRID)
    value = volume.sample(positions(volume))
    for level in (0.0, 0.05, -1.0, 1.0):
        above, below = (isospline.Isosurface(volume, level, inside=side) for side in ("above", "below"))
        np.testing.assert_array_equal(above.to_mask(), value >= level)
        np.testing.assert_array_equal(below.to_mask(), value < level)
        assert above.to_mask().dtype == bool and above.to_mask().shape == volume.shape


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_mask_and_clip_leave_their_samples(degree):
    volume = isospline.Volume(noise(1), degree=degree, **GRID)
    places, keep = positions(volume), np.random.default_rng(2).random(volume.shape) < 0.9
    point, normal = places[7, 9, 10], np.array((0.3, -0.5, 0.8))
    for side in ("above", "below"):
        solid = (volume.sample(places) >= 0) == (side == "above")
        surface = isospline.Isosurface(volume, 0.0, inside=side, mask=keep)
        np.testing.assert_array_equal(surface.to_mask(), solid & kept_by(keep, degree))
        # The planes of a box pass through samples, which are in the solid.
        for clip in (isospline.HalfSpace(point + 0.01, normal), isospline.Box(places[2, 3, 4], places[9, 8, 15])):
            surface = isospline.Isosurface(volume, 0.0, inside=side, clip=clip)
            if isinstance(clip, isospline.Box):
                inside = np.zeros(volume.shape, bool)
                inside[2:10, 3:9, 4:16] = True
            else:
                inside = (places - point - 0.01) @ normal >= 0
            np.testing.assert_array_equal(surface.to_mask(), solid & inside)


@pytest.mark.parametrize("inside", ["above", "below"])
def test_the_largest_piece_is_that_of_scipy(inside):
    """At degree 1, pieces are those of samples with 26 neighbours; the largest has by far the most samples."""
    data = noise(3, (24, 24, 24), 1.6)
    sign = 1 if inside == "above" else -1
    level = float(np.quantile(data, 0.8 if sign > 0 else 0.2))
    volume = isospline.Volume(data, degree=1)
    solid = volume.sample(positions(volume)) * sign > level * sign
    labels, _ = ndimage.label(solid, np.ones((3, 3, 3)))
    counts = np.sort(np.bincount(labels.ravel())[1:])
    assert len(counts) > 4 and counts[-1] > 1.3 * counts[-2]
    surface = isospline.Isosurface(volume, level, inside=inside, largest=1)
    mask = surface.to_mask()
    np.testing.assert_array_equal(mask, labels == 1 + np.bincount(labels.ravel())[1:].argmax())
    assert mask.mean() < solid.mean() and (mask <= surface.to_mask(whole_cells=True)).all()


def test_levels_that_equal_samples():
    """Samples that are coefficients, whose values are exact: those at the level are above it."""
    data = np.random.default_rng(4).integers(0, 4, (7, 8, 9)).astype(np.float32)
    volume = isospline.Volume(data, degree=1, filter="none")
    for level in (1, 2, 3):
        above, below = (isospline.Isosurface(volume, level, inside=side).to_mask() for side in ("above", "below"))
        np.testing.assert_array_equal(above, data >= level)
        np.testing.assert_array_equal(below, data < level)


@pytest.mark.parametrize("dtype", ["u1", "u2", "f4", "f8"])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_samples_at_the_level_but_for_rounding(degree, dtype):
    """Rounded coefficients put f beside samples. Those at the level are above it, as in NumPy; others stay."""
    rng = np.random.default_rng(7)
    largest = {"u1": 255, "u2": 65535, "f4": 300.0, "f8": 0.3}[dtype]
    data = (rng.integers(0, 256, (9, 10, 11)) / 255 * largest).astype(dtype)
    volume = isospline.Volume(data, degree=degree)
    points = positions(volume)
    for at in (float(data[4, 5, 6]), float(data[0, 0, 0]), float(data[8, 3, 0])):
        for level in (at, at - 2e-5 * largest, at + 2e-5 * largest):
            above, below = (isospline.Isosurface(volume, level, inside=side) for side in ("above", "below"))
            for surface, expected in ((above, data >= level), (below, data < level)):
                np.testing.assert_array_equal(surface.to_mask(), expected)
                np.testing.assert_array_equal(surface.contains(points), expected)


def test_the_samples_of_pores_give_the_porosity():
    data = noise(5, (24, 24, 24), 1.5)
    pores = isospline.Isosurface(isospline.Volume(data), 0.02)
    assert pores.to_mask().mean() == pytest.approx(float(pores.enclosed_volume()) / 24**3, rel=0.05)
    largest = isospline.Isosurface(pores.volume, 0.02, largest=1)
    assert largest.to_mask().mean() <= pores.to_mask().mean() < largest.to_mask(whole_cells=True).mean()


def test_masks_of_stores_and_cancelling(tmp_path):
    pytest.importorskip("zarr")
    data = noise(6)
    isospline.convert(data, tmp_path / "a.zarr")
    stored = isospline.Isosurface(isospline.open_volume(tmp_path / "a.zarr"), 0.01)
    np.testing.assert_array_equal(stored.to_mask(), isospline.Isosurface(isospline.Volume(data), 0.01).to_mask())
    with pytest.raises(isospline.Cancelled):
        stored.to_mask(progress=lambda done: False)
