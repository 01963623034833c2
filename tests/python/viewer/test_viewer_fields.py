"""Fields for numbers in the page: what does not count, and what the user is told; the cut and the slices."""

import re

import numpy as np
import pytest
from browser import Page

import isospline
from isospline.viewer.slices import sample_slices


@pytest.fixture
def ball(tmp_path, large_ball):
    """A ball about (32, 32, 32): 100 - r, above 60 within r = 40; the values are 44.6 to 100."""
    path = tmp_path / "ball.npy"
    np.save(path, np.load(large_ball) + 80)
    return path


@pytest.fixture
def viewer(ball):
    with isospline.view(ball, levels=[80.0], browser=False) as opened:
        yield opened


def enter(page, field, text):
    """Type into a field, as a user does."""
    field.click(click_count=3)
    page.page.keyboard.press("Delete")
    page.page.keyboard.type(text)
    page.page.keyboard.press("Enter")


def test_levels_that_do_not_count(page, viewer):
    page.page.set_viewport_size({"width": 460, "height": 140})
    page.wait("isospline.frame.size[1] === 140")
    page.settle()
    field = page.page.locator(".object input.number")
    lower, upper = viewer.document["source1"].level_range
    pixels = page.pixels()
    for text in ("abc", "", "12abc", "1e9", "-5", "60,5,5", "1.234,5", "--60", "0x10", "Infinity", "1e999", "NaN"):
        enter(page, field, text)
        page.wait("document.getElementById('messages').textContent !== ''")
        message = page.messages()
        assert message.startswith("Level of ball.npy: expected ") and f"got {text or 'nothing'}" in message
        assert "It is still 80." in message
        if text in ("1e9", "-5"):
            assert f"expected {float(f'{lower:.6g}'):g} to {float(f'{upper:.6g}'):g}" in message
        page.page.locator("#messages p").first.click()
        assert field.input_value() == "80" and viewer.state.objects[0].level == 80
    page.settle()
    np.testing.assert_array_equal(page.pixels(), pixels)


def test_levels_with_a_decimal_comma_or_point(page, viewer):
    page.page.set_viewport_size({"width": 460, "height": 140})
    field = page.page.locator(".object input.number")
    for text, level in (("60,5", 60.5), (" 75 ", 75), ("60.5", 60.5), ("7.5e1", 75), ("+61", 61), ("95,", 95)):
        enter(page, field, text)
        page.settle()
        assert viewer.state.objects[0].level == level and float(field.input_value()) == level
    assert page.messages() == ""


def test_arrow_keys_change_a_level_by_a_step_within_its_range(page, viewer):
    field = page.page.locator(".object input.number")
    field.click()
    field.press("ArrowUp")
    page.settle()
    assert 80 < viewer.state.objects[0].level < 80.2
    enter(page, field, "99.99")
    for _ in range(5):
        field.press("ArrowUp")
    page.settle()
    highest = viewer.document["source1"].level_range[1]
    half = viewer.document["source1"].about().spacing_of_values / 2  # to the highest value
    assert 0 < half < 0.01 and viewer.state.objects[0].level == pytest.approx(highest - half, rel=1e-9)


def test_a_level_keeps_all_its_digits_if_another_is_refused(page, viewer):
    viewer.change(lambda state: state.with_object(0, level=80.12345678901))
    page.wait("isospline.state.objects[0].level === 80.12345678901")
    enter(page, page.page.locator(".object input.number"), "abc")
    page.settle()
    assert viewer.state.objects[0].level == 80.12345678901


def test_other_fields_keep_their_value_as_well(page, viewer):
    page.page.set_viewport_size({"width": 600, "height": 300})  # in which the slices cover no message
    page.open("slicing")
    page.page.get_by_label("Show three slices").click()
    page.wait("isospline.state.slices.shown")
    before = viewer.state.slices.window
    for label, text in (("Window", "0"), ("Window", "-3"), ("Window", "wide"), ("Window level", "5e")):
        enter(page, page.page.get_by_label(label, exact=True), text)
        assert f"{label}: expected" in page.messages()
        page.page.locator("#messages p").first.click()
        assert viewer.state.slices.window == pytest.approx(before)
    enter(page, page.page.get_by_label("Window", exact=True), "10,5")
    page.wait("Math.abs(isospline.state.slices.window[1] - isospline.state.slices.window[0] - 10.5) < 1e-9")


