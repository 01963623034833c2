"""Marks in pictures: the colours and labels of colour bars, legends, and space for them."""

import numpy as np
import pytest
from PIL import ImageDraw, ImageFont
from spheres import mesh_sphere, sphere

import isospline
from isospline.base.values import part
from isospline.colors import linear_to_srgb
from isospline.picture.annotations import ColorBar, _dejavu, font_for, labels_of, overlap, ticks
from isospline.picture.cameras import camera_beside, cameras_around
from isospline.picture.legends import Legend
from isospline.viewer.measurements import MeasuredPoint, Measurement
from isospline.viewer.rulers import draw_measurements

SIZE = (320, 240)
RAMP = isospline.ColorByVolume(sphere().volume, [(0.1, 0, 0.2), (0.2, 0.9, 0.3), (1, 0.8, 0)], limits=(0, 100))


DISTORTED = isospline.ProjectionPlaneCamera.from_opencv(
    [(300, 0, 159.5), (0, 300, 119.5), (0, 0, 1)], (0, 0, 0), (-11.5, -11.5, 40), SIZE, distortion=[0.05, 0, 0, 0]
)


def test_marks_are_dark_on_bright_and_bright_on_dark():
    camera = isospline.camera_for(sphere(), size=SIZE)
    for background, ink in (("white", 0.015), ("black", 1.0)):
        image = isospline.render(
            sphere(), camera, size=SIZE, background=background, annotate=("scale_bar",), light="phong"
        )
        assert (np.abs(image.color[int(0.9 * SIZE[1]) :, :, 1] - ink) < 1e-6).sum() > 30


def test_a_unit_and_the_encoding_of_eight_bits():
    camera = isospline.camera_for(sphere(), size=SIZE)
    options = dict(size=SIZE, background="white", annotate=("scale_bar",))
    linear = isospline.render(sphere(), camera, unit="mm", **options)
    encoded = isospline.render(sphere(), camera, unit="mm", encoding="srgb8", **options)
    assert np.abs(linear.to_srgb().astype(int) - encoded.to_srgb().astype(int)).max() <= 1
    without = isospline.render(sphere(), camera, **options)
    assert (linear.color != without.color).any()


