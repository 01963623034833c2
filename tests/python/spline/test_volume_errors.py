"""Bad input to volumes: every error names the parameter, the expected and the given value."""

import numpy as np
import pytest

import isospline


@pytest.fixture
def data():
    return np.zeros((3, 4, 5), np.float32)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("dtype", ["<f2", "<f4", ">f4", "<f8", ">f8"])
def test_the_first_sample_that_is_not_finite_is_named(bad, dtype):
    data = np.zeros((30, 40, 50), dtype)
    data[17, 3, 2] = bad
    data[11, 39, 49] = bad
    data[11, 39, 48] = bad
    with pytest.raises(ValueError, match=r"^data: .*(nan|inf) at data\[11, 39, 48\]"):
        isospline.Volume(data)
    with pytest.raises(ValueError, match=r"^data: .*(nan|inf) at data\[48, 39, 11\]"):
        isospline.Volume(data.transpose(), axes="xyz")


@pytest.mark.parametrize("shape", [(), (3,), (3, 4), (3, 4, 5, 1), (0, 4, 5), (3, 4, 0)])
def test_shapes(shape):
    with pytest.raises(ValueError, match=r"^data: expected .*shape"):
        isospline.Volume(np.zeros(shape))


@pytest.mark.parametrize(
    "bad",
    [
        np.zeros((2, 2, 2), complex),
        np.zeros((2, 2, 2), object),
        np.full((2, 2, 2), "text"),
        np.zeros((2, 2, 2), "datetime64[s]"),
        np.zeros((2, 2, 2), [("a", "f4")]),
        None,
        "text",
        [[[1, 2], [3]]],
    ],
    ids=str,
)
def test_types(bad):
    with pytest.raises((TypeError, ValueError), match="^data: expected"):
        isospline.Volume(bad)


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"degree": -1}, "degree: expected 0 to 5, got -1"),
        ({"degree": 6}, "degree: expected 0 to 5, got 6"),
        ({"spacing": (1, 0, 1)}, "spacing: "),
        ({"spacing": (1, -1, 1)}, "spacing: "),
        ({"spacing": (1, np.nan, 1)}, "spacing: "),
        ({"spacing": (1, np.inf, 1)}, "spacing: "),
        ({"spacing": (1, 1)}, r"spacing: expected shape \(3,\), got \(2,\)"),
        ({"spacing": 0.0}, "spacing: "),
        ({"spacing": (1, 1, 1e-61)}, "spacing: expected voxels with edges of 1e-60 to 1e60, got "),
        ({"spacing": 1e61}, "spacing: expected voxels with edges of 1e-60 to 1e60, got "),
        ({"direction": 1e61 * np.eye(3)}, "spacing: expected voxels with edges of 1e-60 to 1e60, got "),
        ({"origin": (0, 0, np.inf)}, "origin: "),
        ({"origin": (0, 0, 0, 0)}, "origin: "),
        ({"direction": np.zeros((3, 3))}, "direction: "),
        ({"direction": [[1, 1, 0], [1, 1, 0], [0, 0, 1]]}, "direction: "),
        ({"direction": np.full((3, 3), np.nan)}, "direction: "),
        ({"direction": np.eye(4)}, "direction: "),
        ({"boundary": "reflect"}, 'boundary: expected "mirror" or "periodic", got "reflect"'),
        ({"filter": "smooth"}, "filter: expected "),
        ({"filter": "smoothing", "smoothing": -1}, "smoothing: "),
        ({"filter": "smoothing", "smoothing": np.nan}, "smoothing: "),
        ({"smoothing": 1.0}, "smoothing: "),
        ({"axes": "yxz"}, 'axes: expected "zyx" or "xyz", got "yxz"'),
    ],
)
def test_options(data, options, error):
    with pytest.raises(ValueError, match=f"^{error}"):
        isospline.Volume(data, **options)


def test_option_types(data):
    with pytest.raises(TypeError):
        isospline.Volume(data, (1, 1, 1))
    with pytest.raises(TypeError):
        isospline.Volume(data, colour="red")
    with pytest.raises(TypeError):
        isospline.Volume(data, spacing=("a", "b", "c"))
    with pytest.raises(TypeError):
        isospline.Volume()


def test_ranges_that_float32_cannot_hold(data):
    for scale in (1e-200, 1e40, 4e307):
        with pytest.raises(ValueError, match="^data: expected a range"):
            isospline.Volume(data.astype(float) + scale * np.arange(-2, 3))


def test_a_volume_too_large_for_memory_is_refused_before_the_work():
    huge = np.broadcast_to(np.uint8(0), (100000, 100000, 100000))
    with pytest.raises(MemoryError, match="MiB"):
        isospline.Volume(huge)


@pytest.mark.parametrize(
    ("points", "error"),
    [
        (np.zeros((2, 2)), ValueError),
        (np.zeros((3, 2)), ValueError),
        (np.float64(1.0), ValueError),
        (np.zeros((2, 3), complex), TypeError),
        (np.zeros((2, 3), bool), TypeError),
        (np.zeros((2, 3), object), TypeError),
        ("text", TypeError),
    ],
)
def test_points(data, points, error):
    with pytest.raises(error, match="^points: expected"):
        isospline.Volume(data).sample(points)


@pytest.mark.parametrize("derivative", [-1, 3])
def test_derivative(data, derivative):
    with pytest.raises(ValueError, match="^derivative: expected 0, 1 or 2"):
        isospline.Volume(data).sample([[0, 0, 0]], derivative=derivative)
