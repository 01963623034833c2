"""Tables of volumes and areas at several levels."""

import math

import numpy as np
import pytest

import isospline


def squares(size=24):
    """The square of the distance from the middle, which the model represents exactly, less its constant."""
    x = np.arange(size) - (size - 1) / 2
    values = x[:, None, None] ** 2 + x[:, None] ** 2 + x**2
    return isospline.Volume(values - 0.75, filter="none")


def test_balls_of_several_radii():
    radii = np.array([8.0, 5.0, 10.0])
    surface = isospline.Isosurface(squares(), 1.0, inside="below")
    table = isospline.measure(surface, radii**2)
    assert table.levels.tolist() == (radii**2).tolist()
    for values, errors, expected in (
        (table.enclosed_volumes, table.volume_errors, 4 / 3 * math.pi * radii**3),
        (table.areas, table.area_errors, 4 * math.pi * radii**2),
    ):
        assert (np.abs(values - expected) <= errors + 1e-6 * expected).all() and (errors <= 1e-4 * expected).all()
    assert surface.level == 1.0
    lines = table.to_csv().splitlines()
    assert lines[0] == "levels,enclosed_volumes,volume_errors,areas,area_errors" and len(lines) == 4


def test_the_rows_are_those_of_single_surfaces():
    volume = squares()
    cut = isospline.HalfSpace((11.5, 11.5, 11.5), (1, 1, 0))
    surface = isospline.Isosurface(volume, 60.0, clip=cut, capped=True, inside="below")
    table = isospline.measure(surface, [50, 90], order=4)
    for row, level in enumerate((50, 90)):
        alone = surface.with_level(level)
        assert table.enclosed_volumes[row] == pytest.approx(alone.enclosed_volume(order=4).value, rel=1e-12)
        assert table.areas[row] == pytest.approx(alone.area(order=4).value, rel=1e-12)
        assert 0 < table.area_errors[row] < 1e-3 * table.areas[row]


def test_rows_within_a_tolerance_differ_from_single_surfaces_by_no_more_than_the_errors():
    surface = isospline.Isosurface(squares(), 60.0, inside="below")
    table = isospline.measure(surface, [60])
    for value, error, alone in (
        (table.enclosed_volumes[0], table.volume_errors[0], surface.enclosed_volume()),
        (table.areas[0], table.area_errors[0], surface.area()),
    ):
        assert abs(value - alone.value) <= error + alone.error and error <= 1e-4 * value


def test_arrays_and_levels_without_a_surface():
    data = np.zeros((8, 9, 10), np.float32)
    data[3:5, 3:5, 3:5] = 1
    with pytest.warns(UserWarning, match="no surface"):
        table = isospline.measure(data, [0.5, 2.0, -1.0])
    assert table.areas[0] > 0 and table.areas[1:].tolist() == [0, 0]
    assert table.enclosed_volumes[1:].tolist() == [0, data.size]
    with pytest.warns(UserWarning, match="no surface"):
        told = isospline.Isosurface(data, 2.0)
    assert isospline.measure(told, [2.0]).areas.tolist() == [0]  # without the warning again


def test_progress_tells_of_all_levels():
    told = []
    isospline.measure(squares(), [20, 40], progress=told.append)
    assert told == sorted(told) and told[0] == 0 and told[-1] == 1 and any(0.5 <= each < 1 for each in told)
    with pytest.raises(isospline.Cancelled):
        isospline.measure(squares(), [20, 40], progress=lambda fraction: fraction < 0.5)


@pytest.mark.parametrize("levels", [[], 3.0, [[1.0]], [[1.0], [1.0, 2.0]], [math.nan], ["bone"], None])
def test_levels_that_are_none(levels):
    with pytest.raises(ValueError, match="^levels: expected one or more finite numbers in a sequence, got"):
        isospline.measure(squares(), levels)


def test_a_volume_of_another_type():
    with pytest.raises(TypeError, match=r"^volume: expected a Volume, .*, got"):
        isospline.measure("scan.nii", [1.0])