@pytest.mark.parametrize("limits", [(0, 100), (100, 0), (-0.5, 0.5)])
def test_the_colors_of_a_colour_bar(limits):
    rule = RAMP.replace(limits=limits)
    image = isospline.render(
        sphere(), size=SIZE, light=isospline.Phong(color=rule), background="white", annotate=("colorbar",)
    )
    length = round(0.6 * SIZE[1])
    first, last = (SIZE[1] - length) // 2, (SIZE[1] - length) // 2 + length - 1
    places = 1 - (np.arange(length) + 0.5) / length
    expected = np.stack([np.interp(places, [0, 0.5, 1], part) for part in part(rule, "cmap").T], axis=-1)
    right = image.color[first : last + 1, SIZE[0] // 2 :, :3]
    errors = np.abs(right - expected[:, None]).max(axis=(0, 2))
    assert (errors < 1e-6).sum() == round(0.025 * SIZE[0])  # columns of the bar
    # As it is shown: sRGB of the map's colours.
    column = SIZE[0] // 2 + int(np.argmin(errors))
    np.testing.assert_allclose(image.to_srgb()[first, column, :3], 255 * linear_to_srgb(expected[0]), atol=0.51)


@pytest.mark.parametrize("kind", ["perspective", "panorama", "eye in the box"])
def test_the_bar_of_depth_has_the_limits_of_the_picture(kind):
    scene, eye = isospline.Scene([sphere()]), np.array((11.5, 3.0, 11.5))
    corners = np.stack(np.meshgrid(*scene.bounds.T), axis=-1).reshape(-1, 3)
    if kind == "panorama":
        ends = np.vstack([corners, np.clip(eye, *scene.bounds)])  # the nearest point may be within a face
        camera, depths = isospline.PanoramicCamera(eye, (11.5, 11.5, 11.5)), np.linalg.norm(ends - eye, axis=1)
    else:
        eye[1] -= 30 if kind == "perspective" else 0
        camera, depths = isospline.PerspectiveCamera(eye, (11.5, 11.5, 11.5)), np.maximum(corners[:, 1] - eye[1], 0)
    options = {"size": SIZE, "background": "white", "annotate": ("colorbar",)}
    shown, expected = (
        isospline.render(scene, camera, color=isospline.ColorByDepth("viridis", limits=limits), **options)
        for limits in (None, (depths.min(), depths.max()))
    )
    np.testing.assert_allclose(shown.color, expected.color, atol=1e-6)


def test_every_color_rule_has_its_own_bar():
    scene = isospline.Scene([sphere(), mesh_sphere(3.0, 16)])
    looks = {0: isospline.Phong(color=RAMP), 1: isospline.Phong(color=isospline.ColorByDepth())}
    first = []
    for shading in ({0: looks[0]}, looks):
        plain = isospline.render(scene, size=SIZE, light=shading, background="white")
        marked = isospline.render(scene, size=SIZE, light=shading, background="white", annotate=("colorbar",))
        first.append(np.nonzero((marked.color != plain.color).any(axis=(0, 2)))[0].min())
    assert first[1] < first[0] - 20


def test_a_path_traced_picture_has_marks():
    tracer = isospline.PathTracer(isospline.Material(RAMP), max_bounces=1)
    image = isospline.render(sphere(), size=SIZE, light=tracer, annotate=("colorbar", "scale_bar"))
    assert (image.color[..., 3] == 1).any()


def test_ticks_are_round_and_few():
    assert ticks(0, 100) == [0, 20, 40, 60, 80, 100]
    assert ticks(-0.5, 0.5) == [-0.4, -0.2, 0, 0.2, 0.4]
    assert ticks(0, 5e-13) == [0, 1e-13, 2e-13, 3e-13, 4e-13, 5e-13]
    assert ticks(100000, 100001) == [100000, 100000.2, 100000.4, 100000.6, 100000.8, 100001]
    for lower, upper in np.random.default_rng(3).normal(size=(200, 2)) * 10.0 ** np.arange(-5, 5).repeat(20)[:, None]:
        found = ticks(lower, upper)
        assert 2 <= len(found) <= 6
        assert min(found) >= min(lower, upper) - 1e-9 * abs(upper - lower)
        assert max(found) <= max(lower, upper) + 1e-9 * abs(upper - lower)


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ((0, 5e-13), "0 1e-13 2e-13 3e-13 4e-13 5e-13"),
        ((101326, 101325), "101325 101325.2 101325.4 101325.6 101325.8 101326"),
        ((1e6, 1e6 + 10), "1000000 1000002 1000004 1000006 1000008 1000010"),
        ((1, 1 + 1e-15), "1 1.0000000000000007 1.000000000000001"),
        ((0, 1e7), "0 2e+06 4e+06 6e+06 8e+06 1e+07"),
        ((-0.5, 0.5), "-0.4 -0.2 0 0.2 0.4"),
    ],
)
def test_the_labels_of_a_colour_bar_are_its_ticks(limits, expected):
    assert " ".join(labels_of(ticks(*limits))) == expected


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (dict(annotate=("scale",)), "^annotate: expected some of scale_bar, colorbar, got 'scale'$"),
        (dict(annotate=("colorbar",)), "^annotate: expected a colour rule with a map"),
        (
            dict(annotate=("scale_bar",), camera=isospline.PanoramicCamera((0, 0, 0), (0, 1, 0))),
            "^annotate: scale_bar cannot be combined with a panorama",
        ),
        (
            dict(annotate=("scale_bar",), camera=DISTORTED),
            "^annotate: scale_bar cannot be combined with a lens with distortion, which has no scale$",
        ),
    ],
)
def test_marks_that_make_no_sense(options, message):
    with pytest.raises(ValueError, match=message):
        isospline.render(sphere(), size=(16, 9), **options)


@pytest.mark.parametrize("camera", [DISTORTED, isospline.PanoramicCamera((11.5, -30, 11.5), (11.5, 0, 11.5))])
def test_cameras_without_a_scale_have_no_scale_bar(camera):
    plain = isospline.render(sphere(), camera, size=SIZE, annotate=False)
    assert plain.to_srgb()[..., 3].any()
    for options in ({}, {"annotate": True}):
        marked = isospline.render(sphere(), camera, size=SIZE, unit="mm", **options)
        np.testing.assert_array_equal(marked.color, plain.color)


def test_small_pictures_take_marks():
    rule = RAMP.replace(label="a long title of many words")
    options = {"light": isospline.Phong(color=rule), "background": "white"}
    for size in ((1, 1), (3, 40), (40, 3), (16, 9)):
        plain, marked = (
            isospline.render(sphere(), size=size, annotate=marks, **options)
            for marks in ((), ("colorbar", "scale_bar"))
        )
        assert marked.color.shape == plain.color.shape
        assert (marked.color != plain.color).any() or min(size) < 9, size


