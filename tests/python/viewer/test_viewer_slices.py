"""Slices in the page: what they tell, the keyboard, and that they do not disturb the picture; zoom at the pointer."""

import re

import numpy as np
import pytest

pytest.importorskip("playwright")
from browser import Page
from browser import shown as show

import isospline
from isospline.viewer import window

SHAPE = (20, 24, 30)  # samples along z, y and x


@pytest.fixture(scope="module")
def head(tmp_path_factory):
    """A patient's volume with values x + 100 y + 10000 z; x runs to the right, and y to the front."""
    nibabel = pytest.importorskip("nibabel")
    z, y, x = np.indices(SHAPE)
    samples = (x + 100.0 * y + 10000.0 * z).astype(np.float32)
    path = tmp_path_factory.mktemp("head") / "head.nii.gz"
    nibabel.save(nibabel.Nifti1Image(samples.T, np.diag([2.0, 2.0, 3.0, 1.0])), path)  # RAS, as NIfTI has it
    return path


@pytest.fixture
def shown(browser, head):
    with show(browser, head, (760, 400), levels=[100_000]) as (page, viewer):
        page.open("slicing")
        page.page.get_by_label("Show three slices").click()
        page.page.locator("#slices figcaption").nth(2).filter(has_text=re.compile(r"\S")).wait_for()
        page.settle()
        yield page, viewer


def test_slices_do_not_disturb_the_picture(shown):
    page, viewer = shown
    pictures = page.evaluate("isospline.framesShown")
    box = page.page.locator("#slices canvas >> nth=0").bounding_box()
    page.page.mouse.click(box["x"] + 0.4 * box["width"], box["y"] + 0.4 * box["height"])
    page.page.get_by_label("Window", exact=True).fill("1000")
    page.page.keyboard.press("Enter")
    page.settle()
    assert viewer.state.slices.window is not None and viewer.state.slices.index != ((30 - 1) / 2, 11.5, 9.5)
    assert page.evaluate("isospline.framesShown") == pictures
    # The grey values of a cut are those of the window.
    viewer.change(lambda state: state.replace(clip=state.clip.replace(kind="plane", point=(-30, -20, 30), values=True)))
    page.wait(f"isospline.framesShown > {pictures}")
    page.settle()
    pictures = page.evaluate("isospline.framesShown")
    page.page.get_by_label("Window", exact=True).fill("2000")
    page.page.keyboard.press("Enter")
    page.wait(f"isospline.framesShown > {pictures}")
    page.settle()


def test_the_point_under_the_pointer_is_told(shown):
    page, _ = shown
    view = "(() => { const c = document.querySelectorAll('#slices canvas')[2], b = c.getBoundingClientRect();"
    view += " return [b.x, b.y, b.width, b.height]; })()"
    left, top, width, height = page.evaluate(view)
    page.page.mouse.move(left + width / 2 + 20, top + height / 2 + 15)
    caption = page.page.locator("#slices figcaption").nth(2)
    caption.filter(has_text="value").wait_for()
    slice_text, index_text, place_text, value_text = caption.inner_text().split("\n")
    x, y, z = map(float, index_text.removeprefix("index ").split(", "))
    assert slice_text == "z = 9.5" and z == 9.5
    # In the world, x runs to the left and y to the back.
    assert place_text.endswith(" mm")
    np.testing.assert_allclose(
        [float(each) for each in place_text[:-3].split(", ")], (-2 * x, -2 * y, 3 * z), atol=0.02
    )
    assert float(value_text.removeprefix("value ")) == pytest.approx(x + 100 * y + 10000 * z, rel=1e-3)
    page.page.mouse.move(left + width / 2, top - 50)
    page.wait("!document.querySelectorAll('#slices figcaption')[2].textContent.includes('value')")


def test_values_are_told_again_after_an_error(shown, monkeypatch):
    """As of a store with a damaged chunk."""
    page, _ = shown

    def value_at(*_):
        raise OSError("chunk 3/1/2 cannot be read")

    box = page.page.locator("#slices canvas >> nth=2").bounding_box()
    with monkeypatch.context() as damaged:
        damaged.setattr(window, "value_at", value_at)
        page.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.page.get_by_text("chunk 3/1/2 cannot be read").wait_for()
    caption_of(page, (0.4, 0.45))


