"""Scale bars in pictures: their pixels against closed forms, and where they are."""

import numpy as np
import pytest
from spheres import mesh_sphere, sphere

import isospline
from isospline.picture.annotations import Drawing
from isospline.picture.marks import Marks
from isospline.picture.scale_bars import ScaleBar, scale_bar

SIZE = (320, 240)


def bar_length(image, plain):
    """Columns of the scale bar, with the parts of columns at its ends, and the rows that have it."""
    darker = (plain.color[..., 1] - image.color[..., 1]) / (plain.color[..., 1] - 0.015)
    rows = darker.sum(axis=1)
    return rows.max(), np.nonzero(np.isclose(rows, rows.max(), atol=1e-3))[0]


def shown(camera, **options):
    plain = isospline.render(sphere(), camera, size=SIZE, background="white", **options)
    return plain, isospline.render(sphere(), camera, size=SIZE, background="white", annotate=["scale_bar"], **options)


@pytest.mark.parametrize("distance", [40.0, 123.4, 1000.0])
def test_the_scale_bar_of_a_perspective(distance):
    camera = isospline.PerspectiveCamera((11.5, 11.5 - distance, 11.5), (11.5, 11.5, 11.5), field_of_view=30)
    length, pixels = scale_bar(camera, SIZE, isospline.Scene(sphere()).extent)
    expected = length / (2 * distance * np.tan(np.radians(15))) * SIZE[1]
    assert pixels == pytest.approx(expected, rel=1e-9) and 0.08 * SIZE[0] <= pixels <= 0.25 * SIZE[0]
    plain, image = shown(camera)
    found, rows = bar_length(image, plain)
    assert found == pytest.approx(expected, abs=0.05)
    assert len(rows) == 2 and (np.diff(rows) == 1).all() and rows[0] > 0.9 * SIZE[1]


@pytest.mark.parametrize("height", [0.07, 30.0, 4e4])
def test_the_scale_bar_of_parallel_rays(height):
    camera = isospline.OrthographicCamera((11.5, -90, 11.5), (11.5, 11.5, 11.5), height=height)
    extent = isospline.Scene(sphere()).extent
    length, pixels = scale_bar(camera, SIZE, extent)
    assert pixels == pytest.approx(length / height * SIZE[1], rel=1e-9)
    mantissa = length / 10 ** np.floor(np.log10(length) + 1e-9)
    assert min(abs(mantissa - each) for each in (1, 2, 5)) < 1e-9
    # Another size of the same picture has the same length, in as many pixels as it has more.
    assert scale_bar(camera, (640, 480), extent) == pytest.approx((length, 2 * pixels))


def test_the_scale_bar_of_the_papers_camera():
    # Its plane may be anywhere, so that the scale is that of the middle of the objects in front of the eye.
    eye, near, far = np.array((0, -5, 0)), block(1, 2, 1), block(1, 9, 1)
    for distance in (1.0, 5.0):
        plane = dict(right=(0.32 * distance, 0, 0), down=(0, 0, -0.18 * distance))
        camera = isospline.ProjectionPlaneCamera(eye, center=eye + (0, distance, 0), **plane)
        for shape, offset, depth in ((near, 0, 6), (far, 0, 9.5), (far, -9, 2.5), (near, -90, distance)):
            scene = isospline.Scene()
            scene.add(shape, transform=[(1, 0, 0, 0), (0, 1, 0, offset), (0, 0, 1, 0), (0, 0, 0, 1)])
            length, pixels = scale_bar(camera, (160, 90), scene.extent)
            assert pixels == pytest.approx(length * 500 / depth)
    assert scale_bar(camera, (160, 90), isospline.Scene().extent) == pytest.approx((0.2, 20))


def test_a_perspective_and_its_calibration_have_the_same_scale_bar():
    given, extent = isospline.camera_for(sphere(), size=SIZE), isospline.Scene(sphere()).extent
    camera = isospline.ProjectionPlaneCamera.from_opencv(*given.to_opencv(SIZE), SIZE)
    assert scale_bar(camera, SIZE, extent) == pytest.approx(scale_bar(given, SIZE, extent))


BALL = mesh_sphere(1.0, 32)


def block(x, y, z):
    """A box with these lengths of edges as a mesh."""
    corners = np.stack(np.meshgrid([0, x], [0, y], [0, z], indexing="ij"), axis=-1).reshape(-1, 3)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return isospline.Mesh(corners, [each for a, b, c, d in quads for each in ((a, b, c), (a, c, d))])


SHAPES = {
    "wide": block(16, 9, 9),
    "flat": block(30, 17, 1),
    "tall": block(5, 5, 14),
    "deep": block(9, 60, 9),
    "ball": isospline.Mesh(BALL.vertices, BALL.faces),
}


