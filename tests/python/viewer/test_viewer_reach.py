"""The page can be reached by everyone: the rules of axe-core, and the keyboard alone."""

import importlib.resources

import numpy as np
import pytest

pytest.importorskip("playwright")
from browser import shown as show

from isospline.viewer.to_page import Error

AXE = importlib.resources.files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8")


@pytest.fixture
def shown(browser, large_ball):
    with show(browser, large_ball, (620, 500), levels=[0]) as opened:
        yield opened


def findings(page):
    """The rules that the page violates now, with the elements."""
    page.page.wait_for_timeout(300)  # transitions
    page.evaluate(AXE)
    found = page.evaluate("axe.run()")["violations"]
    return [(each["id"], [node["html"] for node in each["nodes"]]) for each in found]


def open_everything(page, viewer):
    for section in ("cut", "slicing", "measurements", "saving", "shortcuts"):
        page.open(section)
    page.page.get_by_label("Show three slices").click()
    page.page.get_by_role("button", name="Box").click()
    page.page.get_by_label("Values on the cut").click()
    page.page.get_by_label("Colour by").select_option("mean-curvature")
    viewer.windows()[0].send(Error("some error"))
    page.settle()
    box = page.page.locator("#picture").bounding_box()
    page.page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.6 * box["height"])
    page.wait("isospline.state.measurements.length === 1")


@pytest.mark.slow
def test_axe_has_no_findings(shown):
    page, viewer = shown
    assert findings(page) == []
    open_everything(page, viewer)
    for scheme in ("light", "dark"):
        page.page.emulate_media(color_scheme=scheme)
        assert findings(page) == []
    page.page.locator("#slices canvas >> nth=1").dblclick()
    assert findings(page) == []
    page.page.keyboard.press("Escape")
    page.page.set_input_files("#open", [{"name": "a.raw", "mimeType": "", "buffer": bytes(1000)}])
    page.page.locator("dialog").wait_for()
    assert findings(page) == []
    page.page.keyboard.press("Escape")
    page.page.set_viewport_size({"width": 390, "height": 780})
    assert findings(page) == []
    page.page.get_by_role("button", name="Controls").click()
    assert findings(page) == []


def test_the_keyboard_alone_selects_opens_and_cuts(shown, large_ball):
    page, viewer = shown
    keyboard = page.page.keyboard
    reached = set()
    page.page.locator("#picture").focus()
    for _ in range(60):
        keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.id || document.activeElement.textContent"))
    assert {"open-files", "ball.npy", "+ level", "Studio", "Cut", "Slices", "Measurements", "Save"} <= reached
    with page.page.expect_file_chooser() as chooser:
        page.page.locator("#open-files").focus()
        keyboard.press("Enter")
    assert chooser.value.is_multiple()
    name = page.page.get_by_role("button", name="ball.npy", exact=True)
    assert name.get_attribute("aria-expanded") == "true"
    name.focus()
    keyboard.press("Enter")
    assert name.get_attribute("aria-expanded") == "false" and page.page.get_by_label("Colour by").count() == 0
    keyboard.press("Enter")
    page.page.get_by_label("Colour by").wait_for()

    page.open("cut")
    page.page.get_by_role("button", name="Plane").focus()
    keyboard.press("Enter")
    page.settle()
    handle = page.page.get_by_role("slider", name="move the plane")
    handle.focus()
    for key in ("ArrowUp", "ArrowRight", "Shift+ArrowUp", "ArrowLeft"):  # the handle keeps the focus
        keyboard.press(key)
        page.settle()
    np.testing.assert_allclose(viewer.state.clip.point, (32, 32 + 1.1 * 0.65, 32))
    assert float(handle.get_attribute("aria-valuenow")) == pytest.approx(32 + 1.1 * 0.65)
    page.page.get_by_role("button", name="tilt the plane").focus()
    keyboard.press("ArrowUp")
    page.settle()
    normal = np.array(viewer.state.clip.normal)
    assert (
        3 < np.degrees(np.arccos(normal[1])) < 5 and normal[2] > 0.03
    )  # about the camera's axis to the right: upwards

    page.page.get_by_role("button", name="Box").click()
    page.settle()
    maximum = viewer.state.clip.maximum
    page.page.get_by_role("slider", name="move the maximum of z").focus()
    keyboard.press("ArrowUp")
    page.settle()
    np.testing.assert_allclose(viewer.state.clip.maximum, np.add(maximum, (0, 0, 0.65)))


