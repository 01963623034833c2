"""Distances, angles and thicknesses in the page, their undo, and that sessions keep them."""

import csv
import io
import math

import numpy as np
import PIL.Image
import pytest

pytest.importorskip("playwright")
from browser import shown as show

import isospline
from isospline import volumes
from isospline.cli.main import main
from isospline.viewer.measurements import MeasuredPoint, Measurement, with_point
from isospline.viewer.rulers import draw_measurements, result_text
from isospline.viewer.save import save
from isospline.viewer.session import read_session, session_of, write_session
from isospline.viewer.state import CameraState, ViewState

LABELS = "[...document.querySelectorAll('#overlay text.measured')].map(each => each.textContent)"


@pytest.fixture
def measured(browser, large_ball):
    with show(browser, large_ball, (700, 480), levels=[0]) as (page, viewer):
        page.open("measurements")
        yield page, viewer


def click(page, *offsets):
    """Click beside the middle of the picture, and wait for each point."""
    box = page.page.locator("#picture").bounding_box()
    points = "isospline.state.measurements.flatMap(each => each.points).length"
    for x, y in offsets:
        count = page.evaluate(points)
        page.page.mouse.click(box["x"] + box["width"] / 2 + x, box["y"] + box["height"] / 2 + y)
        page.wait(f"{points} === {count + 1}")


