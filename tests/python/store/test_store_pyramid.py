"""The coarser levels of stores, compared with dense least squares."""

import numpy as np
import pytest

import isospline

zarr = pytest.importorskip("zarr")

from isospline.store import read_metadata
from isospline.store.pyramid import POLES, coarse_size, level_shapes, reduction

DEGREES, BOUNDARIES = range(6), ("mirror", "periodic")


def box(size, degree, boundary):
    """The ends of a level's box, or of its period, along an axis, in units of samples."""
    if degree % 2 == 0:
        return -0.5, size - 0.5
    return 0.0, size - (1.0 if boundary == "mirror" else 0.0)


def nodes(size, degree, boundary):
    """Gauss-Legendre nodes and weights of all half cells of a level's box; the level has `size` samples."""
    low, high = box(size, degree, boundary)
    points, weights = np.polynomial.legendre.leggauss(degree + 1)
    ends = np.arange(low, high, 0.5)
    return (ends[:, None] + (points + 1) / 4).ravel(), np.tile(weights / 4, len(ends))


def values(coefficients, degree, boundary, positions):
    """The values of the core's model with these coefficients along x."""
    volume = isospline.Volume(coefficients[None, None], degree=degree, boundary=boundary, filter="none")
    return volume.sample(np.stack([positions, 0 * positions, 0 * positions], axis=-1))


def basis(size, degree, boundary, positions):
    """The values of all B-splines along an axis, as columns."""
    return np.stack([values(row, degree, boundary, positions) for row in np.eye(size)], axis=-1)


@pytest.mark.slow
@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("size", [2, 3, 4, 7, 12, 33, 90])
def test_rows_equal_those_of_dense_least_squares(size, degree, boundary):
    coarse = coarse_size(size, degree, boundary)
    positions, weights = nodes(coarse, degree, boundary)
    design = basis(coarse, degree, boundary, positions)
    fine = basis(size, degree, boundary, 2 * positions + (degree % 2 == 0) / 2)
    root = np.sqrt(weights)[:, None]
    expected = np.linalg.lstsq(root * design, root * fine, rcond=None)[0]
    for first, last in ((0, coarse), (0, 1), (coarse // 2, coarse // 2 + 1), (coarse - 1, coarse)):
        block = reduction(first, last, size, degree, boundary)
        got = np.zeros((last - first, size))
        got[:, block.fine] = block.apply(np.eye(len(block.fine)))
        assert np.abs(got - expected[first:last]).max() < 1e-9


def test_halos_follow_from_the_largest_poles():
    for degree, pole in enumerate(POLES):
        # The Gram matrix of a long line; its inverse decays by the pole.
        positions, weights = nodes(61, degree, "mirror")
        design = basis(61, degree, "mirror", positions)
        inverse = np.linalg.inv(design.T @ (weights[:, None] * design))[30]
        if degree == 0:
            assert np.abs(inverse[31:]).max() < 1e-12
        else:
            assert np.isclose(abs(inverse[44] / inverse[43]), pole, rtol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("degree", [2, 3])
def test_level_is_the_least_squares_fit_in_space(degree, tmp_path):
    data = np.random.default_rng(3).normal(size=(3, 4, 66)).astype(np.float32)
    place = dict(spacing=(1.0, 2.0, 3.0), origin=(4.0, 5.0, 6.0), direction=[[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    path = isospline.convert(data, tmp_path / "a.zarr", degree=degree, chunk=8, **place)
    fine, coarse = read_metadata(path).scales
    assert coarse.shape == level_shapes(data.shape, degree, "mirror")[1]

    # World coordinates of the coarse level; the fine level is a volume in the same world.
    axes = [nodes(size, degree, "mirror") for size in coarse.shape]
    z, y, x = np.meshgrid(*(positions for positions, _ in axes), indexing="ij")
    weights = axes[0][1][:, None, None] * axes[1][1][:, None] * axes[2][1]
    index = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    world = np.asarray(coarse.origin) + (index * coarse.spacing) @ coarse.direction.T
    expected_values = isospline.Volume(data, degree=degree, **place).sample(world)
    design = np.ones((1, 1))
    for size, (positions, _) in zip(coarse.shape, axes):
        design = np.kron(design, basis(size, degree, "mirror", positions))
    root = np.sqrt(weights.ravel())
    fit = np.linalg.lstsq(root[:, None] * design, root * expected_values, rcond=None)[0].reshape(coarse.shape)
    got = zarr.open_array(path, path=coarse.path)[:] + coarse.offset
    assert np.abs(got - fit).max() < 1e-6
    assert fine.offset == coarse.offset


def test_levels_end_at_64_and_keep_constants(tmp_path):
    path = isospline.convert(np.full((2, 130, 300), 7, np.uint8), tmp_path / "a.zarr", chunk=32)
    levels = read_metadata(path).scales
    assert [level.shape for level in levels] == [(2, 130, 300), (1, 65, 150), (1, 33, 75), (1, 17, 38)]
    assert [level.spacing for level in levels] == [(1, 1, 1), (2, 2, 2), (4, 4, 2), (8, 8, 2)]
    for level in levels:
        assert (zarr.open_array(path, path=level.path)[:] == 0).all() and level.offset == 7