def pressed(page, *keys):
    for key in keys:
        page.page.keyboard.press(key)
    page.settle()
    return page.evaluate("isospline.camera")


def test_the_keyboard_alone_pans_and_measures(shown):
    page, viewer = shown
    page.page.locator("#picture").focus()
    start = pressed(page)
    panned = pressed(page, "Shift+ArrowRight", "Shift+ArrowUp")
    move = np.subtract(panned["target"], start["target"])
    np.testing.assert_allclose(np.subtract(panned["eye"], start["eye"]), move)
    right = np.cross(np.subtract(start["target"], start["eye"]), start["up"])
    assert move @ right < 0 and move[2] < 0  # the ball moves to the right and upwards
    assert pressed(page, "Shift+ArrowLeft", "Shift+ArrowDown")["target"] == pytest.approx(start["target"])
    for key in ("Control+-", "Control+f", "Alt+ArrowLeft"):  # keys of the browser
        assert page.evaluate(
            "key => picture.dispatchEvent(new KeyboardEvent('keydown', {cancelable: true, bubbles: true, "
            "key: key.split('+')[1], ctrlKey: key[0] === 'C', altKey: key[0] === 'A'}))",
            key,
        )
        assert pressed(page)["eye"] == pytest.approx(start["eye"])
    assert page.page.is_visible("#aim")
    page.page.keyboard.press("Enter")
    page.wait("isospline.state.measurements.length === 1")
    (point,) = viewer.state.measurements[0].points
    forward, to_point = np.subtract(start["target"], start["eye"]), np.subtract(point.position, start["eye"])
    assert np.linalg.norm(np.cross(to_point, forward / np.linalg.norm(forward))) < 0.2  # on the camera's axis
    assert np.linalg.norm(to_point) < np.linalg.norm(forward)


def test_what_is_covered_gets_no_focus(shown):
    page, _ = shown

    def reached(count=70):
        found = set()
        for _ in range(count):
            page.page.keyboard.press("Shift+Tab")
            found.add(page.evaluate("document.activeElement.closest('#view, #views, #slices, #panel')?.id"))
        return found - {None}

    page.open("cut")
    page.page.get_by_role("button", name="Plane").click()
    page.open("slicing")
    page.page.get_by_label("Show three slices").click()
    page.settle()
    page.page.locator("#slices canvas >> nth=1").focus()
    page.page.keyboard.press("m")
    assert reached() == {"slices", "panel"}
    page.page.locator("#slices canvas >> nth=1").focus()
    page.page.keyboard.press("m")
    assert reached() == {"view", "views", "slices", "panel"}
    page.page.set_viewport_size({"width": 390, "height": 780})
    page.page.get_by_role("button", name="Controls", exact=True).click()
    page.page.wait_for_timeout(300)
    assert reached() == {"panel"}
    page.page.keyboard.press("Escape")
    assert page.evaluate("document.activeElement.id") == "show-panel"
    page.page.wait_for_timeout(300)
    assert reached(20) == {"view", "views", "slices"}
    page.page.set_viewport_size({"width": 620, "height": 500})


def test_a_tap_of_two_fingers_does_not_measure(shown):
    page, viewer = shown
    page.evaluate(
        """() => {
            const event = (type, pointerId) => picture.dispatchEvent(new PointerEvent(type,
                {pointerId, pointerType: "touch", clientX: 140 + pointerId, clientY: 250, bubbles: true, button: 0}));
            picture.setPointerCapture = () => {};
            for (const type of ["pointerdown", "pointerup"]) for (const id of [11, 12]) event(type, id);
            window.after = () => { event("pointerdown", 13); event("pointerup", 13); };
        }"""
    )
    page.page.wait_for_timeout(300)
    assert viewer.state.measurements == ()
    page.evaluate("after()")  # a tap of one finger does
    page.wait("isospline.state.measurements.length === 1")
