"""Files in the page: closing them, the form for samples alone, and pictures of any size."""

import gc
import io
import os
import threading
import time
import weakref

import numpy as np
import PIL.Image
import pytest

pytest.importorskip("playwright")
from browser import shown as show
from viewer_client import Client

import isospline
from isospline.viewer.history import History
from isospline.viewer.state import ViewState


@pytest.fixture
def shown(browser, large_ball):
    with show(browser, large_ball, levels=[0]) as opened:
        yield opened


def upload(page, *files):
    count = page.evaluate("isospline.sources.size")
    page.page.set_input_files("#open", [{"name": name, "mimeType": "", "buffer": content} for name, content in files])
    return count


def wait_for_no(folder):
    end = time.monotonic() + 30
    while os.path.exists(folder):
        assert time.monotonic() < end
        time.sleep(0.02)


def test_a_closed_volume_frees_its_memory_and_leaves_no_trace(shown):
    page, viewer = shown
    samples = io.BytesIO()
    np.save(samples, np.indices((20, 21, 22)).sum(axis=0).astype(np.float32))
    count = upload(page, ("ramp.npy", samples.getvalue()))
    page.wait(f"isospline.sources.size === {count + 1}")
    page.settle()
    ramp = next(source for source in viewer.document if source.name == "ramp.npy")
    key = ramp.key
    shown_slices = viewer.state.slices.replace(volume=key, shown=True, index=(1, 2, 3))
    viewer.change(lambda state: state.with_object(0, color_by=key))  # of the other object
    viewer.change(lambda state: state.replace(slices=shown_slices))
    viewer.change(lambda state: state.replace(light="path-trace"))
    page.settle()
    viewer.change(lambda state: state.replace(light="phong"))
    page.settle()
    volume, folder = weakref.ref(ramp.item), ramp.within
    del ramp
    assert os.path.isdir(folder)
    page.page.get_by_role("button", name="Close ramp.npy").click()
    page.wait("isospline.sources.size === 1 && isospline.state.objects.length === 1")
    page.settle()
    (each,), slices = viewer.state.objects, viewer.state.slices
    assert each.color_by == "color" and slices.volume == each.source and slices.index == (32, 32, 32)
    wait_for_no(folder)
    for _ in range(4):  # undo does not bring it back
        viewer.undo()
        assert key not in str(viewer.state)
    viewer.change(lambda state: state.replace(light="outline"))
    page.settle()
    page.wait("isospline.framesShown > 0")
    for _ in range(100):
        gc.collect()
        if volume() is None:
            break
        page.page.wait_for_timeout(50)
    assert volume() is None
    upload(page, ("ramp.npy", samples.getvalue()))
    page.wait("isospline.sources.size === 2")
    assert key not in [source.key for source in viewer.document]
    assert page.messages().strip() == ""


def test_states_of_the_history_are_replaced():
    states = [ViewState().with_new_object("a", level) for level in (1.0, 2.0)]
    history = History(clock=iter(np.arange(0, 1e3, 10.0)).__next__)
    history.record(ViewState(), states[0])
    history.record(states[0], states[1])
    history.record(states[1], ViewState(light="phong"))
    history.replace(lambda state: state.with_keys({}), ViewState(light="phong"))
    assert history.undo(ViewState(light="phong")) == ViewState() and not history.can_undo
    history.replace(lambda state: ViewState(), ViewState())
    assert not history.can_undo and not history.can_redo


def test_the_last_file_can_be_closed(shown):
    page, viewer = shown
    page.page.get_by_role("button", name="Close ball.npy").click()
    page.wait("isospline.sources.size === 0 && !document.getElementById('welcome').hidden")
    assert viewer.state.objects == () and viewer.state.slices.volume is None
    page.settle()
    page.open("cut")
    page.page.get_by_role("button", name="Box").click()
    page.settle()


