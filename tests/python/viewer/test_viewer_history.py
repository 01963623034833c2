"""Undo and redo, and messages that stay until they are read."""

import numpy as np
import pytest

pytest.importorskip("playwright")
from viewer_client import Client

from isospline.viewer.history import LIMIT, ONE_STEP, History, changed
from isospline.viewer.state import ViewState
from isospline.viewer.to_page import Steps


def levels(viewer):
    return [each.level for each in viewer.state.objects]


def test_states_come_back_in_order(viewer):
    first = viewer.state
    viewer.change(lambda state: state.replace(background="#102030"))
    viewer.change(lambda state: state.with_object(0, opacity=0.5))
    viewer.change(lambda state: state.with_new_object("source1", 100.0))
    last = viewer.state
    assert viewer.history == Steps(undo=True, redo=False)
    viewer.undo()
    assert len(viewer.state.objects) == 1 and viewer.state.object(0).opacity == 0.5
    viewer.undo()
    assert viewer.state.object(0).opacity == 1 and viewer.state.background == "#102030"
    viewer.undo()
    assert viewer.state == first
    assert viewer.history == Steps(undo=False, redo=True)
    viewer.undo()  # the file that was opened first stays
    assert viewer.state == first
    for _ in range(4):
        viewer.redo()
    assert viewer.state == last
    viewer.undo()
    viewer.change(lambda state: state.replace(light="phong"))
    assert viewer.history == Steps(undo=True, redo=False)


def test_a_drag_is_one_step():
    now = [0.0]
    history, state = History(clock=lambda: now[0]), ViewState().with_new_object("source1", 1.0)
    states = [state]

    def change(seconds, **changes):
        now[0] += seconds
        states.append(states[-1].with_object(0, **changes))
        history.record(states[-2], states[-1])

    for level in (2.0, 3.0, 4.0):
        change(0.1, level=level)
    change(0.1, opacity=0.5)  # something else
    change(ONE_STEP + 0.1, opacity=0.25)  # later
    history.record(states[-1], states[-1])  # nothing
    back = states[-1]
    change(0.1, visible=False)
    change(0.1, visible=True)  # as before
    found = []
    while history.can_undo:
        back = history.undo(back)
        found.append((back.object(0).level, back.object(0).opacity))
    assert found == [(4.0, 0.5), (4.0, 1.0), (1.0, 1.0)]
    assert changed(states[0], states[1]) == {(0, "level")}
    assert changed(states[0], states[0].without_object(0)) == {(0, "removed")}


def test_a_drag_through_its_start_keeps_the_step_before():
    now, state = [0.0], ViewState().with_new_object("source1", 40.5, color="#111111")
    history = History(clock=lambda: now[0])

    def change(seconds, **changes):
        nonlocal state
        now[0] += seconds
        before, state = state, state.with_object(0, **changes)
        history.record(before, state)

    change(0.0, color="#222222")
    change(10.0, level=41.5)
    for level in (40.5, 39.5, 35.5):
        change(0.2, level=level)
    before = history.undo(state).object(0)
    assert (before.level, before.color) == (40.5, "#222222")
    assert history.undo(state).object(0).color == "#111111"


def test_windows_ask_for_undo_and_are_told(viewer):
    client = Client(viewer)
    client.receive("frame")
    before = levels(viewer)
    client.send(type="change_object", id=0, changes={"level": 123.0}, input=1)
    while not (about := client.receive("state")[0])["history"]["undo"]:
        pass
    assert about["state"]["objects"][0]["level"] == 123.0
    client.send(type="undo", input=2)
    while not (about := client.receive("state")[0])["history"]["redo"]:
        pass
    assert levels(viewer) == before and not about["history"]["undo"]
    client.send(type="redo", input=3)
    while not client.receive("state")[0]["history"]["undo"]:
        pass
    assert levels(viewer) == [123.0]
    client.socket.close()


def test_keys_and_buttons(page, viewer):
    undo = page.page.get_by_role("button", name="Undo")
    assert undo.is_disabled()
    page.page.get_by_role("button", name="Phong").click()
    page.wait("isospline.history.undo")
    page.settle()
    page.page.keyboard.press("Control+z")
    page.wait("isospline.state.light === 'studio' && isospline.history.redo")
    page.page.keyboard.press("Control+Shift+z")
    page.wait("isospline.state.light === 'phong'")
    undo.click()
    page.wait("isospline.state.light === 'studio'")
    page.settle()
    # In a field for a number, the keys are the field's.
    page.page.get_by_label("Level of").first.click()
    page.page.keyboard.press("Control+Shift+z")
    page.settle()
    assert viewer.state.light == "studio"


def test_messages_stay_until_they_are_closed(page, viewer, tmp_path):
    broken = tmp_path / "broken.nii.gz"
    broken.write_bytes(b"nothing")
    page.page.locator("#open").set_input_files([broken])
    page.wait("document.querySelectorAll('#messages p').length === 1")
    text = page.messages()
    assert "broken.nii.gz" in text and "isospline-" not in text and "/" not in text.split("broken")[0]
    page.page.locator("#open").set_input_files([broken])
    page.page.wait_for_timeout(500)
    assert page.evaluate("document.querySelectorAll('#messages p').length") == 1
    page.page.get_by_role("button", name="Close the message").click()
    assert not page.messages()


def test_steps_are_limited():
    history, state = History(clock=iter(np.arange(0, 1e5, 10.0)).__next__), ViewState().with_new_object("source1", 0.0)
    for level in range(LIMIT + 10):
        after = state.with_object(0, level=float(level + 1))
        history.record(state, after)
        state = after
    count = 0
    while history.can_undo:
        state = history.undo(state)
        count += 1
    assert count == LIMIT and state.object(0).level == 10.0