def test_the_slices_have_borders_in_the_picture(shown):
    """As places of the picture: those of the corners in space, found again with the camera's rays."""
    page, viewer = shown
    camera = viewer.state.camera.camera()
    box = page.page.locator("#picture").bounding_box()
    size = round(box["width"]), round(box["height"])
    polygons = page.evaluate(
        "[...document.querySelectorAll('#overlay .slice')].map(each => each.getAttribute('points'))"
    )
    affine = viewer.document["source1"].item.affine
    directions = camera.rays(size)[..., 3:]
    for axis, text in enumerate(polygons):
        others = [each for each in range(3) if each != axis]
        for corner, at in zip(text.split(), [(0, 0), (1, 0), (1, 1), (0, 1)]):
            index = np.array([14.5, 11.5, 9.5, 1.0])
            index[others] = np.multiply(at, np.array((29, 23, 19))[others])
            along = (affine @ index)[:3] - camera.eye
            x, y = map(float, corner.split(","))
            if 0 <= x < size[0] and 0 <= y < size[1]:
                ray = directions[int(y), int(x)]
                cosine = along @ ray / np.linalg.norm(along) / np.linalg.norm(ray)
                assert cosine > np.cos(np.radians(0.3))
    assert len(polygons) == 3


def test_the_keyboard_moves_the_point_as_it_is_drawn(shown):
    page, viewer = shown
    canvas = page.page.locator("#slices canvas >> nth=2")
    canvas.focus()
    assert viewer.state.slices.index == (14.5, 11.5, 9.5)
    # The patient's left, which is at lower x here, is on the right; the front is at the top.
    for key, index in (
        ("ArrowRight", (13.5, 11.5, 9.5)),
        ("ArrowUp", (13.5, 12.5, 9.5)),
        ("PageDown", (13.5, 12.5, 10.5)),
        ("ArrowLeft", (14.5, 12.5, 10.5)),
        ("ArrowDown", (14.5, 11.5, 10.5)),
        ("PageUp", (14.5, 11.5, 9.5)),
    ):
        page.page.keyboard.press(key)
        page.settle()
        assert viewer.state.slices.index == index


def test_slices_of_a_sagittal_series_are_upright(browser, head, tmp_path):
    """The grid runs to the back, to the head and to the right: the shades are those of the places in space."""
    nibabel = pytest.importorskip("nibabel")
    orientations = nibabel.orientations
    image = nibabel.load(head)
    change = orientations.ornt_transform(
        orientations.axcodes2ornt(("R", "A", "S")), orientations.axcodes2ornt(("P", "S", "R"))
    )
    path = tmp_path / "sagittal.nii.gz"
    nibabel.save(image.as_reoriented(change), path)
    with show(browser, path, (760, 400), levels=[100_000]) as (page, viewer):
        page.open("slicing")
        page.page.get_by_label("Show three slices").click()
        page.wait("!!isospline.slices.values?.values[0]")
        page.settle()
        low, high = viewer.state.slices.window
        affine = viewer.document["source1"].item.affine
        canvases = "document.querySelectorAll('#slices canvas')"
        # Across the grid's axes, which run to the back, the head and the right: coronal, axial and sagittal.
        for axis, (right, down) in enumerate(
            [((1, 0, 0), (0, 0, -1)), ((1, 0, 0), (0, 1, 0)), ((0, 1, 0), (0, 0, -1))]
        ):
            places = []
            for place in ((0.45, 0.42), (0.55, 0.42), (0.45, 0.58)):
                found, shade = page.evaluate(
                    f"""(([x, y]) => {{
                        const view = isospline.slices.views[{axis}], canvas = {canvases}[{axis}];
                        const box = canvas.getBoundingClientRect();
                        const at = [x * canvas.width, y * canvas.height].map(Math.round);
                        const shade = canvas.getContext('2d').getImageData(...at, 1, 1).data[0];
                        const client = [box.x + (at[0] + 0.5) / canvas.width * box.width,
                                        box.y + (at[1] + 0.5) / canvas.height * box.height];
                        return [isospline.slices.pointAt(view, client).index, shade];
                    }})""",
                    place,
                )
                places.append((affine @ (*found, 1))[:3])
                x, y, z = np.divide(places[-1], (-2, -2, 3))  # in the grid of the first file
                value = x + 100 * y + 10000 * z
                assert shade == pytest.approx(np.clip((value - low) / (high - low) * 255, 0, 255), abs=3)
            for other, direction in ((1, right), (2, down)):
                move = places[other] - places[0]
                np.testing.assert_allclose(move / np.linalg.norm(move), direction, atol=1e-6)


