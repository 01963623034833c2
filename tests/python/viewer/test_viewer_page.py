"""The viewer in Chromium: actions of a user on the page, and its pictures compared with those of `render`."""

import base64
import csv
import io
import json
import time

import numpy as np
import PIL.Image
import pytest
import trimesh
from browser import Page

import isospline
from isospline import volumes

pytestmark = pytest.mark.slow

LEVEL = 0.0


@pytest.fixture
def viewer(large_ball):
    with isospline.view(large_ball, levels=[LEVEL], browser=False) as opened:
        yield opened


def rendered(page, **changes):
    """The picture of the page's state made by `render`, in a separate program."""
    camera, size = page.evaluate("isospline.frame.camera"), page.evaluate("isospline.frame.size")
    state = page.evaluate("isospline.state")
    (each,) = state["objects"]
    clip = changes.pop("clip", None)
    data = np.load(changes.pop("path"))
    surface = isospline.Isosurface(isospline.Volume(data), each["level"], clip=clip, capped=bool(clip))

    def srgb(color):
        return np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)]) / 255

    if camera["projection"] == "perspective":
        camera = isospline.PerspectiveCamera(camera["eye"], camera["target"], camera["up"], camera["field_of_view"])
    else:
        camera = isospline.OrthographicCamera(camera["eye"], camera["target"], camera["up"], height=camera["height"])
    image = isospline.render(
        isospline.Scene([surface]),
        camera,
        size=tuple(size),
        background=srgb(state["background"]),
        light=isospline.Studio(material=isospline.Material(srgb(each["color"]))),
    )
    return image.to_srgb()[..., :3]


def test_the_picture_that_stays_is_that_of_render(page, large_ball):
    assert page.evaluate("isospline.frame.format") == "png"
    np.testing.assert_array_equal(page.pixels(), rendered(page, path=large_ball))


def test_dragging_a_level_moves_the_surface(page, large_ball, viewer):
    before = page.pixels()
    page.drag_element("#histogram [data-object]", (-40, 0))
    page.settle()
    level = viewer.state.objects[0].level
    lower, upper = viewer.document[viewer.state.objects[0].source].range
    width = page.evaluate("document.getElementById('histogram').clientWidth")
    assert level == pytest.approx(LEVEL - 40 / width * (upper - lower), abs=(upper - lower) / 300)
    assert page.evaluate("isospline.latencies.length") > 2
    pixels = page.pixels()
    assert (pixels != before).any()
    np.testing.assert_array_equal(pixels, rendered(page, path=large_ball))


def test_a_level_typed_in_and_keys_on_the_histogram(page, viewer):
    field = page.page.locator(".object input.number")
    field.fill("5.5")
    page.settle()
    assert viewer.state.objects[0].level == 5.5
    marker = page.page.locator("#histogram [data-object]")
    marker.focus()
    marker.press("ArrowRight")
    page.settle()
    assert 5.5 < viewer.state.objects[0].level < 5.6


def test_levels_of_whole_numbers_stay_halfway_between_them(browser, tmp_path):
    z, y, x = np.indices((24, 24, 24)) - 11.5
    np.save(tmp_path / "ball.npy", (100 - 4 * np.sqrt(x**2 + y**2 + z**2)).round().astype(np.uint8))
    with isospline.view(tmp_path / "ball.npy", levels=[68.5], browser=False) as viewer:
        page = Page(browser, viewer.url)
        page.settle()

        def level_after(action):
            action()
            page.settle()
            return viewer.state.objects[0].level

        marker = page.page.locator("#histogram [data-object]")
        marker.focus()
        assert level_after(lambda: marker.press("ArrowRight")) == 69.5
        assert level_after(lambda: marker.press("ArrowLeft")) == 68.5
        dragged = level_after(lambda: page.drag_element("#histogram [data-object]", (33, 0)))
        assert dragged > 70 and dragged % 1 == 0.5
        page.page.locator(".object input.number").fill("70")
        page.settle()
        marker.focus()
        page.settle()
        assert level_after(lambda: marker.press("ArrowRight")) == 71
        assert level_after(lambda: marker.press("Shift+ArrowLeft")) == pytest.approx(70.9)
        page.close()