def test_distances_angles_and_thicknesses(measured):
    page, viewer = measured
    page.page.get_by_role("button", name="Distance").click()
    click(page, (-60, 0), (60, 0))
    page.page.get_by_role("button", name="Angle").click()
    click(page, (-50, 20), (0, -50), (50, 20))
    page.page.get_by_role("button", name="Thickness").click()
    click(page, (10, 60))
    distance, angle, thickness = viewer.state.measurements
    a, b = (np.array(each.position) for each in distance.points)
    assert distance.result == pytest.approx(np.linalg.norm(b - a))
    a, b, c = (np.array(each.position) for each in angle.points)
    cosine = (a - b) @ (c - b) / np.linalg.norm(a - b) / np.linalg.norm(c - b)
    assert angle.result == pytest.approx(math.degrees(math.acos(cosine)))
    assert thickness.result == pytest.approx(40, rel=1e-3)  # the ball's diameter
    texts = [f"{each.result:.4g}" for each in (distance, angle, thickness)]
    assert page.evaluate(LABELS) == [f"1: {texts[0]}", f"2: {texts[1]}°", f"3: {texts[2]}"]
    # The largest ball in the solid is the solid itself: its outline passes the edge of the surface in the picture.
    find = "[...document.querySelectorAll('#overlay circle')].map(each => +each.getAttribute('r'))"
    radius = max(page.evaluate(find))
    row = page.pixels()[page.pixels().shape[0] // 2].astype(int)
    columns = np.flatnonzero(abs(np.diff(row.sum(axis=1))) > 20)
    assert radius == pytest.approx((columns[-1] - columns[0]) / 2, rel=0.05)

    name, content = page.download("text=Save as CSV")
    rows = list(csv.DictReader(io.StringIO(content.decode())))
    assert name == "measurements.csv"
    assert [row["measurement"] for row in rows] == ["1", "1", "2", "2", "2", "3"]
    assert [row["tool"] for row in rows] == ["distance"] * 2 + ["angle"] * 3 + ["thickness"]
    assert [row["distance"] for row in rows] == ["", str(distance.result), "", "", "", ""]
    assert [row["angle"] for row in rows] == ["", "", "", "", str(angle.result), ""]


def test_points_are_undone_one_by_one_and_kept_in_sessions(measured, tmp_path):
    page, viewer = measured
    pictures = page.evaluate("isospline.framesShown")
    page.page.get_by_role("button", name="Distance").click()
    click(page, (-60, 0), (60, 0), (0, 30))
    both = viewer.state.measurements
    assert [len(each.points) for each in both] == [2, 1] and both[1].result is None
    for expected in ([2], [1]):
        page.page.locator("#undo").click()
        page.wait(f"JSON.stringify(isospline.state.measurements.map(each => each.points.length)) === '{expected}'")
    for _ in range(2):
        viewer.redo()
    assert viewer.state.measurements == both
    page.wait("isospline.state.measurements.length === 2")
    page.settle()
    assert page.evaluate("isospline.framesShown") == pictures
    page.open("saving")
    _, content = page.download("[data-save=session]")
    path = tmp_path / "session.json"
    path.write_bytes(content)
    session = read_session(path)
    assert session.state.measurements == both
    viewer.open_session(session)
    page.wait(f"{LABELS}.length === 2")
    page.page.get_by_role("button", name="Clear").click()
    page.wait("!isospline.state.measurements.length")
    page.settle()


def test_a_moving_camera_does_not_hide_measurements(measured):
    page, viewer = measured
    page.page.get_by_role("button", name="Thickness").click()
    box = page.page.locator("#picture").bounding_box()
    page.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.evaluate("""() => new Promise(done => {
        let left = 30;
        const move = () => {
            isospline.moveCamera({...isospline.camera, height: isospline.camera.height * 1.001});
            if (left--) setTimeout(move, 10); else done();
        };
        move();
    })""")
    page.settle()
    page.wait(f"isospline.state.measurements.length === 1 && {LABELS}.length === 1")
    assert len(viewer.state.measurements) == 1


def test_measurements_go_with_their_source_and_ids_are_not_used_again(large_ball):
    point = MeasuredPoint(0, (1, 2, 3), (0, 0, 1))
    state = ViewState().with_new_object("a").with_new_object("b")
    first, second = with_point(with_point((), "point", point), "distance", point.replace(object=1))
    state = state.replace(measurements=(first, second)).with_keys({"b": "b"})
    assert state.measurements == (second,)
    state = state.without_object(1)
    assert state.measurements == (second,) and state.with_new_object("c").objects[0].id == 2


def test_measurements_of_huge_numbers_have_no_result():
    points = [MeasuredPoint(0, place, (0, 0, 1)) for place in ((1e200, 0, 0), (-1.7e308, 0, 0), (1.7e308, 1e300, 0))]
    assert Measurement(1, "distance", tuple(points[1:])).result is None
    with np.errstate(all="raise"):
        huge = [MeasuredPoint(0, place, (0, 0, 1)) for place in ((1e200, 0, 0), (0, 0, 0), (0, 1e150, 0))]
        assert Measurement(1, "angle", tuple(huge)).result == pytest.approx(90)


def test_a_measurement_has_the_points_of_its_tool():
    point = MeasuredPoint(0, (1, 2, 3), (0, 0, 1), thickness=None)
    all = ()
    for tool in ("angle", "angle", "point", "angle", "thickness"):
        all = with_point(all, tool, point)
    assert [(each.id, each.tool, len(each.points)) for each in all] == [
        (1, "angle", 2),
        (2, "point", 1),
        (3, "angle", 1),
        (4, "thickness", 1),
    ]
    assert with_point(all[:3], "angle", point)[2].points == (point, point)
    assert Measurement(1, "angle", (point,) * 3).result is None  # it has no sides
    state = ViewState(measurements=all)
    assert ViewState.from_json(state.to_json(), "state") == state
    with pytest.raises(ValueError, match=r"points: expected 1 to 2 of a distance, got 3"):
        Measurement(1, "distance", (point,) * 3)
    with pytest.raises(ValueError, match=r"tool: expected one of point, distance, angle, thickness, got 'ruler'"):
        Measurement(1, "ruler", (point,))


def point(*position, **options):
    return MeasuredPoint(0, position, (0.0, 0.0, 1.0), **options)


def test_saved_pictures_show_measurements(tmp_path):
    """Where an independent projection says: from below, x to the right, z upwards, 10 pixels a unit."""
    data = isospline.VolumeData(volumes.sphere(0.3).values(21), unit="mm")
    volume = data.to_volume()
    camera = CameraState((10.0, -50.0, 10.0), (10.0, 10.0, 10.0), (0.0, 0.0, 1.0), "orthographic", height=20.0)
    every = (
        Measurement(1, "distance", (point(4.0, 0.0, 16.0), point(16.0, 0.0, 16.0))),
        Measurement(2, "angle", (point(2.0, 0.0, 2.0), point(5.0, 0.0, 2.0), point(5.0, 0.0, 6.0))),
        Measurement(3, "thickness", (point(15.0, 0.0, 6.0, thickness=4.0),)),
    )
    with isospline.view(volume, levels=[0.0], browser=False) as viewer:
        state = viewer.state.replace(camera=camera, light="phong", measurements=every)

        def saved(**options):
            _, content = save(viewer, "png", state, (200, 200), options)
            return np.asarray(PIL.Image.open(io.BytesIO(content)).convert("RGB")).astype(int)

        plain, drawn = saved(measurements=False), saved()
        large = saved(width=400, height=400)
    accent = np.abs(drawn - (200, 85, 61)).max(axis=-1) < 60
    for x, z in ((4, 16), (7, 16), (16, 16), (3, 2), (5, 2), (5, 4), (15, 6), (15, 2), (17, 4), (13, 4)):
        assert accent[200 - 10 * z - 1 : 200 - 10 * z + 1, 10 * x - 1 : 10 * x + 1].any(), (x, z)
    changed = (drawn != plain).any(axis=-1)
    assert not changed[110:130, 20:40].any() and 0.01 < changed.mean() < 0.2
    ink = np.abs(large - (31, 41, 51)).max(axis=-1) < 60
    for x, z in ((10, 16), (5, 2), (15, 6)):  # texts are to the right of their places and above them
        assert ink[400 - 20 * z - 25 : 400 - 20 * z, 20 * x : 20 * x + 60].sum() > 10, (x, z)
    assert (np.abs(large - (200, 85, 61)).max(axis=-1) < 60)[80 - 2 : 80 + 2, 140:142].any()


def test_results_in_pictures_have_units():
    distance = Measurement(1, "distance", (point(0.0, 0.0, 0.0), point(12345.6, 0.0, 0.0)))
    angle = Measurement(2, "angle", (point(1.0, 0.0, 0.0), point(0.0, 0.0, 0.0), point(0.0, 2.0, 0.0)))
    open_distance, nothing = (
        Measurement(3, "distance", (point(0.0, 0.0, 0.0),)),
        Measurement(4, "thickness", (point(1.0, 0.0, 0.0),)),
    )
    texts = [result_text(each, "mm") for each in (distance, angle, open_distance, nothing)]
    assert texts == [": 12350 mm", ": 90°", "", ": no other side"]
    assert result_text(distance, "") == ": 12350"


@pytest.mark.parametrize(
    "shift", [(95, 0), (102, 0), (-99, 0), (-140, 0), (0, 99), (0, 120), (0, -98), (95, -99), (0, 0)]
)
def test_results_at_the_edge_of_a_picture_are_cut_off(shift):
    """By whole pixels, they move with their places; only what is beside the picture is not drawn."""
    right, down = shift
    camera = CameraState((0.0, -50.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), "orthographic", height=20.0).camera()

    def drawn(x, z):
        image = isospline.render(isospline.Scene([]), camera, size=(200, 200), light="phong", background="white")
        each = Measurement(1, "distance", (point(x, 0.0, z), point(x + 0.001, 0.0, z)))
        return draw_measurements(image, [each], camera, "mm").to_srgb()[..., :3].astype(int)

    middle, moved = drawn(0.0, 0.0), drawn(right / 10, -down / 10)
    around = np.full((600, 600, 3), 255)
    around[200 + down : 400 + down, 200 + right : 400 + right] = middle
    seen = around[200:400, 200:400]
    assert np.abs(moved - seen).max() < 30 and (middle != 255).any()


def test_lengths_in_the_page_have_the_unit_of_the_volume(browser):
    data = isospline.VolumeData(volumes.sphere(0.3).values(21), unit="um")
    with show(browser, data, (460, 240), levels=[0]) as (page, viewer):
        assert page.page.locator("#scale-bar").inner_text().endswith(" um")
        viewer.add(isospline.VolumeData(volumes.sphere(0.3).values(21)), levels=[0])
        page.wait("isospline.state.objects.length === 2")
        page.wait("/^[0-9.]+$/.test(document.querySelector('#scale-bar').innerText.trim())")  # one of two is not known
        page.settle()


def test_measurements_of_hidden_objects_have_units(ball):
    """What is measured keeps its unit, whether the object is seen or not."""
    length = Measurement(1, "distance", (point(3.0, 10.0, 10.0), point(16.0, 10.0, 10.0)))
    camera = CameraState((10.0, -50.0, 10.0), (10.0, 10.0, 10.0), (0.0, 0.0, 1.0))
    drawn = {}
    for unit in ("", "mm"):
        volume = isospline.VolumeData(np.load(ball), unit=unit)
        with isospline.view(volume, browser=False) as viewer:
            state = viewer.state.with_object(0, visible=False).replace(camera=camera, measurements=(length,))
            drawn[unit] = save(viewer, "png", state, (160, 120), {})[1]
    assert drawn[""] != drawn["mm"]


def test_pictures_of_sessions_show_measurements_if_annotated(ball, tmp_path):
    length = Measurement(1, "distance", (point(3.0, 10.0, 10.0), point(16.0, 10.0, 10.0)))
    camera = CameraState((10.0, -50.0, 10.0), (10.0, 10.0, 10.0), (0.0, 0.0, 1.0))
    with isospline.view(ball, browser=False) as viewer:
        state = viewer.state.replace(camera=camera, light="phong", measurements=(length,))
        write_session(tmp_path / "a.json", session_of(viewer.document, state))
    pictures = []
    for more in (["--annotate"], []):
        command = ["render", "--session", tmp_path / "a.json", "-o", tmp_path / "a.png", "--size", "160x120", *more]
        assert main([*map(str, command), "--quiet"]) == 0
        pictures.append(np.asarray(PIL.Image.open(tmp_path / "a.png").convert("RGB")).astype(int))
    changed = (pictures[0] != pictures[1]).any(axis=-1)
    for x in (4.0, 9.0, 15.0):
        column, row, _, depth = camera.camera().world_to_ndc((160, 120)) @ (x, 10.0, 10.0, 1.0)
        column, row = round(160 * column / depth), round(120 * row / depth)
        assert changed[row - 1 : row + 1, column].all() and not changed[row + 8 : row + 12, column].any()