def caption_of(page, place):
    """Index and value that the third slice tells at a place of it, in parts of its width and height."""
    box = page.page.locator("#slices canvas >> nth=2").bounding_box()
    page.page.mouse.move(round(box["x"] + place[0] * box["width"]), round(box["y"] + place[1] * box["height"]))
    page.page.wait_for_timeout(100)  # events of the pointer come with the next frame
    page.wait("document.querySelectorAll('#slices figcaption')[2].textContent.includes('value')")
    _, index, _, value = page.page.locator("#slices figcaption").nth(2).inner_text().split("\n")
    return [float(each) for each in index.removeprefix("index ").split(", ")], float(value.removeprefix("value "))


def gray_of(page, view, index):
    """The gray value of a slice at an index, by the place where the page draws it."""
    return page.evaluate(
        f"""(([x, y]) => {{
            const slices = isospline.slices, view = slices.views[{view}], place = slices.placement(view);
            const [left, top] = slices.rectangle(view, place, [x, y], [x, y]);
            return [...view.canvas.getContext('2d').getImageData(left, top, 1, 1).data.slice(0, 3)];
        }})""",
        index,
    )


def test_slices_zoom_at_the_pointer_and_get_finer_values(shown):
    page, viewer = shown
    page.page.set_viewport_size({"width": 900, "height": 700})
    place = (0.4, 0.45)
    before, _ = caption_of(page, place)
    views = "isospline.slices.views.map(view => isospline.slices.seen(view))"
    whole = page.evaluate(views)
    assert whole[2]["lower"] == [0, 0] and whole[2]["upper"] == [29, 23]
    page.page.keyboard.down("Control")
    for _ in range(8):
        page.page.mouse.wheel(0, -200)
    page.page.keyboard.up("Control")
    page.wait("isospline.slices.zoom > 9")
    after, _ = caption_of(page, place)
    np.testing.assert_allclose(after, before, atol=0.02)  # the point under the pointer stays
    assert viewer.state.slices.index == (14.5, 11.5, 9.5)
    seen = page.evaluate(views)[2]
    page.wait(
        f"(({{lower, upper}}) => JSON.stringify([lower, upper]) === JSON.stringify([{seen['lower']}, {seen['upper']}]))"
        "(isospline.slices.values.values[2])"
    )
    page.wait("(({rows, columns}) => Math.max(rows, columns))(isospline.slices.values.values[2]) > 30")
    span = np.subtract(seen["upper"], seen["lower"])
    rows, columns = page.evaluate("(({rows, columns}) => [rows, columns])(isospline.slices.values.values[2])")
    assert max(span) < 6 and (columns - 1, rows - 1) == tuple(np.round(span / 0.125))  # eight points a sample
    # Shades are those of the values there: the window is that of the page.
    low, high = viewer.state.slices.window
    index = (np.array(seen["lower"]) + span / 2).round(1).tolist()
    value = index[0] + 100 * index[1] + 10000 * 9.5
    shades = gray_of(page, 2, index)
    assert shades[0] == pytest.approx(np.clip((value - low) / (high - low) * 255, 0, 255), abs=3)
    # Panning moves the slices with the pointer.
    box = page.page.locator("#slices canvas >> nth=2").bounding_box()
    middle = (round(box["x"] + 0.4 * box["width"]), round(box["y"] + 0.45 * box["height"]))
    page.drag(middle, (middle[0] + 30, middle[1] - 20), button="middle")
    moved, _ = caption_of(page, (0.4 + 30 / box["width"], 0.45 - 20 / box["height"]))
    np.testing.assert_allclose(moved, after, atol=0.05)
    page.page.locator("#slices canvas >> nth=2").focus()
    page.page.keyboard.press("0")
    assert page.evaluate(views)[2]["upper"] == [29, 23]
    page.settle()


