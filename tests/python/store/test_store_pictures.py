"""Pictures of the folder of a store: what is said of them belongs to the scale that they show."""

import numpy as np
import pytest

import isospline

pytest.importorskip("zarr")

SIZE, LEVEL = (900, 120), 10.0
EYE = isospline.PerspectiveCamera((149.5, -330, 15.5), (149.5, 15.5, 15.5), field_of_view=10)
RAMP = [(0, 0, 0), (1, 1, 1)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The store of an ellipsoid, whose overview has half of its samples along each axis."""
    z, y, x = np.mgrid[:32, :32, :300].astype(np.float32)
    away = np.sqrt(((x - 149.5) / 140) ** 2 + ((y - 15.5) / 11.3) ** 2 + ((z - 15.5) / 12) ** 2)
    path = tmp_path_factory.mktemp("store") / "ellipsoid.zarr"
    isospline.convert(100 - 100 * away, path)
    return path


@pytest.fixture(scope="module")
def finest(folder):
    """The surface of all samples."""
    return isospline.Isosurface(isospline.open_volume(folder), LEVEL, closed=True)


@pytest.mark.parametrize("rule", [isospline.ColorByDepth(RAMP), isospline.ColorByThickness(RAMP)], ids=repr)
def test_colour_bars_are_those_of_the_scale_that_is_shown(folder, finest, rule):
    options = dict(size=SIZE, light="unlit", color=rule, annotate="colorbar", samples=1)
    shown = isospline.render(folder, EYE, level=LEVEL, **options)
    np.testing.assert_array_equal(shown.color, isospline.render(finest, EYE, **options).color)


def test_progressive_pictures_show_the_scale_of_pictures(folder):
    renderer = isospline.ProgressiveRenderer(folder, EYE, size=SIZE)
    renderer.step()
    expected = isospline.render(folder, EYE, size=SIZE, light="path-trace")
    np.testing.assert_array_equal(renderer.image.color, expected.color)


def test_a_turntable_shows_the_scale_of_pictures(folder, finest, tmp_path):
    image = pytest.importorskip("PIL.Image")
    options = dict(frames=1, size=SIZE, view="front", light="phong", level=LEVEL)
    path = isospline.turntable(folder, tmp_path / "turn", **options)
    found = np.asarray(image.open(path / "frame-0000.png"))
    overview = isospline.Isosurface(isospline.open_volume(folder, scale=1), LEVEL, closed=True)
    (camera,) = isospline.turntable_cameras(overview, 1, view="front", size=SIZE)
    expected = isospline.render(finest, camera, size=SIZE, light="phong", samples=4)
    np.testing.assert_array_equal(found, expected.to_srgb())