def test_orbit_pan_and_zoom(page, large_ball):
    start = page.evaluate("isospline.camera")
    page.drag((100, 150), (160, 120))
    page.settle()
    orbited = page.evaluate("isospline.camera")
    assert np.linalg.norm(np.subtract(orbited["eye"], orbited["target"])) == pytest.approx(
        np.linalg.norm(np.subtract(start["eye"], start["target"]))
    )
    assert orbited["target"] == pytest.approx(start["target"]) and np.dot(orbited["eye"], start["eye"]) > 0
    assert not np.allclose(orbited["eye"], start["eye"])
    np.testing.assert_array_equal(page.pixels(), rendered(page, path=large_ball))

    page.drag((100, 150), (150, 150), button="right")
    panned = page.evaluate("isospline.camera")
    move = np.subtract(panned["target"], orbited["target"])
    assert np.allclose(np.subtract(panned["eye"], orbited["eye"]), move) and np.linalg.norm(move) > 1
    page.page.mouse.wheel(0, -200)
    page.wait("isospline.frame.input === isospline.inputs")
    zoomed = page.evaluate("isospline.camera")
    assert np.linalg.norm(np.subtract(zoomed["eye"], zoomed["target"])) < 0.8 * np.linalg.norm(
        np.subtract(start["eye"], start["target"])
    )
    page.page.get_by_role("button", name="Orthographic").click()
    page.settle()
    assert page.evaluate("isospline.frame.camera.projection") == "orthographic"
    np.testing.assert_array_equal(page.pixels(), rendered(page, path=large_ball))


def test_moving_frames_are_jpeg_and_no_larger_than_the_window(page):
    page.evaluate("window.seen = []; isospline.on('shown', about => seen.push(about))")
    page.drag((100, 150), (200, 180), steps=30)
    page.settle()
    seen = page.evaluate("seen")
    full = seen[-1]["size"]
    assert {frame["format"] for frame in seen if not frame["samples"]} == {"jpeg"}
    assert all(frame["size"][0] <= full[0] for frame in seen)
    assert [frame["samples"] for frame in seen[-2:]] == [1, 4]
    inputs = [frame["input"] for frame in seen]
    assert inputs == sorted(inputs)


def test_each_frame_is_of_one_state(page, large_ball, viewer):
    """Level and colour change together: each drawn picture shows both changes or neither."""
    id = viewer.state.objects[0].id
    page.page.set_viewport_size({"width": 600, "height": 300})  # of the pixels, few are at edges
    page.wait("isospline.frame.size[1] === 300")
    viewer.change(lambda state: state.with_object(id, color="#0000ff"))
    for _ in range(600):  # until the first colour, which is reddish, is gone
        if (page.pixels()[..., 0].astype(int) < page.pixels()[..., 2] - 40).mean() > 0.1:
            break
        time.sleep(0.1)
    for number in range(30):
        color = "#ff0000" if number % 2 else "#0000ff"
        viewer.change(lambda state, c=color, n=number % 2: state.with_object(id, color=c, level=float(10 * n)))
        page.wait(f"isospline.state.objects[0].color === '{color}'")
        pixels = page.pixels()
        reds = pixels[..., 0].astype(int) - pixels[..., 2]
        red, blue = (reds > 40).mean(), (reds < -40).mean()
        assert min(red, blue) < 1e-4  # the red ball has radius 10, the blue one 20
        assert red < 0.2 and (blue == 0 or blue > 0.2 or red > 0), (red, blue)