def test_two_fingers_zoom_and_move_the_slices(shown):
    page, viewer = shown
    index = viewer.state.slices.index
    view = "isospline.slices.views[2]"
    touch = page.page.context.new_cdp_session(page.page)
    touch.send("Emulation.setTouchEmulationEnabled", {"enabled": True, "maxTouchPoints": 2})
    page.settle()
    box = page.page.locator("#slices canvas >> nth=2").bounding_box()  # without scroll bars

    def at(*places):
        return [
            {"x": box["x"] + x * box["width"], "y": box["y"] + y * box["height"], "id": id}
            for id, (x, y) in enumerate(places)
        ]

    def under(x, y):
        (point,) = at((x, y))
        return page.evaluate(f"isospline.slices.pointAt({view}, [{point['x']}, {point['y']}]).index")

    before = under(0.5, 0.5)
    touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": at((0.4, 0.5))})
    touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": at((0.4, 0.5), (0.6, 0.5))})
    touch.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": at((0.3, 0.5), (0.6, 0.5))})
    touch.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": at((0.3, 0.5), (0.7, 0.5))})
    page.wait("Math.abs(isospline.slices.zoom - 2) < 0.05")
    np.testing.assert_allclose(under(0.5, 0.5), before, atol=0.05)
    touch.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": at((0.4, 0.5), (0.8, 0.5))})
    (point,) = at((0.6, 0.5))
    where = f"isospline.slices.pointAt({view}, [{point['x']}, {point['y']}]).index[0]"
    page.wait(f"Math.abs({where} - {before[0]}) < 0.05 && Math.abs(isospline.slices.zoom - 2) < 0.05")
    touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    page.wait(f"{view}.fingers.size === 0")
    page.settle()
    assert viewer.state.slices.index == index  # the first finger alone would have moved the point
    page.page.locator("#slices canvas >> nth=2").focus()
    page.page.keyboard.press("0")
    touch.send("Emulation.setTouchEmulationEnabled", {"enabled": False})


def test_a_slice_is_maximised(shown):
    page, viewer = shown
    size = page.page.locator("#picture").bounding_box()
    pictures = page.evaluate("isospline.framesShown")
    page.page.locator("#slices canvas >> nth=1").focus()
    page.page.keyboard.press("m")
    page.wait("document.querySelectorAll('#slices figure[hidden]').length === 2")
    box = page.page.locator("#slices canvas >> nth=1").bounding_box()
    assert box["width"] == size["width"] and box["height"] >= size["height"]
    page.page.keyboard.press("PageDown")
    page.page.keyboard.press("Escape")
    page.wait("!document.querySelectorAll('#slices figure[hidden]').length")
    assert page.page.locator("#picture").bounding_box() == size and viewer.state.slices.index[1] == 12.5
    page.settle()
    assert page.evaluate("isospline.framesShown") == pictures
    page.page.locator("#slices canvas >> nth=0").dblclick()
    page.wait("document.querySelectorAll('#slices figure[hidden]').length === 2")
    page.page.get_by_role("button", name="Zoom in (+): slice across x").click()
    page.wait("isospline.slices.zoom === 1.5")
    page.page.get_by_role("button", name="Maximise (m): slice across x").click()
    page.wait("!document.querySelectorAll('#slices figure[hidden]').length")
    page.page.get_by_label("Show three slices").click()
    page.settle()


