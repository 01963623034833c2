"""Suggested levels: against closed forms and against trying every partition."""

from fractions import Fraction

import numpy as np
import pytest

from isospline import suggest_levels
from isospline.levels import bars, histogram


def best_level(data):
    """The level between the two classes of least variance; it tries every split of the sorted samples."""
    values = np.unique(data).astype(float)
    levels = (values[1:] + values[:-1]) / 2

    def within(level):
        below, above = data[data < level].astype(float), data[data > level].astype(float)
        return below.var() * below.size + above.var() * above.size

    return min(levels, key=within)


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint16", "float32", "float64"])
def test_first_level_is_the_optimal_partition(rng, dtype):
    modes = [rng.normal(mean, 6, size) for mean, size in ((20, 500), (90, 200), (120, 100))]
    data = np.clip(np.concatenate(modes), 0, 255).astype(dtype)
    assert suggest_levels(data, 1)[0] == pytest.approx(best_level(data), abs=0.2)


def test_levels_of_separate_values_are_halfway():
    data = np.repeat([0, 100, 140], [5000, 300, 200])
    assert suggest_levels(data) == [50, 120]


def test_integers_that_are_one_in_float64_have_no_level_between_them():
    first = 2**63
    assert suggest_levels(np.array([first, first + 5, first + 1000], np.uint64)) == []
    assert suggest_levels(np.array([first, first + 5, first + 4096], np.uint64)) == [first + 2048]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("scale", [1e-310, 1e-300, 1e-160, 1e150, 1e200, 1e300])
def test_levels_of_tiny_and_huge_samples_are_the_same_ones(scale):
    """Their squares are 0 or infinite: in fractions, the optimum has no such limits."""
    values, counts = [-3.0, -2.5, 0.0, 4.0, 4.5, 11.0], [40, 30, 20, 50, 60, 25]
    data = np.repeat(values, counts) * scale
    exact = [Fraction(each) for each in np.unique(data).tolist()]

    def gain(middle):
        below, above = sum(counts[:middle]), sum(counts[middle:])
        sums = [sum(n * x for n, x in zip(counts[part], exact[part])) for part in (slice(middle), slice(middle, None))]
        return Fraction(below * above, below + above) * (sums[1] / above - sums[0] / below) ** 2

    best = max(range(1, 6), key=gain)
    levels = suggest_levels(data, 9)
    assert levels[0] == pytest.approx(float((exact[best - 1] + exact[best]) / 2), rel=1e-9)
    assert np.sort(levels) / scale == pytest.approx([-2.75, -1.25, 2, 4.25, 7.75], rel=1e-9)


def test_the_level_between_the_largest_numbers_is_finite():
    assert suggest_levels([-1.7e308, 1.7e308]) == [0]
    assert suggest_levels([-1.7e308, 0, 0, 1.7e308]) == pytest.approx([-0.85e308, 0.85e308])


@pytest.mark.parametrize("offset", [0, 2**53, 2**58, 2**60])
def test_levels_of_large_integers_are_between_the_same_samples(rng, offset):
    steps = max(1, offset >> 52)  # the integers between are rounded to float64
    data = np.concatenate([rng.integers(0, 20, 900), rng.integers(70, 90, 700), rng.integers(150, 160, 500)])
    levels = suggest_levels(data * steps + offset)
    assert [(int(level) - offset) / steps for level in levels] == pytest.approx(suggest_levels(data), abs=1)
    values, counts = histogram(data * steps + offset)
    assert (np.diff(values) > 0).all() and counts.sum() == data.size
    dense = np.arange(1000) + 2**60  # several integers are one number in float64
    values, counts = histogram(dense)
    assert len(values) == len(np.unique(dense.astype(float))) and counts.sum() == 1000
    assert len(set(suggest_levels(dense))) == 3


def test_first_level_of_two_normal_modes_is_halfway(rng):
    data = np.concatenate([rng.normal(100, 10, 200_000), rng.normal(300, 10, 200_000)])
    assert suggest_levels(data, 1)[0] == pytest.approx(200, abs=20)


