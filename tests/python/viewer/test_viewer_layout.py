"""The place of things in the page: nothing covers or pushes out another, and all can be read."""

import re

import numpy as np
import pytest

pytest.importorskip("playwright")
from browser import shown

from isospline.viewer.to_page import Error

NAME = "volume_of_the_third_patient_reconstructed_by_another_kernel_1.25mm.npy"
BOXES = "(...all) => all.map(each => document.querySelector(each).getBoundingClientRect().toJSON())"


@pytest.fixture(scope="module")
def opened(browser, large_ball, tmp_path_factory):
    path = tmp_path_factory.mktemp("layout") / NAME
    path.write_bytes(large_ball.read_bytes())
    with shown(browser, path, levels=[0]) as (page, viewer):
        viewer.open(path)
        page.wait("isospline.sources.size === 2")
        yield page, viewer


def boxes(page, *selectors):
    return page.evaluate(f"all => ({BOXES})(...all)", selectors)


def overlap(a, b):
    return min(a["right"], b["right"]) > max(a["left"], b["left"]) and min(a["bottom"], b["bottom"]) > max(
        a["top"], b["top"]
    )


@pytest.mark.parametrize("width", [390, 900])
def test_long_names_and_errors_leave_the_controls_in_place(opened, width):
    page, viewer = opened
    page.page.set_viewport_size({"width": width, "height": 700})
    cut = viewer.state.clip.replace(kind="plane", point=(32, 32, 32), values=True)
    viewer.change(lambda state: state.replace(clip=cut))
    for number in range(7):  # each stays until it is read
        viewer.windows()[0].send(Error(f"{number}: {NAME} is not there"))
    page.wait("document.querySelectorAll('#messages p').length === 7 && document.querySelectorAll('.value-bar').length")
    assert (
        page.evaluate("(({scrollWidth, clientWidth}) => scrollWidth - clientWidth)(document.getElementById('panel'))")
        <= 0
    )
    # Of two files of the same name, one has a number. On a narrow page it is in the drawer, which is closed.
    close = page.page.get_by_role("button", name=f"Close {NAME} (2)", include_hidden=True)
    close.wait_for(state="attached")
    assert close.count() == 1
    stage, messages, views, bar = boxes(page, "#stage", "#messages", "#projection", "#value-bars")
    assert not overlap(messages, views) and messages["right"] <= stage["right"]
    assert stage["left"] <= bar["left"] and bar["right"] <= stage["right"]
    texts = page.evaluate("[...document.querySelectorAll('.value-bar div')].map(e => e.scrollWidth - e.clientWidth)")
    assert max(texts) <= 0
    page.page.get_by_role("button", name="Orthographic").click()
    page.wait("isospline.camera.projection === 'orthographic'")
    page.page.get_by_role("button", name="Orthographic").click()
    while page.page.locator("#messages p").count():
        page.page.locator("#messages p").first.click()


def luminance(color):
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in np.divide(color, 255)]
    return np.dot(linear, (0.2126, 0.7152, 0.0722))


def test_texts_on_the_picture_can_be_read_on_all_backgrounds(opened):
    """By the contrast of WCAG, at least 4.5 for small text."""
    page, _ = opened
    for selector in ("#scale-bar", "#status", ".value-bar"):
        ink, plate = (
            [float(each) for each in re.findall(r"[\d.]+", text)]
            for text in page.evaluate(
                "each => (({color, backgroundColor}) => [color, backgroundColor])"
                "(getComputedStyle(document.querySelector(each)))",
                selector,
            )
        )
        for background in (0, 0x44, 0x80, 255):
            behind = np.multiply(plate[:3], plate[3]) + background * (1 - plate[3])
            contrast = (luminance(behind) + 0.05) / (luminance(ink[:3]) + 0.05)
            assert contrast > 4.5, (selector, background, contrast)
    page.page.emulate_media(color_scheme="dark")
    ends, card = page.evaluate(
        "[getComputedStyle(document.querySelector('#histogram .end')).fill,"
        " getComputedStyle(document.querySelector('#surfaces')).backgroundColor]"
    )
    ends, card = (luminance([float(each) for each in re.findall(r"[\d.]+", text)]) for text in (ends, card))
    page.page.emulate_media(color_scheme="light")
    assert (ends + 0.05) / (card + 0.05) > 4.5
