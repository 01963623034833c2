"""Distances, angles and thicknesses in the page, their undo, and that sessions keep them."""

import csv
import io
import math

import numpy as np
import pytest

pytest.importorskip("playwright")
from browser import shown as show

from isospline.viewer.measurements import MeasuredPoint, Measurement, with_point
from isospline.viewer.session import read_session
from isospline.viewer.state import ViewState

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
