"""The spline model: coefficients, values and derivatives against SciPy, closed forms and the definition."""

import itertools

import numpy as np
import pytest
import scipy.ndimage
from scipy.interpolate import BSpline

import isospline

SHAPES = [(1, 1, 1), (2, 3, 1), (3, 2, 5), (1, 4, 2), (7, 8, 9), (20, 33, 70), (66, 5, 131)]
BOUNDARIES = [("mirror", "mirror"), ("periodic", "grid-wrap")]


def points_around(rng, shape, count=300, margin=3.0):
    """Points (x, y, z) in a volume and around it, some of them on samples and half-way between."""
    upper = np.array(shape[::-1]) - 1
    points = rng.uniform(-margin, upper + margin, (count, 3))
    points[: count // 6] = np.rint(points[: count // 6])
    points[count // 6 : count // 3] = np.floor(points[count // 6 : count // 3]) + 0.5
    return points


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("degree", [2, 3, 4, 5])
@pytest.mark.parametrize(("boundary", "mode"), BOUNDARIES)
def test_coefficients_are_scipys(rng, shape, degree, boundary, mode):
    data = rng.uniform(-1, 1, shape)
    volume = isospline.Volume(data, degree=degree, boundary=boundary)
    expected = scipy.ndimage.spline_filter(data, order=degree, output=np.float64, mode=mode)
    assert volume.coefficients.dtype == np.float64
    assert np.abs(volume.coefficients - expected).max() <= 1e-5 * np.abs(expected).max()


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
@pytest.mark.parametrize(("boundary", "mode"), BOUNDARIES)
def test_values_are_scipys(rng, shape, degree, boundary, mode):
    data = rng.uniform(-1, 1, shape)
    volume = isospline.Volume(data, degree=degree, boundary=boundary)
    points = points_around(rng, shape)
    expected = scipy.ndimage.map_coordinates(data, points[:, ::-1].T, order=degree, mode=mode)
    # Noise is the worst case: at degree 5, its coefficients are a hundred times as large as the samples. The rounding
    # of float32 alone comes near this bound.
    assert np.abs(volume.sample(points) - expected).max() <= 1e-6 * 2.0


def test_degree_zero_is_the_nearest_sample(rng):
    data = rng.random((4, 5, 6)).astype(np.float32)
    volume = isospline.Volume(data, degree=0)
    points = rng.uniform(-0.49, np.array([5, 4, 3]) + 0.49, (100, 3))
    nearest = np.rint(points).astype(int)
    np.testing.assert_allclose(volume.sample(points), data[tuple(nearest.T[::-1])], rtol=0, atol=1e-7)
    assert not volume.sample(points, derivative=1).any()
    assert not volume.sample(points, derivative=2).any()


def reference_derivative(coefficients, points, degree, mode, orders):
    """The definition: sum of c_k times products of derivatives of B-splines, which SciPy evaluates."""
    basis = BSpline.basis_element(np.arange(degree + 2) - (degree + 1) / 2, extrapolate=False)
    reach = degree // 2 + 1
    padded = np.pad(coefficients, 8 + reach, mode="reflect" if mode == "mirror" else "wrap")
    result = np.zeros(len(points))
    nearest = np.rint(points).astype(int)
    for offset in itertools.product(range(-reach, reach + 1), repeat=3):
        index = nearest + offset
        weight = np.ones(len(points))
        for axis in range(3):
            derivative = basis.derivative(orders[axis]) if orders[axis] else basis
            weight *= np.nan_to_num(derivative(points[:, axis] - index[:, axis]))
        result += weight * padded[tuple((index + 8 + reach).T[::-1])]
    return result


@pytest.mark.sweep(4)
@pytest.mark.slow
@pytest.mark.parametrize("degree", [2, 3, 4, 5])
@pytest.mark.parametrize(("boundary", "mode"), BOUNDARIES)
def test_derivatives_are_those_of_the_definition(rng, degree, boundary, mode):
    data = rng.uniform(-1, 1, (9, 12, 11))
    volume = isospline.Volume(data, degree=degree, boundary=boundary)
    coefficients = scipy.ndimage.spline_filter(data, order=degree, output=np.float64, mode=mode)
    points = rng.uniform(-3, np.array([10, 11, 8]) + 3, (100, 3))
    gradient = volume.sample(points, derivative=1)
    hessian = volume.sample(points, derivative=2)
    scale = np.abs(coefficients).max()
    for i in range(3):
        expected = reference_derivative(coefficients, points, degree, mode, np.eye(3, dtype=int)[i])
        assert np.abs(gradient[:, i] - expected).max() <= 2e-7 * scale
        for j in range(3):
            orders = np.eye(3, dtype=int)[i] + np.eye(3, dtype=int)[j]
            expected = reference_derivative(coefficients, points, degree, mode, orders)
            assert np.abs(hessian[:, i, j] - expected).max() <= 2e-6 * scale


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_without_a_filter_the_samples_are_the_coefficients(rng, degree):
    data = rng.random((6, 7, 8)).astype(np.float32)
    volume = isospline.Volume(data, degree=degree, filter="none")
    np.testing.assert_allclose(volume.coefficients, data, rtol=0, atol=1e-7)
    assert volume.filter == "none"


def collocation(size, degree, boundary):
    """The matrix that maps the coefficients of one line to the values of its spline at the samples."""
    period = size if boundary == "periodic" else 2 * size - 2
    basis = BSpline.basis_element(np.arange(degree + 2) - (degree + 1) / 2, extrapolate=False)
    matrix = np.zeros((size, size))
    for row, k in itertools.product(range(size), range(-degree, degree + 1)):
        index = (row + k) % period
        index = index if index < size else period - index
        matrix[row, index] += np.nan_to_num(basis(float(k))) if degree > 0 else float(k == 0)
    return matrix


@pytest.mark.parametrize("boundary", ["mirror", "periodic"])
@pytest.mark.parametrize("degree", [0, 1, 2, 3, 4, 5])
@pytest.mark.parametrize("smoothing", [1e-3, 0.7, 40.0, 1e4])
def test_smoothing_solves_the_normal_equations(rng, degree, boundary, smoothing):
    size = 23
    data = rng.uniform(-1, 1, (1, 1, size))
    volume = isospline.Volume(data, degree=degree, boundary=boundary, filter="smoothing", smoothing=smoothing)
    order = degree // 2 + 1
    second = np.zeros((size, size))
    period = size if boundary == "periodic" else 2 * size - 2
    for row, (k, weight) in itertools.product(range(size), ((-1, -1.0), (0, 2.0), (1, -1.0))):
        index = (row + k) % period
        second[row, index if index < size else period - index] += weight
    b = collocation(size, degree, boundary)
    roughness = np.linalg.matrix_power(second, order)
    if degree > 0:
        roughness = roughness @ collocation(size, 2 * (degree - order) + 1, boundary)
    expected = np.linalg.solve(b @ b + smoothing * roughness, b @ data[0, 0])
    assert np.abs(volume.coefficients[0, 0] - expected).max() <= 1e-6 * np.abs(expected).max()


def test_smoothing_minimises_data_term_and_roughness(rng):
    """The functional itself, for the classical case: cubic, periodic, integral of the second derivative squared."""
    size, smoothing = 16, 0.8
    data = rng.uniform(-1, 1, (1, 1, size))
    fine = np.stack([np.arange(0, size, 1 / 64), *np.zeros((2, 64 * size))], axis=-1)

    def functional(coefficients):
        volume = isospline.Volume(coefficients, degree=3, boundary="periodic", filter="none")
        at_samples = volume.sample(fine[::64])
        bend = volume.sample(fine, derivative=2)[:, 0, 0]
        return np.sum((at_samples - data[0, 0]) ** 2) + smoothing * np.mean(bend**2) * size

    volume = isospline.Volume(data, degree=3, boundary="periodic", filter="smoothing", smoothing=smoothing)
    best = volume.coefficients.astype(float)
    for _ in range(20):
        assert functional(best + 0.01 * rng.standard_normal(best.shape)) > functional(best)


def test_a_smoothing_of_zero_interpolates(rng):
    data = rng.random((6, 7, 8))
    smoothed = isospline.Volume(data, filter="smoothing", smoothing=0)
    np.testing.assert_array_equal(smoothed.coefficients, isospline.Volume(data).coefficients)


def test_much_smoothing_leaves_the_mean(rng):
    data = rng.random((9, 10, 11))
    volume = isospline.Volume(data, degree=3, filter="smoothing", smoothing=1e9, boundary="periodic")
    np.testing.assert_allclose(volume.coefficients, data.mean(), atol=1e-5)


DTYPES = [
    "?",
    "i1",
    "u1",
    "<i2",
    ">i2",
    "<u2",
    ">u2",
    "<i4",
    ">i4",
    "<u4",
    "<i8",
    ">u8",
    "<f2",
    ">f2",
    "<f4",
    ">f4",
    "<f8",
    ">f8",
    "longdouble",
]


@pytest.mark.parametrize("dtype", DTYPES)
def test_every_dtype_is_read(rng, dtype):
    data = rng.integers(0, 2 if dtype == "?" else 100, (5, 6, 70)).astype(dtype)
    expected = isospline.Volume(data.astype(np.float64))
    volume = isospline.Volume(data)
    np.testing.assert_allclose(volume.coefficients, expected.coefficients, rtol=0, atol=1e-4)
    assert (volume.minimum, volume.maximum) == (data.min(), data.max())


def layouts(data):
    yield "C", np.ascontiguousarray(data)
    yield "Fortran", np.asfortranarray(data)
    yield "other order", np.ascontiguousarray(data.transpose(1, 2, 0)).transpose(2, 0, 1)
    yield "negative strides", np.ascontiguousarray(data[::-1, ::-1, ::-1])[::-1, ::-1, ::-1]
    yield "every other sample", np.repeat(np.repeat(np.repeat(data, 2, 0), 2, 1), 2, 2)[::2, ::2, ::2]
    packed = np.zeros(data.shape, dtype=[("gap", "u1"), ("value", data.dtype)])
    packed["value"] = data
    yield "unaligned", packed["value"]


def test_every_memory_layout_is_read(rng):
    data = rng.random((19, 34, 50))
    expected = isospline.Volume(data).coefficients
    for name, array in layouts(data):
        np.testing.assert_array_equal(isospline.Volume(array).coefficients, expected, err_msg=name)


def test_broadcast_and_read_only_arrays_are_read(rng):
    line = rng.random(7)
    data = np.broadcast_to(line, (4, 5, 7))
    np.testing.assert_allclose(isospline.Volume(data).sample([[2, 3, 1], [6, 0, 0]]), line[[2, 6]], atol=1e-6)


def test_axes_name_the_order_of_the_array(rng):
    data = rng.random((4, 5, 6)).astype(np.float32)
    zyx = isospline.Volume(data, spacing=(1, 2, 3))
    xyz = isospline.Volume(data.transpose(), spacing=(1, 2, 3), axes="xyz")
    assert zyx.shape == (4, 5, 6)
    assert xyz.shape == (6, 5, 4)
    assert (zyx.axes, xyz.axes) == ("zyx", "xyz")
    np.testing.assert_array_equal(zyx.coefficients, xyz.coefficients.transpose())
    points = rng.uniform(0, 5, (20, 3))
    np.testing.assert_array_equal(zyx.sample(points), xyz.sample(points))
    np.testing.assert_array_equal(zyx.bounds, xyz.bounds)


def test_small_variations_on_a_large_offset_are_kept(rng):
    variation = rng.random((8, 8, 8))
    volume = isospline.Volume(variation + 1e9)
    expected = isospline.Volume((variation + 1e9) - 1e9)
    points = rng.uniform(0, 7, (50, 3))
    np.testing.assert_allclose(volume.sample(points) - 1e9, expected.sample(points), atol=1e-6)


def test_degree_and_description(rng):
    volume = isospline.Volume(rng.random((3, 4, 5)), degree=3, boundary="periodic", spacing=(1, 2, 3), origin=(4, 5, 6))
    assert volume.degree == 3
    assert volume.boundary == "periodic"
    assert volume.filter == "interpolate"
    np.testing.assert_array_equal(volume.spacing, [1, 2, 3])
    np.testing.assert_array_equal(volume.origin, [4, 5, 6])
    np.testing.assert_array_equal(volume.direction, np.eye(3))
    np.testing.assert_array_equal(volume.affine, [[1, 0, 0, 4], [0, 2, 0, 5], [0, 0, 3, 6], [0, 0, 0, 1]])
    np.testing.assert_array_equal(volume.bounds, [[4, 5, 6], [8, 11, 12]])
    assert volume.memory >= 3 * 4 * 5 * 4
    assert "degree=3" in repr(volume)
    np.testing.assert_array_equal(isospline.Volume(np.zeros((3, 4, 5))).bounds, [[-0.5] * 3, [4.5, 3.5, 2.5]])


def test_progress_is_reported_and_cancels(rng):
    data = rng.random((32, 32, 32))
    fractions = []
    isospline.Volume(data, progress=lambda fraction: fractions.append(fraction))
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0

    def broken(fraction):
        raise RuntimeError("from the callback")

    with pytest.raises(RuntimeError, match="from the callback"):
        isospline.Volume(np.zeros((400, 300, 300)), progress=broken)
