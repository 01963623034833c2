"""Derivatives of volume and area, beside finite differences and closed forms."""

import numpy as np
import pytest

import isospline
from isospline import volumes
from isospline.derivatives import measure_vjp

LEVEL, STEP = 0.13, 1e-4
CASES = {
    "open": {},
    "closed": {"closed": True},
    "below": {"inside": "below"},
    "cut": {"clip": isospline.HalfSpace((3.3, 4, 3), (1, 0.3, 0.2))},
    "capped": {"clip": isospline.HalfSpace((3.3, 4, 3), (1, 0.3, 0.2)), "capped": True, "closed": True},
    "masked": {"mask": np.arange(7)[:, None, None] + np.zeros((7, 8, 9)) > 3},
}


def samples():
    """Smooth random samples with surfaces that end at the border."""
    z, y, x = np.mgrid[0:7, 0:8, 0:9] * 0.75
    return np.sin(x + 0.3 * y) * np.cos(0.8 * y - 0.2 * z) + 0.7 * np.sin(0.9 * z + 0.5 * x)


def surface(data, degree, level=LEVEL, **options):
    return isospline.Isosurface(isospline.Volume(data, degree=degree, spacing=(1, 1.2, 0.8)), level, **options)


@pytest.mark.sweep(4)
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_gradients_are_those_of_finite_differences(degree, case):
    data, options = samples(), CASES[case]
    measures, vjp = measure_vjp(surface(data, degree, **options), order=8)
    change = np.random.default_rng(degree).normal(size=data.shape)
    for name in ("enclosed_volume", "area"):
        if name == "area" and degree == 1:
            continue

        def measured(level=LEVEL, step=0.0, name=name):
            return getattr(surface(data + step * change, degree, level, **options), name)(order=10).value

        gradient = vjp(**{name: 1.0})
        assert measures[name] == pytest.approx(measured(), rel=1e-3)
        by_level = (measured(LEVEL + STEP) - measured(LEVEL - STEP)) / (2 * STEP)
        by_samples = (measured(step=STEP) - measured(step=-STEP)) / (2 * STEP)
        # The error of finite differences is that of the quadrature, divided by the step.
        size = np.abs(gradient["samples"]).sum()
        assert gradient["level"] == pytest.approx(by_level, abs=2e-3 * size)
        assert (gradient["samples"] * change).sum() == pytest.approx(by_samples, abs=2e-3 * size)


@pytest.mark.parametrize("degree", [2, 3])
def test_a_ball_changes_as_its_radius_does(degree):
    field = volumes.sphere(0.7)  # its values are 0.49 - r^2: dr/dlevel = -1 / (2 r)
    measures, vjp = measure_vjp(isospline.Isosurface(field.volume(40, degree=degree), field.level))
    assert measures["area"] == pytest.approx(4 * np.pi * 0.49, rel=1e-3)
    assert vjp(enclosed_volume=1.0, samples=False)["level"] == pytest.approx(-2 * np.pi * 0.7, rel=1e-3)
    assert vjp(area=1.0, samples=False)["level"] == pytest.approx(-4 * np.pi, rel=1e-2)


def test_the_level_does_what_all_samples_do_together():
    _, vjp = measure_vjp(surface(samples(), 2, closed=True))
    gradient = vjp(enclosed_volume=2.0, area=-0.5)
    assert gradient["samples"].shape == (7, 8, 9)
    assert gradient["samples"].sum() == pytest.approx(-gradient["level"], rel=1e-5)
    assert set(vjp(enclosed_volume=1.0, samples=False)) == {"level"}


def test_the_surface_may_change_before_vjp_is_called():
    changing = surface(samples(), 2)
    _, vjp = measure_vjp(changing)
    before = vjp(enclosed_volume=1.0, samples=False)["level"]
    changing.level = 0.6
    assert vjp(enclosed_volume=1.0, samples=False)["level"] == before


def test_wrong_arguments_get_one_sentence():
    with pytest.raises(TypeError, match="surface: expected an Isosurface, got int"):
        measure_vjp(3)
    with pytest.raises(ValueError, match="order: expected 2 to 10, got 1"):
        measure_vjp(surface(samples(), 2), order=1)
    _, vjp = measure_vjp(surface(samples(), 1))
    with pytest.raises(ValueError, match="degree: expected 2 or 3"):
        vjp(area=1.0)
    with pytest.raises(ValueError, match="area: expected gradients of shape"):
        vjp(area=[1.0, 2.0])