def test_cut_by_a_plane_and_its_handle(page, large_ball, viewer):
    page.open("cut")
    page.page.get_by_role("button", name="Plane").click()
    page.settle()
    clip = isospline.HalfSpace(viewer.state.clip.point, viewer.state.clip.normal)
    assert viewer.state.clip.point == pytest.approx((32, 32, 32))
    np.testing.assert_array_equal(page.pixels(), rendered(page, path=large_ball, clip=[clip]))

    page.page.get_by_role("button", name="x", exact=True).click()
    page.settle()
    page.drag_element("[data-handle='move the plane']", (40, 10))
    page.settle()
    moved = viewer.state.clip
    assert moved.normal == (1, 0, 0) and moved.point[0] != pytest.approx(32, abs=0.5)
    assert moved.point[1:] == pytest.approx((32, 32))
    page.drag_element("[data-handle='tilt the plane']", (5, -30))
    page.settle()
    assert viewer.state.clip.normal != (1, 0, 0)
    assert np.linalg.norm(viewer.state.clip.normal) == pytest.approx(1)

    page.page.set_viewport_size({"width": 760, "height": 400})  # in which handles are apart
    page.page.get_by_role("button", name="Box").click()
    page.settle()
    page.drag_element("[data-handle='move the maximum of z']", (0, 30))
    page.settle()
    assert viewer.state.clip.maximum[2] < 32 + 0.3 * 64


def test_clicks_measure(page, viewer):
    canvas = page.page.locator("#picture").bounding_box()
    middle = (canvas["x"] + canvas["width"] / 2, canvas["y"] + canvas["height"] / 2)
    page.page.mouse.click(*middle)
    page.page.wait_for_selector(".measurement >> nth=0")
    page.page.mouse.click(middle[0] + 40, middle[1] - 30)
    page.page.wait_for_selector(".measurement >> nth=1")
    page.page.mouse.click(4, canvas["height"] - 60)  # the background cannot be measured
    name, content = page.download("text=Save as CSV")
    rows = list(csv.DictReader(io.StringIO(content.decode())))
    assert name == "measurements.csv" and len(rows) == 2
    points = np.array([[float(row[f"position_{axis}"]) for axis in "xyz"] for row in rows])
    normals = np.array([[float(row[f"normal_{axis}"]) for axis in "xyz"] for row in rows])
    np.testing.assert_allclose(np.linalg.norm(points - 32, axis=1), 20, atol=0.01)
    np.testing.assert_allclose(normals, (points - 32) / 20, atol=0.01)
    for row, point in zip(rows, points):
        assert float(row["value"]) == pytest.approx(LEVEL, abs=1e-4) and row["object"] == "ball.npy"
        assert [float(row[f"index_{axis}"]) for axis in "xyz"] == pytest.approx(list(point))
        assert abs(float(row["mean_curvature"])) == pytest.approx(1 / 20, rel=0.05)
        assert float(row["gaussian_curvature"]) == pytest.approx(1 / 400, rel=0.1)
        assert float(row["thickness"]) == pytest.approx(40, rel=1e-3)
        assert (row["tool"], row["distance"], row["angle"]) == ("point", "", "")

    page.page.mouse.click(middle[0] - 40, middle[1] - 30)
    page.page.wait_for_selector(".measurement >> nth=2")
    page.page.get_by_role("button", name="Remove measurement 2").click()
    page.wait("document.querySelectorAll('.measurement').length === 2")
    assert [each.id for each in viewer.state.measurements] == [1, 3]
    page.page.reload()
    page.wait("document.querySelectorAll('.measurement').length === 2")
    page.settle()