def test_a_form_asks_for_the_shape_of_samples_alone(shown):
    page, viewer = shown
    z, y, x = np.indices((20, 22, 30))
    data = (1000 * np.exp(-((x - 15) ** 2 + (y - 11) ** 2 + (z - 10) ** 2) / 60)).astype(">u2")
    upload(page, ("part.raw", b"header" + data.tobytes()), ("other.raw", data.tobytes()))
    dialog = page.page.locator("dialog")
    dialog.wait_for()

    def fields(label):
        return [int(dialog.get_by_label(f"{label} along {axis}").input_value()) for axis in "xyz"]

    assert dialog.locator("h2").inner_text() == "part.raw"
    for axis, count in zip("xyz", (30, 22, 20)):
        dialog.get_by_label(f"Samples along {axis}").fill(str(count))
    dialog.get_by_label("Type").select_option("u2")
    open_button = dialog.get_by_role("button", name="Open")
    assert open_button.is_disabled() and "are 26,400 bytes; the file has 26,406." in dialog.inner_text()
    dialog.get_by_label("Bytes before the samples").fill("6")
    dialog.get_by_label("Most significant byte first").set_checked(True)
    dialog.get_by_label("Spacing along z").fill("2,5")
    dialog.get_by_label("Spacing along z").press("Tab")
    assert "26,400 after its header" in dialog.inner_text()
    open_button.click()
    page.wait("isospline.sources.size === 2")
    part = next(source for source in viewer.document if source.name == "part.raw")
    np.testing.assert_allclose(part.item.spacing, (1, 1, 2.5))
    assert part.item.sample((15, 11, 25)) == pytest.approx(1000, abs=1)
    # The second one is suggested, and refused.
    page.wait("document.querySelector('dialog h2')?.textContent === 'other.raw'")
    assert fields("Samples") == [30, 22, 20] and dialog.get_by_label("Type").input_value() == "u2"
    assert dialog.get_by_label("Most significant byte first").is_checked() and open_button.is_enabled()
    folders = {os.path.dirname(source.path) for source in viewer.document if source.within}
    page.page.keyboard.press("Escape")
    page.wait("!document.querySelector('dialog')")
    page.settle()
    assert folders == {part.within}
    page.page.get_by_role("button", name="Close part.raw").click()
    page.wait("isospline.sources.size === 1")
    wait_for_no(part.within)
    assert page.messages().strip() == ""


def test_raw_files_of_any_name_and_answers_at_once(shown):
    page, viewer = shown
    ramp = np.arange(120, dtype="<i8").tobytes()
    upload(page, ("v_4x5x6_int64.raw", ramp), ("w_4x5x7_int64.raw", ramp))
    page.wait("document.querySelector('dialog h2')?.textContent === 'v_4x5x6_int64.raw'")
    dialog = page.page.locator("dialog")
    assert dialog.get_by_label("Type").input_value() == "i8"
    dialog.get_by_label("Samples along x").fill("4.5")
    dialog.get_by_label("Samples along x").press("Tab")
    assert "expected a whole number, got 4.5" in dialog.inner_text() and page.messages().strip() == ""
    # The second one is refused while the first one is opened: its folder stays.
    page.evaluate("document.querySelector('dialog form').requestSubmit()")
    page.wait("document.querySelector('dialog h2')?.textContent === 'w_4x5x7_int64.raw'")
    assert dialog.get_by_label("Samples along x").input_value() == "1"  # the name does not match the size
    page.evaluate("document.querySelector('dialog').close()")
    page.wait("isospline.sources.size === 2")
    first = next(source for source in viewer.document if source.name.startswith("v_"))
    assert os.path.exists(first.path)
    page.page.get_by_role("button", name="Close v_4x5x6_int64.raw").click()
    wait_for_no(first.within)
    assert page.messages().strip() == ""


def test_a_refused_change_is_taken_back(shown):
    page, viewer = shown
    page.evaluate("isospline.changeState({slices: {...isospline.state.slices, volume: 'nothing'}})")
    page.wait("isospline.state.slices.volume === 'source1'")
    assert "expected the key of an open volume" in page.messages()


def test_what_is_made_of_a_closed_source_goes(ball):
    with isospline.view(ball, browser=False) as viewer:
        viewer.change(lambda state: state.with_new_object("source9", 1.0).with_object(0, color_by="source8"))
        (each,) = viewer.state.objects
        assert (each.source, each.color_by) == ("source1", "color")
        folder = viewer.uploads.folder([5, 6])
        with viewer.holding(folder):
            viewer.discard_unused(os.path.join(folder, "files1"))
            assert os.path.isdir(folder)
        assert not os.path.exists(folder)