def test_an_open_cut_shows_no_stray_words(page):
    page.open("cut")
    page.page.get_by_role("button", name="Plane").click()
    page.settle()
    box = page.page.get_by_label("Closed", exact=True)
    for is_closed in (True, False):
        assert box.is_checked() == is_closed
        text = page.page.inner_text("#cut")
        assert "false" not in text and "true" not in text and ("Values on the cut" in text) == is_closed
        box.click()
        page.page.wait_for_timeout(100)
    for word in ("undefined", "null", "NaN", "false"):
        assert word not in page.page.inner_text("#panel")


def test_values_on_a_cut_have_the_greys_of_their_colour_bar(page, viewer):
    page.open("cut")
    assert page.page.locator(".value-bar").count() == 0
    page.page.get_by_role("button", name="Plane").click()
    page.page.get_by_label("Values on the cut").click()
    page.page.locator(".value-bar").wait_for()
    viewer.change(lambda state: state.replace(slices=state.slices.replace(window=(60.0, 140.0))))
    page.wait("document.querySelector('.value-bar').textContent === 'Value60100140'")
    viewer.change(
        lambda state: state.replace(clip=state.clip.replace(normal=(0.0, 1.0, 0.0), point=(32.0, 32.0, 32.0)))
    )
    page.page.get_by_role("button", name="−y").click()
    page.settle()
    camera = isospline.viewer.state.CameraState.from_json(page.evaluate("isospline.frame.camera"), "camera").camera()
    size = page.evaluate("isospline.frame.size")
    (surface,) = (
        each
        for each in [
            isospline.Isosurface(viewer.document["source1"].item, 80.0, clip=viewer.state.clip.cuts(), capped=True)
        ]
    )
    hits = isospline.Scene([surface]).cast_rays(
        camera.rays(tuple(size)), outputs=("positions", "primitive_ids", "t_hit")
    )
    cap = hits["primitive_ids"] == surface.volume.cell_count
    inner = cap & np.roll(cap, 2, 0) & np.roll(cap, -2, 0) & np.roll(cap, 2, 1) & np.roll(cap, -2, 1)
    assert inner.sum() > 2000
    values = 100 - np.linalg.norm(hits["positions"][inner] - 32, axis=1)
    grey = (values - 60) / 80 * 255
    assert np.ptp(grey) > 40 and grey.min() > 60
    assert np.abs(page.pixels()[inner].astype(float) - grey[:, None]).max() < 3
    page.page.get_by_label("Values on the cut").click()
    page.wait("document.querySelectorAll('.value-bar').length === 0")


@pytest.mark.slow
@pytest.mark.parametrize("axes", ["xyz", "zyx"])
def test_slices_of_a_volume_in_either_order_of_axes(browser, axes):
    """18 x 12 x 8 samples: x runs to 17, y to 11 and z to 7."""
    x, y, z = np.mgrid[:18, :12, :8].astype(float)
    data = x + 100 * y + 10000 * z
    volume = isospline.Volume(data if axes == "xyz" else data.transpose(), axes=axes, degree=1)
    with isospline.view(volume, levels=[35000.0], browser=False) as viewer:
        assert next(iter(viewer.document)).about().counts == (18, 12, 8)
        assert viewer.state.slices.index == (8.5, 5.5, 3.5)
        page = Page(browser, viewer.url)
        page.settle()
        page.open("slicing")
        page.page.get_by_label("Show three slices").click()
        page.page.locator("#slices figcaption").nth(2).filter(has_text=re.compile(r"\S")).wait_for()
        ends = []
        for axis in range(3):
            box = page.page.locator(f"#slices canvas >> nth={axis}").bounding_box()
            page.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
            for _ in range(20):
                page.page.mouse.wheel(0, 10)
            page.wait("isospline.frame.input === isospline.inputs")
            ends.append(page.page.locator("#slices figcaption").nth(axis).inner_text().split("\n")[0])
        assert ends == ["x = 17", "y = 11", "z = 7"]
        assert viewer.state.slices.index == (17, 11, 7)
        page.page.locator("#slices canvas").first.wait_for()
        page.close()
        assert not page.problems
    planes = [values for _, _, values in sample_slices(volume, (9, 6, 4))]
    for plane, (along, across), value in zip(planes, ((1, 2), (0, 2), (0, 1)), (9, 600, 40000)):
        counts, steps = (18, 12, 8), (1, 100, 10000)
        rows, columns = plane.shape
        expected = value + np.add.outer(
            np.linspace(0, counts[across] - 1, rows) * steps[across],
            np.linspace(0, counts[along] - 1, columns) * steps[along],
        )
        np.testing.assert_allclose(plane, expected, rtol=1e-5)