def test_surfaces_are_added_hidden_coloured_and_removed(page, viewer):
    page.page.set_viewport_size({"width": 460, "height": 140})
    page.page.get_by_role("button", name="+ level").click()
    page.wait("isospline.state.objects.length === 2")
    page.settle()
    page.page.locator(".object >> nth=0").get_by_role("button", name="Hide").click()
    page.settle()
    assert [each.visible for each in viewer.state.objects] == [False, True]
    page.page.locator(".object >> nth=1 >> .name").click()
    page.page.get_by_label("Colour by", exact=True).select_option("mean-curvature")
    page.settle()
    assert viewer.state.objects[1].color_by == "mean-curvature"
    pieces = page.page.get_by_label("Pieces", exact=True)
    assert pieces.input_value() == "all"
    pieces.select_option("The largest")
    page.settle()
    assert [each.largest for each in viewer.state.objects] == [None, 1]
    pieces.select_option("All")
    page.settle()
    assert viewer.state.objects[1].largest is None
    page.page.locator(".object >> nth=0").get_by_role("button", name="Remove").click()
    page.wait("isospline.state.objects.length === 1")
    page.settle()
    assert [each.id for each in viewer.state.objects] == [1]


@pytest.mark.sweep(1)
@pytest.mark.parametrize("shading", ["Outline", "Ambient", "Path traced"])
def test_shadings_refine_to_the_pictures_of_their_script(page, shading, tmp_path, monkeypatch):
    page.page.set_viewport_size({"width": 450, "height": 80})
    page.page.get_by_role("button", name=shading).click()
    page.wait("isospline.frame.size[1] === 80")
    page.settle()
    pixels = page.pixels()
    page.open("saving")
    name, source = page.download("[data-save=python]")
    assert name == "picture.py"
    monkeypatch.chdir(tmp_path)
    known = {}
    exec(compile(source, name, "exec"), known)
    np.testing.assert_array_equal(pixels, known["image"].to_srgb()[..., :3])


def test_slices_show_values_and_move_together(page, viewer):
    page.open("slicing")
    page.page.get_by_label("Show three slices").click()
    page.wait("document.querySelector('#slices figcaption').textContent !== ''")
    gray = "(() => { const c = document.querySelectorAll('#slices canvas')[2]; const x = Math.round(c.width / 2) + 9;"
    gray += "return c.getContext('2d').getImageData(x, Math.round(c.height / 2) + 9, 1, 1).data[0]; })()"
    page.wait(f"{gray} > 200")  # the middle of the ball
    box = page.page.locator("#slices canvas >> nth=0").bounding_box()
    page.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2 - 60)
    page.wait("isospline.frame.input === isospline.inputs")
    index = viewer.state.slices.index
    assert index[0] == 32 and index[2] > 40
    page.page.get_by_label("Window", exact=True).fill("1000")
    page.page.keyboard.press("Enter")
    page.wait("isospline.state.slices.window[1] - isospline.state.slices.window[0] === 1000")


def test_what_is_saved(page, viewer, tmp_path, monkeypatch):
    page.open("saving")
    name, content = page.download("[data-save=png]")
    np.testing.assert_array_equal(np.asarray(PIL.Image.open(io.BytesIO(content)).convert("RGB")), page.pixels())
    name, content = page.download("[data-save=session]")
    assert name == "session.json" and json.loads(content)["state"]["camera"] == page.evaluate("isospline.camera")
    (tmp_path / name).write_bytes(content)
    with isospline.view(session=tmp_path / name, browser=False) as again:
        assert again.state == viewer.state
    name, content = page.download("[data-save=exr]")
    assert name == "picture.exr" and content.startswith(b"\x76\x2f\x31\x01")
    name, content = page.download("[data-save=mesh]")
    assert name == "mesh.stl"
    mesh = trimesh.load(io.BytesIO(content), file_type="stl")
    assert mesh.is_watertight and mesh.volume == pytest.approx(4 / 3 * np.pi * 20**3, rel=1e-2)
    monkeypatch.setattr("isospline.viewer.save.TURN", 4)
    name, content = page.download("[data-save=turntable]")
    assert name == "turntable.mp4" and b"ftyp" in content[:16]


