"""Stores: their coefficients, ranges and coarser levels compared with those in memory, and their metadata."""

import numpy as np
import pytest

import isospline

zarr = pytest.importorskip("zarr")

from isospline.store import read_metadata, read_ranges
from isospline.store.blocks import inside_indices
from isospline.store.model import Model, PrefilterShard
from isospline.store.sources.source import ArraySource


def samples(shape, dtype=np.float32, seed=0):
    """Noise on a slope: samples beyond a halo are not small."""
    noise = np.random.default_rng(seed).normal(size=shape) * 1000 + np.arange(shape[-1]) * 10
    return (noise + 20000).astype(dtype)


def scan(shape):
    """Tissue in air, each of one value: in constant samples, rounding may depend on the start of a recursion."""
    z, y, x = np.ogrid[tuple(slice(size) for size in shape)]
    inside = np.hypot(x - 80, y - 30) + 0.1 * z < 37
    return np.where(inside, 40, -1000).astype(np.int16) + 660 * ((x // 16 + y // 16 + z // 16) % 5 == 0).astype(
        np.int16
    )


def coefficients_of(volume):
    """The float32 coefficients of a volume, minus its offset, from its pickled state."""
    state = volume.__getstate__()
    padding = volume.degree // 2
    z, y, x = (size + 2 * padding for size in volume.shape)
    stored = state["coefficients"]
    slices = (len(stored) - 8) // z
    stored = stored[: slices * z].reshape(z, slices)[:, : x * y].reshape(z, y, x)
    inside = slice(padding, -padding or None)
    return stored[inside, inside, inside].copy()


def by_blocks(data, offset, *options):
    """The coefficients of a volume, computed in blocks of 50 x 70 x 64 samples."""
    task = PrefilterShard(None, "coefficients/0", ArraySource(data), Model(*options), offset)
    got = np.empty(data.shape, np.float32)
    for z in range(0, data.shape[0], 50):
        for x in range(0, data.shape[2], 64):
            box = ((z, min(z + 50, data.shape[0])), (0, data.shape[1]), (x, min(x + 64, data.shape[2])))
            got[z : z + 50, :, x : x + 64] = task.coefficients(box, *task.samples(box))
    return got


@pytest.mark.sweep(10)
@pytest.mark.slow
@pytest.mark.parametrize("boundary", ["mirror", "periodic"])
@pytest.mark.parametrize(
    "options", [*((degree, "interpolate", 0.0) for degree in range(6)), (2, "smoothing", 0.5), (3, "smoothing", 3.0)]
)
@pytest.mark.parametrize("make", [samples, scan])
def test_blocks_have_the_coefficients_of_the_whole_volume(options, boundary, make):
    degree, filter, smoothing = options
    data = make((150, 70, 170))
    volume = isospline.Volume(data, degree=degree, boundary=boundary, filter=filter, smoothing=smoothing)
    expected = coefficients_of(volume)
    got = by_blocks(data, volume.__getstate__()["offset"], degree, boundary, filter, smoothing)
    # In few places, samples beyond the halo may change the rounding along one of three axes.
    assert (np.abs(got.astype(float) - expected) <= np.spacing(np.abs(expected).max())).all()
    assert (got != expected).mean() < 1e-5


@pytest.mark.parametrize("boundary", ["mirror", "grid-wrap"])
@pytest.mark.parametrize("degree", [2, 3, 4, 5])
def test_blocks_have_the_coefficients_of_scipy(degree, boundary):
    ndimage = pytest.importorskip("scipy.ndimage")
    data = samples((120, 40, 150))
    expected = ndimage.spline_filter(data.astype(float) - 20000, degree, np.float64, boundary)
    got = by_blocks(data, 20000.0, degree, "mirror" if boundary == "mirror" else "periodic")
    # Each axis rounds to float32: 2.3 units at most here.
    assert np.abs(got - expected).max() < 3 * np.spacing(np.float32(np.abs(expected).max()))


@pytest.mark.sweep(5)
@pytest.mark.slow
@pytest.mark.parametrize("degree", range(6))
@pytest.mark.parametrize("boundary", ["mirror", "periodic"])
def test_store_reads_back(degree, boundary, tmp_path):
    data = samples((40, 50, 70))
    volume = isospline.Volume(data, degree=degree, boundary=boundary, spacing=(1, 2, 3), origin=(5, 6, 7))
    path = isospline.convert(
        data, tmp_path / "a.zarr", degree=degree, boundary=boundary, spacing=(1, 2, 3), origin=(5, 6, 7), chunk=16
    )
    store = read_metadata(path)
    finest = store.scales[0]
    assert finest.shape == data.shape
    expected = coefficients_of(volume)
    got = zarr.open_array(path, path="coefficients/0")[:]
    assert (np.abs(got - expected) <= np.spacing(np.abs(expected).max())).all()
    assert (finest.minimum, finest.maximum, finest.offset) == (
        volume.minimum,
        volume.maximum,
        volume.__getstate__()["offset"],
    )
    for level in store.scales:
        ranges = read_ranges(store, level)
        coefficients = zarr.open_array(path, path=level.path)[:]
        cells = [size - degree % 2 for size in level.shape]
        for z, y, x in [(0, 0, 0), (1, 2, 3), tuple((size - 1) // 8 for size in cells)]:
            picked = []
            for at, count, size in zip((z, y, x), cells, level.shape):
                last = min(8 * at + 7, count - 1)
                picked.append(
                    inside_indices(np.arange(8 * at - degree // 2, last + degree - degree // 2 + 1), size, boundary)
                )
            brick = coefficients[np.ix_(*picked)]
            child = (x % 2) + 2 * (y % 2) + 4 * (z % 2)
            assert ranges[z // 2, y // 2, x // 2, 0, child] == brick.min()
            assert ranges[z // 2, y // 2, x // 2, 1, child] == brick.max()


@pytest.mark.parametrize("name", ["spacing", "origin", "direction"])
@pytest.mark.parametrize("value", ["wide", [1, 2, "x"], [[1, 2], [3]], [1j, 2, 3]])
def test_a_place_that_is_no_numbers_is_named(name, value, tmp_path):
    with pytest.raises((TypeError, ValueError), match=rf"^{name}: expected finite numbers of shape \(3, ?3?\), got "):
        isospline.convert(np.zeros((8, 8, 8)), tmp_path / "a.zarr", **{name: value})
