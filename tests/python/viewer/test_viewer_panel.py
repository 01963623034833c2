"""The controls at the side: they keep the focus and what the user operates, and otherwise show the state."""

import pytest
from browser import shown


@pytest.fixture(scope="module")
def opened(browser, large_ball):
    with shown(browser, large_ball, (460, 800), levels=[-6, 0, 6]) as pair:
        yield pair


@pytest.fixture
def panel(opened):
    page, viewer = opened
    start = viewer.state
    yield page, viewer
    page.evaluate("document.activeElement.blur(); document.getElementById('panel').scrollTop = 0")
    viewer.change(lambda _: start.replace(camera=None))
    page.wait("document.querySelectorAll('.object').length === 3")
    page.settle()


FOCUSED = """(() => {
    const e = document.activeElement, of = e.closest("[data-object]")?.dataset.object ?? "";
    return [of, e.getAttribute("aria-label") ?? (e.closest("label") ?? e).textContent].join(" ").trim();
})()"""


def select(page, id):
    page.evaluate(f"isospline.selected = {id}; isospline.tell('selected')")


def press(page, key, changed):
    page.page.keyboard.press(key)
    page.wait(changed)
    page.page.wait_for_timeout(50)  # the panel is drawn when the focus has moved
    return page.evaluate(FOCUSED)


def test_controls_keep_the_focus(panel):
    page, viewer = panel
    second = page.page.locator(".object >> nth=1")
    second.get_by_role("button", name="Hide").focus()
    assert press(page, "Enter", "!isospline.state.objects[1].visible") == "1 Show"
    assert press(page, "Enter", "isospline.state.objects[1].visible") == "1 Hide"
    second.locator(".name").focus()
    assert press(page, "Enter", "isospline.selected === 1") == "1 ball.npy"
    page.page.get_by_label("Closed at the border").focus()
    assert press(page, "Space", "!isospline.state.objects[1].closed") == "1 Closed at the border"
    page.open("slicing")
    page.page.get_by_label("Show three slices").focus()
    assert press(page, "Space", "isospline.state.slices.shown") == "Show three slices"
    page.page.get_by_label("Opacity", exact=True).focus()
    assert press(page, "ArrowLeft", "isospline.state.objects[1].opacity === 0.99") == "1 Opacity"
    assert press(page, "Control+z", "isospline.state.objects[1].opacity === 1") == "1 Opacity"
    second.get_by_role("button", name="Remove").focus()
    assert press(page, "Enter", "isospline.state.objects.length === 2") == "Surfaces"


def test_undo_keeps_the_focus_at_the_first_step(browser, ball):
    with shown(browser, ball) as (page, viewer):
        page.page.get_by_role("button", name="Hide").click()
        page.page.get_by_role("button", name="Undo").focus()
        assert press(page, "Enter", "isospline.state.objects[0].visible") == "Undo"
        assert press(page, "Shift+Tab", "true") != press(page, "Tab", "true") == "Undo"
        assert page.page.get_by_role("button", name="Undo").is_disabled() and viewer.state.objects[0].visible


def test_a_control_that_has_the_focus_shows_changes_from_elsewhere(panel):
    page, viewer = panel
    select(page, 0)
    opacity = page.page.get_by_label("Opacity", exact=True)
    opacity.focus()
    viewer.change(lambda state: state.with_object(0, opacity=0.2))
    page.wait("document.querySelector('[aria-label=Opacity]').value === '0.2'")
    assert page.evaluate(FOCUSED) == "0 Opacity"
    viewer.change(lambda state: state.with_new_object("source1", 3.0))
    page.wait("document.querySelectorAll('.object').length === 4")
    assert page.evaluate(FOCUSED) == "0 Opacity"
    page.page.locator(".object input.number >> nth=0").focus()
    viewer.change(lambda state: state.with_object(0, level=5.5))
    page.wait("document.querySelector('.object input.number').value === '5.5'")
    page.open("slicing")
    page.page.get_by_label("Window level").focus()
    viewer.change(lambda state: state.replace(slices=state.slices.replace(window=(4.0, 6.0))))
    page.wait("document.querySelector('[aria-label=\"Window level\"]').value === '5'")


def test_what_is_operated_stays_until_it_is_complete(panel):
    page, viewer = panel
    mouse, keyboard = page.page.mouse, page.page.keyboard
    select(page, 2)
    box = page.page.get_by_label("Opacity", exact=True).bounding_box()
    mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    mouse.down()
    viewer.change(lambda state: state.with_new_object("source1", 3.0))
    page.wait("isospline.state.objects.length === 4")
    mouse.move(box["x"] + box["width"] / 4, box["y"] + box["height"] / 2)  # the drag goes on
    page.wait("isospline.state.objects[2].opacity < 0.3")
    assert page.page.locator(".object").count() == 3
    mouse.up()
    page.wait("document.querySelectorAll('.object').length === 4")

    page.open("slicing")
    viewer.change(lambda state: state.replace(slices=state.slices.replace(window=(-4.0, 6.0))))
    page.wait("document.querySelector('[aria-label=Window]').value === '10'")
    page.page.get_by_label("Window", exact=True).click(click_count=3)
    keyboard.type("2")
    viewer.change(lambda state: state.replace(slices=state.slices.replace(window=(0.0, 10.0))))
    page.wait("isospline.state.slices.window[0] === 0")
    assert page.page.get_by_label("Window", exact=True).input_value() == "2"
    page.page.get_by_label("Show three slices").click()  # ends the field, and is heard
    page.wait("isospline.state.slices.shown && isospline.state.slices.window[0] === 4")
    page.wait("document.querySelector('[aria-label=\"Window level\"]').value === '5'")  # not that of before


def test_the_look_is_that_of_the_level_that_is_dragged(panel):
    page, viewer = panel
    viewer.change(lambda state: state.with_object(2, opacity=0.4))
    select(page, 0)
    page.page.get_by_label("Opacity", exact=True).focus()
    page.drag_element("#histogram [data-object='2']", (5, 0))
    page.wait("document.querySelector('[aria-label=Opacity]').value === '0.4'")


def test_limits_that_are_equal_are_refused(panel):
    page, viewer = panel
    select(page, 0)
    page.page.get_by_label("Colour by", exact=True).select_option("mean-curvature")
    first, last = (page.page.get_by_label(f"{name} value") for name in ("First", "Last"))
    page.wait("document.querySelector('[aria-label=\"First value\"]')?.value.startsWith('-')")  # 0 until they are known
    usual = last.input_value()
    first.fill(usual)
    first.press("Enter")
    page.wait("document.getElementById('messages').textContent.includes('limits: expected')")
    page.wait("isospline.state.objects[0].limits === null")
    page.wait(f"document.querySelector('[aria-label=\"First value\"]').value === '-{usual}'")
    page.page.locator("#messages p").click()
    page.settle()