def test_the_sides_of_a_patient_are_named(browser, head):
    """Letters are drawn at the edges; the page records them."""
    with isospline.view(head, levels=[100_000], browser=False) as viewer:
        page = Page(browser, viewer.url)
        page.settle()
        page.evaluate(
            """() => {
            window.written = [];
            const original = CanvasRenderingContext2D.prototype.fillText;
            CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
                written.push([[...document.querySelectorAll('#slices canvas')].indexOf(this.canvas), text,
                    x / this.canvas.width, y / this.canvas.height]);
                original.call(this, text, x, y);
            }; }"""
        )
        page.open("slicing")
        page.page.get_by_label("Show three slices").click()
        page.wait("written.length >= 12")
        sides = {}
        for view, letter, x, y in page.evaluate("written"):
            edge = "left" if x < 0.2 else "right" if x > 0.8 else "top" if y < 0.2 else "bottom"
            sides[view, edge] = letter
        page.close()
    edges = ("left", "right", "top", "bottom")
    assert [sides[0, edge] for edge in edges] == ["A", "P", "S", "I"]
    assert [sides[1, edge] for edge in edges] == ["R", "L", "S", "I"]
    assert [sides[2, edge] for edge in edges] == ["R", "L", "A", "P"]


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_zooming_keeps_what_is_under_the_pointer(page, viewer, projection):
    page.page.set_viewport_size({"width": 600, "height": 300})
    page.settle()
    if projection == "orthographic":
        page.page.get_by_role("button", name="Orthographic").click()
        page.settle()

    def point_at(camera, right, up):
        """The point in the plane of the target, at a distance from the middle in heights of the picture."""
        eye, target = np.array(camera["eye"]), np.array(camera["target"])
        forward = (target - eye) / np.linalg.norm(target - eye)
        side = np.cross(forward, camera["up"])
        side /= np.linalg.norm(side)
        angle = np.radians(camera["field_of_view"]) / 2
        height = camera["height"] if projection == "orthographic" else 2 * np.linalg.norm(target - eye) * np.tan(angle)
        return target + height * (right * side + up * np.cross(side, forward))

    box = page.page.locator("#picture").bounding_box()
    x, y = 0.7 * box["width"], 0.3 * box["height"]
    right, up = (x - box["width"] / 2) / box["height"], (box["height"] / 2 - y) / box["height"]
    before = page.evaluate("isospline.camera")
    page.page.mouse.move(box["x"] + x, box["y"] + y)
    page.page.mouse.wheel(0, -300)
    page.wait(f"isospline.camera.height !== {before['height']}")
    page.settle()
    after = page.evaluate("isospline.camera")
    np.testing.assert_allclose(point_at(after, right, up), point_at(before, right, up), rtol=1e-3, atol=1e-3)
    assert not np.allclose(after["target"], before["target"])


def test_a_telephone_has_a_drawer_and_a_wide_picture(page, viewer):
    page.page.set_viewport_size({"width": 390, "height": 780})
    page.settle()
    assert page.page.locator("#picture").bounding_box()["width"] == 390
    panel = page.page.locator("#panel")
    panel.wait_for(state="hidden")  # after its transition
    page.page.get_by_role("button", name="Controls").click()
    page.page.get_by_role("button", name="Phong").click()
    page.wait("isospline.state.light === 'phong'")
    box = panel.bounding_box()
    assert box["x"] + box["width"] <= 391 and page.evaluate("document.documentElement.scrollWidth") == 390
    page.page.keyboard.press("Escape")
    panel.wait_for(state="hidden")
    assert page.evaluate("document.activeElement.id") == "show-panel"
    page.page.keyboard.press("Enter")
    panel.wait_for(state="visible")
    page.page.get_by_role("button", name="Hide the controls").click()
    panel.wait_for(state="hidden")


def test_dark_mode(page):
    color = "getComputedStyle(document.getElementById('panel')).backgroundColor"
    ink = "getComputedStyle(document.getElementById('panel')).color"
    of_picture = "getComputedStyle(document.getElementById('status')).color"
    light = [page.evaluate(each) for each in (color, ink, of_picture)]
    page.page.emulate_media(color_scheme="dark")
    dark = [page.evaluate(each) for each in (color, ink, of_picture)]
    brightness = [[sum(map(int, re.findall(r"\d+", each)[:3])) for each in both] for both in (light, dark)]
    assert brightness[0][0] > 700 > 300 > brightness[1][0] and brightness[0][1] < 300 < 600 < brightness[1][1]
    assert dark[2] == light[2]