def test_marks_have_letters_that_the_font_has(monkeypatch):
    drawn = set()
    text = ImageDraw.ImageDraw.text
    monkeypatch.setattr(
        ImageDraw.ImageDraw, "text", lambda self, at, words, **rest: (drawn.add(words), text(self, at, words, **rest))
    )
    shading = isospline.Phong(color=isospline.ColorByCurvature("gaussian", limits=(-0.1, 0.1)))
    marks = dict(annotate=("colorbar", "scale_bar"), unit="µm")
    image = isospline.render(sphere(), size=SIZE, light=shading, **marks)
    assert "-0.1" in drawn and {"gaussian", "curvature", "(1/um^2)"} <= drawn
    font = font_for(image.size)
    missing = bytes(font.getmask("\ue000"))
    assert not [letter for words in drawn for letter in words if bytes(font.getmask(letter)) == missing]


def pixels_on(surface, camera, **marks):
    """The pixels of a surface that marks change in a picture from a camera, None for the one of render()."""
    marked = isospline.render(surface, camera, size=SIZE, light="phong", **marks)
    if camera is None:  # the object is where the marks are not: its colour is left on both sides of a gap
        alpha = marked.color[..., 3].max(axis=0) > 0
        return np.diff(np.flatnonzero(alpha)).max() - 1
    plain = isospline.render(surface, camera, size=SIZE, light="phong")
    return np.count_nonzero((marked.color != plain.color).any(axis=-1) & (plain.color[..., 3] > 0))


@pytest.mark.parametrize("marks", [{"annotate": ("colorbar",)}, {"legend": True}], ids=str)
def test_marks_stand_beside_the_object(marks):
    rule = RAMP.replace(label="temperature in K")
    surface = isospline.Isosurface(sphere().volume, sphere().level, color=rule, name="a ball")
    wide = isospline.Mesh(mesh_sphere(3.0, 16).vertices * (4, 1, 1), mesh_sphere(3.0, 16).faces, color=rule, name="egg")
    for item in (surface, wide):
        assert pixels_on(item, None, **marks) >= 2  # free columns between
        left = isospline.camera_for(item, size=SIZE)
        shifted = isospline.PerspectiveCamera(left.eye, left.target, left.up, 2.2 * left.field_of_view)
        assert pixels_on(item, shifted, **marks) == 0
    # Where there is no space, a panel keeps the text readable.
    close = isospline.PerspectiveCamera(left.eye, left.target, left.up, 0.2 * left.field_of_view)
    assert pixels_on(wide, close, **marks) > 0


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize(
    "space", [(0.3, 0.0, 0.0), (0.0, 0.25, 0.0), (0.2, 0.3, 0.0), (0.0, 0.0, 0.3), (0.2, 0.0, 0.1)]
)
def test_cameras_leave_space_for_marks(projection, space):
    surface, options = sphere(), dict(size=(200, 80), projection=projection, margin=0.1)
    for camera in (camera_beside(space, surface, **options), *cameras_around(space, surface, 3, **options)):
        covered = isospline.render(surface, camera, size=(200, 80), light="phong").color[..., 3] > 0
        columns, rows = (np.flatnonzero(covered.any(axis=axis)) for axis in (0, 1))
        left, right = columns[0] / 200 - space[0], 1 - (columns[-1] + 1) / 200 - space[1]
        assert left == pytest.approx(right, abs=0.02) and left >= 0.045
        above, below = rows[0] / 80, 1 - (rows[-1] + 1) / 80 - space[2]
        assert above == pytest.approx(below, abs=0.03) and above >= 0.045


def test_the_title_of_a_colour_bar_is_its_label(monkeypatch):
    drawn = set()
    text = ImageDraw.ImageDraw.text
    monkeypatch.setattr(
        ImageDraw.ImageDraw, "text", lambda self, at, words, **rest: (drawn.add(words), text(self, at, words, **rest))
    )
    rule = RAMP.replace(label="dose in Gy")
    assert rule.label == "dose in Gy" and rule != RAMP
    isospline.render(sphere(), size=SIZE, light=isospline.Phong(color=rule), annotate=("colorbar",))
    assert "dose in Gy" in {" ".join(drawn), *drawn} or {"dose", "Gy"} <= {
        word for line in drawn for word in line.split()
    }


@pytest.mark.parametrize(
    ("rule", "title"),
    [
        (RAMP.replace(label="  "), "value"),
        (isospline.ColorByThickness(limits=(0, 1), label=" "), "thickness"),
        (isospline.ColorByDistance([(0, 0, 0)], limits=(0, 1), signed=False, label="\n"), "distance"),
    ],
)
def test_a_blank_label_is_none(rule, title):
    bare = isospline.render(sphere(), size=SIZE, color=rule.replace(label=title), annotate="colorbar")
    blank = isospline.render(sphere(), size=SIZE, color=rule, annotate="colorbar")
    np.testing.assert_array_equal(blank.color, bare.color)