def test_a_dropped_file_opens_and_a_broken_one_is_a_message(page, viewer, large_ball):
    page.page.set_input_files("#open", [{"name": "broken.nii.gz", "mimeType": "", "buffer": b"no volume"}])
    page.wait("document.getElementById('messages').textContent.includes('broken.nii.gz')")
    drop = """async ([name, text]) => {
        const transfer = new DataTransfer();
        transfer.items.add(new File([Uint8Array.from(atob(text), each => each.charCodeAt(0))], name));
        dispatchEvent(new DragEvent("dragover", {dataTransfer: transfer, cancelable: true}));
        dispatchEvent(new DragEvent("drop", {dataTransfer: transfer, cancelable: true}));
    }"""
    page.evaluate(drop, ["other.npy", base64.b64encode(large_ball.read_bytes()).decode()])
    page.wait("isospline.sources.size === 2 && isospline.state.objects.length === 2")
    page.wait("document.getElementById('progress').hidden")
    page.settle()
    assert [source.name for source in viewer.document] == ["ball.npy", "other.npy"]


def test_windows_share_what_is_shown_and_not_the_camera(browser, page, viewer):
    other = Page(browser, viewer.url)
    other.settle()
    page.drag((100, 150), (160, 120))
    field = page.page.locator(".object input.number")
    field.fill("7")
    other.wait("isospline.state.objects[0].level === 7")
    page.settle()
    assert other.evaluate("isospline.camera") != page.evaluate("isospline.camera")
    field.fill("8")
    other.close()  # while it draws
    page.settle()
    assert len(viewer.windows()) == 1 or time.sleep(1) or len(viewer.windows()) == 1
    assert not other.problems


def test_a_reloaded_page_shows_the_same(page, viewer):
    page.drag((100, 150), (160, 120))
    page.page.locator(".object input.number").fill("7")
    page.settle()
    camera, pixels = page.evaluate("isospline.camera"), page.pixels()
    page.page.reload()
    page.settle()
    assert page.evaluate("isospline.camera") == camera
    np.testing.assert_array_equal(page.pixels(), pixels)


def test_the_table_of_a_ct_is_hidden(browser, scan_with_table):
    with isospline.view(scan_with_table[0], browser=False) as viewer:
        page = Page(browser, viewer.url)
        page.settle()
        body_level = viewer.state.objects[0].body_level
        box = page.page.get_by_label("Only the body, without the table")
        assert box.is_checked() and body_level is not None
        for is_hidden in (False, True):
            box.click()
            page.wait(f"isospline.state.objects[0].body_level {'!==' if is_hidden else '==='} null")
            page.settle()
            assert viewer.state.objects[0].body_level == (body_level if is_hidden else None)
        page.close()
        assert not page.problems


def test_sides_of_a_patient(browser, tmp_path):
    import nibabel

    head = (1000 * volumes.sphere(0.6).values(24)).astype(np.int16)
    nibabel.save(nibabel.Nifti1Image(head, np.diag([2.0, 2.0, 2.0, 1.0])), tmp_path / "head.nii.gz")
    with isospline.view(tmp_path / "head.nii.gz", browser=False) as viewer:
        page = Page(browser, viewer.url)
        page.settle()
        eyes = {}
        for side in "APLRSI":
            before = page.evaluate("JSON.stringify(isospline.camera.eye)")
            page.page.locator("#views").get_by_role("button", name=side, exact=True).click()
            page.wait(f"JSON.stringify(isospline.camera.eye) !== {json.dumps(before)}")
            camera = page.evaluate("isospline.camera")
            eyes[side] = np.subtract(camera["eye"], camera["target"])
        sides = {"A": (0, -1, 0), "P": (0, 1, 0), "L": (1, 0, 0), "R": (-1, 0, 0), "S": (0, 0, 1), "I": (0, 0, -1)}
        for side, direction in sides.items():
            np.testing.assert_allclose(eyes[side] / np.linalg.norm(eyes[side]), direction, atol=1e-9)
        assert page.page.inner_text("#scale-bar").endswith("mm")
        page.close()