def test_three_modes_give_both_valleys(rng):
    data = np.concatenate([rng.normal(mean, 8, size) for mean, size in ((0, 90_000), (150, 9_000), (300, 9_000))])
    levels = sorted(suggest_levels(data, 2))
    assert 40 < levels[0] < 110 and 190 < levels[1] < 260


@pytest.mark.parametrize("part", [0.5, 0.9, 0.99])
def test_air_does_not_draw_the_levels_to_it(rng, part):
    size = 400_000
    solid = rng.normal(1000, 60, round(size * (1 - part)))
    data = np.concatenate([rng.normal(-1000, 20, size - solid.size), solid]).astype(np.int16)
    assert -800 < suggest_levels(data, 1)[0] < 750


def test_further_levels_leave_the_first_ones(rng):
    data = rng.gamma(2, 30, 5000)
    levels = suggest_levels(data, 6)
    assert len(set(levels)) == 6
    for count in range(1, 6):
        assert suggest_levels(data, count) == levels[:count]


def test_levels_follow_the_scale_of_the_data(rng):
    data = rng.integers(0, 200, 3000)
    levels = np.array(suggest_levels(data))
    np.testing.assert_allclose(suggest_levels(data * 3 - 100), levels * 3 - 100)
    np.testing.assert_allclose(suggest_levels(data * 1e-30), levels * 1e-30, rtol=1e-3)


def test_few_values_give_few_levels():
    assert suggest_levels([7, 7, 7]) == []
    assert suggest_levels([True, False]) == [0.5]
    assert sorted(suggest_levels([1, 2, 3], 10)) == [1.5, 2.5]


@pytest.mark.parametrize("dtype", ["int8", "uint16", "int64", "float32"])
def test_histogram_counts_every_sample(rng, dtype):
    data = rng.integers(-100 if dtype != "uint16" else 0, 100, (5, 6, 7)).astype(dtype)
    values, counts = histogram(data)
    expected_values, expected_counts = np.unique(data, return_counts=True)
    np.testing.assert_allclose(values, expected_values, atol=1e-9)
    np.testing.assert_array_equal(counts, expected_counts)


def test_histogram_of_a_wide_range_keeps_the_mean(rng):
    for data in (rng.normal(size=(4, 50, 50)), rng.integers(-(2**62), 2**62, (4, 50, 50))):
        values, counts = histogram(data)
        assert counts.sum() == data.size and len(values) <= 4096
        assert np.average(values, weights=counts) == pytest.approx(data.mean(), rel=1e-6)


def test_bad_input_is_refused():
    with pytest.raises(ValueError, match="data: expected samples"):
        suggest_levels([])
    with pytest.raises(ValueError, match=r"finite .* at \[1\]$"):
        suggest_levels([0.0, np.nan])
    with pytest.raises(ValueError, match=r"finite .* at \[0, 1, 2\]$"):
        suggest_levels(np.where(np.arange(8) == 6, np.nan, 0.0).reshape(1, 2, 4))
    with pytest.raises(ValueError, match="finite"):
        suggest_levels([0.0, np.inf])
    with pytest.raises(TypeError, match="complex"):
        suggest_levels([1j])
    with pytest.raises(ValueError, match="count: expected a whole number of at least 1"):
        suggest_levels([1, 2], 0)


@pytest.mark.parametrize(
    "data",
    [
        np.full((3, 4, 5), 2**60, np.uint64),
        2**63 + 2**13 * np.arange(12, dtype=np.uint64).reshape(3, 4),
        np.full((3, 4, 5), -1000, np.float32),
        1000 + 1e-13 * np.arange(60.0).reshape(3, 4, 5),
        1.7e308 * np.linspace(-1, 1, 60).reshape(3, 4, 5),
        np.array([[0, 5e-324]]),
    ],
    ids=["a large integer", "large integers", "constant", "nearly constant", "the range of float64", "subnormal"],
)
def test_histograms_of_extreme_data(data):
    """The values and bars of a histogram count all samples, with their smallest and their largest value."""
    values, counts = histogram(data)
    assert (values[0], values[-1]) == (data.min(), data.max())
    assert (np.diff(values) > 0).all() and counts.sum() == data.size
    found = bars(values, counts, 7)
    assert found.sum() == data.size and found[0] > 0
    assert found[-1] > 0 or values[0] == values[-1]