@pytest.mark.parametrize("light", ["studio", "phong", "path-trace"])
def test_what_is_not_shown_has_no_colour_bar(light):
    scene = isospline.Scene([sphere(), isospline.Isosurface(sphere().volume, sphere().level, color=RAMP)])
    scene.set_visibility(1, visible=False)
    options = dict(size=(64, 48), light=light, samples=1)
    marked = isospline.render(scene, annotate=True, **options)
    scene.remove(1)
    np.testing.assert_array_equal(marked.color, isospline.render(scene, annotate=True, **options).color)
    own = isospline.Isosurface(sphere().volume, sphere().level, color="red")
    with pytest.raises(ValueError, match="annotate: expected a colour rule with a map"):
        isospline.render(own, light=isospline.Studio(material=isospline.Material(RAMP)), annotate="colorbar")


def test_a_colour_bar_leaves_the_legend_alone(monkeypatch):
    ball = mesh_sphere(1.0, 32)
    names = "an egg", "its yolk", "its white"
    eggs = [isospline.Mesh(ball.vertices * (1, 1, 2), ball.faces, color=RAMP, name=name) for name in names]
    # The objects cover the right half of the picture, so that both marks belong on the left.
    camera = isospline.OrthographicCamera((-0.9, -9, 0), (-0.9, 0, 0), height=2.4)
    boxes = []
    for kind, found in ((Legend, list), (ColorBar, lambda box: [box])):
        monkeypatch.setattr(kind, "draw", recorded(kind.draw, lambda box, found=found: boxes.extend(found(box))))
    isospline.render(eggs, camera, size=SIZE, light="phong", legend=True, annotate="colorbar")
    assert len(boxes) == 2 and not overlap(*boxes)


def recorded(draw, record):
    """A method that draws, of which `record` gets the results."""

    def draw_and_record(*arguments):
        result = draw(*arguments)
        record(result)
        return result

    return draw_and_record


def test_marks_on_a_transparent_picture_are_readable_on_black_and_on_white():
    surface = isospline.Isosurface(sphere().volume, sphere().level, name="ball")
    picture = isospline.render(surface, size=(200, 120), legend=True, light="phong").color
    for background in (0.0, 1.0):
        over = picture[..., :3] + (1 - picture[..., 3:]) * background
        names = over[5:20, 18:45]  # beside the swatch
        assert names.min() < 0.1 and names.max() > 0.9, background


def test_names_units_and_measurements_have_letters_that_the_font_has(monkeypatch):
    drawn, draw = [], ImageDraw.ImageDraw.text
    monkeypatch.setattr(
        ImageDraw.ImageDraw, "text", lambda *args, **options: (drawn.append(args[2]), draw(*args, **options))
    )
    volume = isospline.volumes.sphere().volume(12, unit="Å")
    surface = isospline.Isosurface(volume, 0.0, name="Gefäß, œsophage, Łąka")
    camera = isospline.camera_for(surface)
    image = isospline.render(surface, camera, size=(320, 240), annotate=("scale_bar",), legend=True)
    assert drawn[0] == "Gefass, oesophage, Laka" and drawn[1].endswith(" angstrom")
    points = tuple(MeasuredPoint(0, (0.0, 0.0, z), (0.0, 0.0, 1.0)) for z in (-0.5, 0.5))
    draw_measurements(image, (Measurement(1, "distance", points),), camera, "µm")
    assert drawn[-1] == "1: 1 um"


@pytest.mark.parametrize("place", ["system", "matplotlib", "nowhere"])
def test_names_in_greek_and_cyrillic_are_in_a_font_that_has_them(monkeypatch, place):
    matplotlib, load = pytest.importorskip("matplotlib"), ImageFont.truetype

    def installed(file, size, **options):
        if isinstance(file, str):
            if place != ("system" if file == "DejaVuSans.ttf" else "matplotlib"):
                raise OSError("cannot open resource")
            file = f"{matplotlib.get_data_path()}/fonts/ttf/DejaVuSans.ttf"
        return load(file, size, **options)

    monkeypatch.setattr(ImageFont, "truetype", installed)
    _dejavu.cache_clear()
    volume, pictures = isospline.volumes.sphere().volume(12), set()
    camera = isospline.camera_for(isospline.Isosurface(volume, 0.0))
    for name in ("ήπαρ", "λάθη", "кость", "череп", "чёрая", "черая"):
        surface = isospline.Isosurface(volume, 0.0, name=name)
        pictures.add(isospline.render(surface, camera, size=(320, 240), legend=True).to_srgb().tobytes())
    _dejavu.cache_clear()
    assert len(pictures) == (2 if place == "nowhere" else 6)  # all boxes are the same


def test_pictures_without_marks_load_no_font(monkeypatch):
    monkeypatch.setattr("PIL.ImageFont.load_default", lambda *_: pytest.fail("a font was loaded"))
    isospline.render(sphere(), size=(16, 9), light="phong")
