"""Tone mapping against the formulas of its sources, and images over backgrounds."""

import numpy as np
import pytest

import isospline
from isospline._core import tone_mapped
from isospline.picture.tone import CURVES


def pbr_neutral(color):
    """The specification's code, line by line, for one colour."""
    start_compression, desaturation = 0.8 - 0.04, 0.15
    x = min(color)
    offset = x - 6.25 * x * x if x < 0.08 else 0.04
    color = [part - offset for part in color]
    peak = max(color)
    if peak < start_compression:
        return color
    d = 1 - start_compression
    new_peak = 1 - d * d / (peak + d - start_compression)
    color = [part * new_peak / peak for part in color]
    g = 1 - 1 / (desaturation * (peak - new_peak) + 1)
    return [part * (1 - g) + new_peak * g for part in color]


def test_neutral_is_that_of_its_specification(rng):
    colors = np.concatenate(
        [
            rng.uniform(0, 1, (300, 3)),
            rng.uniform(0, 20, (300, 3)),
            rng.uniform(0, 0.1, (50, 3)),
            [(0, 0, 0), (1e6, 0, 0), (1e6, 1e6, 1e6), (0.8, 0.8, 0.8)],
        ]
    )
    np.testing.assert_allclose(tone_mapped(colors, "neutral"), [pbr_neutral(list(each)) for each in colors], atol=1e-12)


@pytest.mark.parametrize("curve", CURVES)
def test_curves_rise_from_zero_and_stay_below_one(curve):
    gray = np.linspace(0, 30, 3001)[:, None].repeat(3, axis=1)
    mapped = tone_mapped(gray, curve)
    assert mapped[0].max() == 0 and mapped.max() <= 1
    assert (np.diff(mapped[:, 0]) >= 0).all()


def test_highlights_are_told_apart():
    """Colours that `linear` clips to one white stay different with `neutral`."""
    bright = np.array([(1.5, 1.2, 1.0), (3, 2.4, 2.0), (9, 7, 6.0)])
    assert (tone_mapped(bright, "linear") == 1).all()
    assert (np.diff(tone_mapped(bright, "neutral")[:, 2]) > 0.01).all()


def picture(background=None, radiance=3.0):
    field = isospline.volumes.torus()
    scene = isospline.Scene(isospline.Isosurface(field.volume(32), field.level))
    tracer = isospline.PathTracer(lights=[isospline.EnvironmentLight(radiance)])
    options = dict(light=tracer, background=background, layers=("depth",))
    return isospline.render(scene, size=(40, 30), samples=4, **options)


def test_exposure_is_in_stops():
    dim, bright = picture(radiance=0.25), picture(radiance=1.0)
    expected = np.minimum(bright.color, bright.color[..., 3:])
    np.testing.assert_allclose(dim.tone_map("linear", exposure=2).color, expected, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("curve", CURVES)
def test_colours_are_mapped_before_they_are_premultiplied(curve):
    image = picture()
    before = image.color.copy()
    mapped = image.tone_map(curve)
    np.testing.assert_array_equal(image.color, before)
    alpha = before[..., 3]
    np.testing.assert_array_equal(mapped.color[..., 3], alpha)
    partly = (alpha > 0) & (alpha < 1)
    assert partly.sum() > 10
    straight = before[partly, :3] / alpha[partly, None]
    expected = tone_mapped(straight, curve) * alpha[partly, None]
    np.testing.assert_allclose(mapped.color[partly, :3], expected, atol=1e-6)
    np.testing.assert_array_equal(mapped.depth, image.depth)


@pytest.mark.parametrize("background", ["white", 0.25, (0.1, 0.2, 0.3), (0.1, 0.2, 0.3, 0.5), None])
def test_over_is_what_render_does(background):
    np.testing.assert_allclose(picture().over(background).color, picture(background).color, atol=1e-6)


def test_a_background_keeps_its_colour():
    image = picture().tone_map("neutral").over("white")
    behind = picture().color[..., 3] == 0
    assert behind.sum() > 100 and (image.to_srgb()[behind] == 255).all()


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda image: image.tone_map("film"), "curve: expected one of neutral, aces, linear, got 'film'"),
        (lambda image: image.tone_map(exposure=float("nan")), "exposure: expected stops from -64 to 64, got nan"),
        (lambda image: image.over("mauvish"), "background: expected"),
        (lambda image: image.over((1, 2)), "background: expected"),
    ],
)
def test_bad_options_are_named(call, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        call(picture())
    with pytest.raises(TypeError, match="^exposure: expected a number"):
        picture().tone_map(exposure="bright")