def hidden(marked, plain):
    """The pixels of objects that marks change; both pictures are transparent where there is no object."""
    changed = (marked.color != plain.color).any(axis=-1)
    assert changed.sum() > 30
    return np.count_nonzero(changed & (plain.color[..., 3] > 0))


@pytest.mark.sweep(8)
@pytest.mark.parametrize("size", [(320, 180), (160, 160), (96, 72), (90, 200)], ids=str)
@pytest.mark.parametrize("shape", SHAPES)
def test_no_object_is_below_the_scale_bar(shape, size, monkeypatch):
    options = dict(size=size, samples=4, unit="mm", light="phong")
    marked = isospline.render(SHAPES[shape], annotate="scale_bar", **options)
    with monkeypatch.context() as patch:
        patch.setattr(ScaleBar, "draw", lambda *_: None)
        plain = isospline.render(SHAPES[shape], annotate="scale_bar", **options)
    assert hidden(marked, plain) == 0
    # From the front and all around, and with parallel rays.
    scene, size = isospline.Scene(SHAPES[shape]), options["size"]
    marks = Marks(scene, isospline.Phong(), size, ("scale_bar",), False, "mm")
    for framing in (dict(view="front"), dict(view=(1, -2, 1), projection="orthographic")):
        for camera in (marks.camera(size=size, **framing), *marks.cameras(3, size=size, **framing)):
            plain = isospline.render(scene, camera, size=size, light="phong")
            assert hidden(marks.draw(plain.over((0, 0, 0, 0)), camera, is_fitted=True), plain) == 0


def test_the_camera_is_changed_only_for_objects_in_the_corner():
    for shape, is_changed in (("wide", True), ("tall", False)):
        scene = isospline.Scene(SHAPES[shape])
        framing = dict(size=(320, 180), view="front", projection="orthographic")
        camera = Marks(scene, isospline.Phong(), (320, 180), ("scale_bar",), False, "mm").camera(**framing)
        assert (camera != isospline.camera_for(scene, **framing)) == is_changed


def test_from_a_given_camera_the_scale_bar_is_where_it_hides_least():
    scene = SHAPES["wide"]
    middle = isospline.camera_for(scene, size=SIZE)
    right, up = middle.world_to_camera[:2, :3]
    options = dict(size=SIZE, unit="mm", light="phong")
    for x, y in ((1, 1), (-1, 1), (1, -1), (-1, -1)):  # the object is in one corner
        shift = 8 * x * right + 6 * y * up
        camera = isospline.PerspectiveCamera(middle.eye + shift, middle.target + shift, middle.up, 30)
        plain = isospline.render(scene, camera, **options)
        assert plain.color[-60:, :120, 3].any() == ((x, y) == (1, 1))
        assert hidden(isospline.render(scene, camera, annotate="scale_bar", **options), plain) == 0


def test_a_panel_keeps_a_scale_bar_on_an_object_readable(monkeypatch):
    camera = isospline.OrthographicCamera((8, -90, 4.5), (8, 4, 4.5), height=2)
    plain = isospline.render(SHAPES["wide"], camera, size=SIZE, light="phong")
    assert (plain.color[..., 3] == 1).all()
    with monkeypatch.context() as patch:
        patch.setattr(Drawing, "finish", lambda _: None)
        panel = isospline.render(SHAPES["wide"], camera, size=SIZE, annotate="scale_bar", unit="mm", light="phong")
    marked = isospline.render(SHAPES["wide"], camera, size=SIZE, annotate="scale_bar", unit="mm", light="phong")
    behind = (panel.color != plain.color).any(axis=-1)
    ink = (marked.color != panel.color).any(axis=-1)
    assert ink.any() and not (ink & ~behind).any()
    assert abs(panel.color[behind][:, 1].mean() - marked.color[ink][:, 1].min()) > 0.5


def test_a_scale_bar_leaves_the_legend_alone():
    ball = mesh_sphere(1.0, 32)
    named = isospline.Mesh(ball.vertices * (4, 1, 1), ball.faces, color="tab:blue", name="an egg")
    # The object covers the upper half of the picture, so that both marks belong below it.
    camera = isospline.OrthographicCamera((0, -9, -0.8), (0, 0, -0.8), height=1.8)
    options = dict(size=SIZE, unit="mm", legend=True, light="phong")
    legend = isospline.render(named, camera, **options)
    both = isospline.render(named, camera, annotate="scale_bar", **options)
    plain = isospline.render(named, camera, size=SIZE, light="phong")
    drawn = (legend.color != plain.color).any(axis=-1)
    assert drawn[-60:, :160].any() and (both.color != legend.color).any()
    np.testing.assert_array_equal(both.color[drawn], legend.color[drawn])