def test_pictures_are_saved_at_any_size_and_without_background(shown):
    page, viewer = shown
    page.open("saving")
    assert [page.page.get_by_label(side).input_value() for side in ("Width", "Height")] == ["220", "220"]
    page.page.get_by_label("Width").fill("300")
    page.page.get_by_label("Height").fill("200")
    page.page.get_by_label("Transparent background").check()
    _, content = page.download("[data-save=png]")
    picture = np.asarray(PIL.Image.open(io.BytesIO(content)))
    assert picture.shape == (200, 300, 4)
    assert picture[0, 0, 3] == 0 and picture[100, 150, 3] == 255
    page.page.get_by_label("Transparent background").uncheck()
    _, content = page.download("[data-save=png]")
    picture = PIL.Image.open(io.BytesIO(content))
    assert picture.size == (300, 200) and np.asarray(picture.convert("RGBA"))[..., 3].min() == 255
    _, content = page.download("[data-save=python]")
    assert b"size=(300, 200)" in content
    page.page.get_by_role("button", name="Size of the picture").click()
    assert [page.page.get_by_label(side).input_value() for side in ("Width", "Height")] == ["220", "220"]
    _, content = page.download("[data-save=python]")
    assert b"size=(220, 220)" in content
    page.evaluate("isospline.send({type: 'save', what: 'png', options: {width: 16384, height: 16384}})")
    text = "size: expected at most 67108864 pixels, got 16384 x 16384"
    page.wait(f"document.getElementById('messages').textContent.includes('{text}')")
    # The page's own size follows the window until another one is given.
    page.page.reload()
    page.settle()
    page.page.set_viewport_size({"width": 640, "height": 200})
    page.wait("document.querySelector('[aria-label=Height]').value === '200'")
    page.settle()


def camera_after(client, action):
    """The camera before the first picture of what an action shows."""
    action()
    camera = None
    while True:
        about, _ = client.receive("camera_moved", "frame")
        if about["type"] == "camera_moved":
            camera = about["camera"]
        elif about["objects"]:
            return camera, about["camera"]


def test_a_larger_file_is_in_the_picture_from_the_same_side(tmp_path):
    small, large = (isospline.VolumeData(np.pad(np.ones((4, 4, 4)), 4), spacing=(s, s, s)) for s in (1, 5))
    with isospline.view(browser=False) as viewer:
        client = Client(viewer)
        client.receive("frame")  # of nothing
        moved, first = camera_after(client, lambda: viewer.add(small, levels=[0.5]))
        assert moved == first  # the picture and the camera come together
        key = next(iter(viewer.document)).key
        for levels in ([0.4], [0.3]):  # what reaches no farther does not move the camera
            again = camera_after(client, lambda levels=levels: viewer.add(small, levels=levels))
            assert again == (None, first)
        moved, second = camera_after(client, lambda: viewer.add(large, levels=[0.5]))
        assert moved == second
        eyes = [np.subtract(each["eye"], each["target"]) for each in (first, second)]
        directions = [eye / np.linalg.norm(eye) for eye in eyes]
        np.testing.assert_allclose(directions[0], directions[1], atol=1e-6)
        assert np.linalg.norm(eyes[1]) > 3 * np.linalg.norm(eyes[0]) and viewer.document[key].name == key
        client.close()


def test_a_page_says_that_the_file_is_read(browser, ball, monkeypatch):
    """Also one that is opened meanwhile, which has no scale, cube or status of an empty picture."""
    from browser import Page

    shown, reading = threading.Event(), isospline.viewer.document.read_volume

    def read_volume(*arguments, **options):
        shown.wait(30)
        return reading(*arguments, **options)

    with isospline.view(browser=False) as viewer:
        page = Page(browser, viewer.url)
        page.wait("!!isospline.frame")
        assert page.page.inner_text("#welcome") == "Drop a volume or a mesh here"
        monkeypatch.setattr("isospline.viewer.document.read_volume", read_volume)
        viewer.submit(viewer.open, ball)
        other = Page(browser, viewer.url)
        for each in (page, other):
            each.wait("document.getElementById('progress').innerText.includes('reading ball.npy')")
            assert not each.page.is_visible("#welcome")
        shown.set()
        for each in (page, other):
            each.settle()
            each.wait("document.getElementById('progress').hidden && isospline.frame.objects === 1")
            assert each.page.is_visible("#scale-bar") and each.page.is_visible("#status")
            assert not each.page.is_visible("#welcome")
        viewer.add(np.load(ball).astype(float), levels=[10])
        page.wait("isospline.selected === 1")  # the new file's
        viewer.change(lambda state: state.without_object(0).without_object(1))
        page.wait("document.getElementById('welcome').innerText === 'No surface is shown'")
        for each in (page, other):
            each.close()
            assert not each.problems
