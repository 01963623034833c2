"""States, sessions and the Python code of a picture: round trips, and error messages."""

import json
import os
import re

import numpy as np
import pytest

import isospline
from isospline import volumes
from isospline.cli.main import main
from isospline.viewer.document import Document, read_source, source_of
from isospline.viewer.measure import measure
from isospline.viewer.picture import PictureMaker, Stage, passes
from isospline.viewer.script import script
from isospline.viewer.session import open_session, read_session, session_of, write_session
from isospline.viewer.state import CameraState, ClipState, ObjectState, SliceState, ViewState

SIZE = (48, 36)
CAMERA = CameraState(eye=(30.0, -50.0, 40.0), target=(12.0, 11.0, 10.0), up=(0.0, 0.0, 1.0))
PARALLEL = CAMERA.replace(projection="orthographic", height=30.0)

STATES = {
    "plain": {},
    "phong": {"light": "phong", "shadows": True, "camera": PARALLEL},
    "outline": {"light": "outline", "exponent": 1.5},
    "ambient occlusion": {"light": "ambient-occlusion"},
    "path traced": {"light": "path-trace"},
    "capped": {"clip": ClipState("plane", (12.0, 11.0, 10.0), (0.2, 1.0, 0.0), values=True)},
    "box": {"clip": ClipState("box", minimum=(0.0, 0.0, 0.0), maximum=(12.0, 30.0, 30.0), capped=False)},
}


@pytest.fixture
def folder(tmp_path):
    np.save(tmp_path / "ball.npy", (1000 * volumes.sphere(0.7).values((20, 22, 24))).astype(np.int16))
    (tmp_path / "one.off").write_text("OFF\n3 1 0\n0 0 20\n20 0 20\n0 20 20\n3 0 1 2\n", encoding="utf-8")
    return tmp_path


@pytest.fixture
def opened(folder):
    document = Document()
    volume = document.add(read_source(folder / "ball.npy"))
    mesh = document.add(read_source(folder / "one.off"))
    level = volume.default_levels()[0]
    state = ViewState(camera=CAMERA).with_new_object(volume.key, level, color_by="mean-curvature")
    look = dict(opacity=0.5, silhouette_opacity=0.9)
    state = state.with_new_object(volume.key, level + 100, **look).with_new_object(mesh.key)
    return document, state


def shot(document, state):
    return PictureMaker(document).render(state, SIZE, passes(state)[-1]).to_srgb()


@pytest.mark.slow
@pytest.mark.parametrize("name", STATES)
def test_session_round_trip(opened, folder, name):
    document, state = opened
    state = state.replace(**STATES[name])
    write_session(folder / "a.json", session_of(document, state))
    session = read_session(folder / "a.json")
    assert session.state == state
    again = Document()
    assert shot(again, open_session(again, session)).tolist() == shot(document, state).tolist()


@pytest.mark.parametrize("name", STATES)
def test_script_makes_the_very_picture(opened, folder, name, monkeypatch):
    document, state = opened
    state = state.replace(**STATES[name])
    monkeypatch.chdir(folder)
    known = {}
    exec(compile(script(document, state, SIZE), "picture.py", "exec"), known)
    np.testing.assert_array_equal(known["image"].to_srgb(), shot(document, state))
    assert (folder / "picture.png").stat().st_size > 100


@pytest.mark.parametrize("light", ["studio", "phong", "outline", "ambient-occlusion"])
def test_the_first_picture_of_a_studio_looks_as_moving_ones(opened, light):
    document, state = opened
    maker, state = PictureMaker(document), state.replace(light=light)
    moving, first, last = (
        maker.render(state, SIZE, each).to_srgb() for each in (None, passes(state)[0], passes(state)[-1])
    )
    if light == "studio":
        np.testing.assert_array_equal(first, moving)
    else:  # the last look, in fewer rays
        assert np.abs(first.astype(int) - last).mean() < 8
    assert (first != last).any()


@pytest.mark.parametrize("light", ["path-trace", "ambient-occlusion"])
def test_pictures_in_slow_light_have_about_the_same_colours_in_movement(opened, light):
    """A convex surface, from which only the lower part of the sky is not seen by half of its points."""
    document, state = opened
    state = state.without_object(1).without_object(2).replace(light=light)
    maker = PictureMaker(document)
    moving, still = (maker.render(state, SIZE, each) for each in (None, passes(state)[-1]))
    inside = (
        (moving.color[..., 3] == 1) & (still.color[..., 3] == 1) & (moving.color != moving.color[0, 0]).any(axis=-1)
    )
    a, b = (each.color[inside, :3].mean(axis=0) for each in (moving, still))
    np.testing.assert_allclose(a, b, rtol=0.2)
    plain = maker.render(state.replace(light="phong"), SIZE, None).color[inside, :3].mean(axis=0)
    assert np.abs(a - b).max() < 0.5 * np.abs(plain - b).max()


@pytest.mark.parametrize("metallic, roughness", [(0.0, 0.5), (0.0, 0.2), (1.0, 0.5), (1.0, 0.2), (0.5, 0.35)])
def test_path_tracing_has_its_shadows_and_materials_also_in_movement(metallic, roughness):
    """Two balls, one in the shadow of the other, against the path traced picture: in sRGB, of 255."""
    z, y, x = np.mgrid[:40, :40, :40]
    large, small = ((x - 16) ** 2 + (y - 22) ** 2 + (z - 14) ** 2, (x - 12) ** 2 + (y - 8) ** 2 + (z - 30) ** 2)
    document = Document()
    source = document.add(source_of(np.maximum(12 - np.sqrt(large), 6 - np.sqrt(small)).astype(np.float32)))
    camera = CameraState((25.0, -80.0, 45.0), (18.0, 20.0, 18.0), (0.0, 0.0, 1.0))
    look = {"metallic": metallic, "roughness": roughness}
    state = ViewState(camera=camera, light="path-trace").with_new_object(source.key, 0.0, **look)
    maker = PictureMaker(document)
    still, moving = (maker.render(state, (80, 60), each).to_srgb().astype(int) for each in (Stage(64, True), None))
    inside = (moving != moving[0, 0]).any(axis=-1)
    assert np.abs(moving - still)[inside, :3].mean() < 11  # without shadows and highlights 12 to 17


@pytest.mark.parametrize("changes", [{"visible": False}, {"closed": False}, {"largest": 1}])
def test_pictures_do_not_depend_on_earlier_states(opened, changes):
    """Where caps coincide, that of the last object is seen, also after another one was made anew."""
    document, state = opened
    state = state.replace(light="phong", clip=ClipState("plane", (12.0, 11.0, 10.0), (0.2, 1.0, 0.0)))
    maker, stage = PictureMaker(document), passes(state)[-1]
    for each in (state.with_object(0, **changes), state):
        picture = maker.render(each, SIZE, stage).to_srgb()
        np.testing.assert_array_equal(picture, shot(document, each))


def test_a_level_without_a_surface_leaves_an_empty_picture_without_a_warning(opened):
    document, state = opened
    state = state.without_object(1).without_object(2).replace(light="phong")  # a studio has a ground
    maker = PictureMaker(document)
    above = 2 * document["source1"].level_range[1]
    for level in (0.0, above, 0.0):
        state = state.with_object(0, level=level)
        for stage in (None, passes(state)[-1]):
            for each in (maker, PictureMaker(document)):
                image = each.render(state, SIZE, stage, layers=("depth",))
                assert np.isfinite(image.depth).any() == (level == 0)
    with pytest.warns(UserWarning, match="no surface"):
        isospline.Isosurface(document["source1"].item, above)


def test_render_takes_a_session(opened, folder):
    document, state = opened
    write_session(folder / "a.json", session_of(document, state))
    out = folder / "out.png"
    assert main(["render", "--session", str(folder / "a.json"), "-o", str(out), "--size", "48x36"]) == 0
    import PIL.Image

    np.testing.assert_array_equal(np.asarray(PIL.Image.open(out)), shot(document, state))


def test_a_session_without_a_camera_is_rendered_from_the_view_of_a_new_page(opened, folder):
    """No page has shown a state that comes from Python alone."""
    document, state = opened
    write_session(folder / "a.json", session_of(document, state.replace(camera=None)))
    out = folder / "out.png"
    assert main(["render", "--session", str(folder / "a.json"), "-o", str(out), "--size", "48x36"]) == 0
    import PIL.Image

    scene = isospline.Scene(isospline.Isosurface(document["source1"].item, state.object(0).level))
    scene.add(document["source2"].item)
    view = isospline.suggest_view(document["source1"].item)
    camera = isospline.camera_for(scene, view=view.view, up=view.up, size=SIZE, margin=0.2)
    expected = shot(document, state.replace(camera=CameraState.of(camera)))
    np.testing.assert_array_equal(np.asarray(PIL.Image.open(out)), expected)


@pytest.mark.parametrize("shading", ["phong", "path-trace"])
def test_sessions_are_rendered_with_a_colour_bar_of_the_values_on_the_cut(opened, folder, shading):
    document, state = opened
    clip = ClipState("plane", (12.0, 11.0, 10.0), (0.2, 1.0, 0.0), values=True)
    state = state.replace(clip=clip, light=shading, objects=(state.objects[1].replace(opacity=1.0),))
    pictures = {}
    for name, values in (("colours", True), ("plain", False)):
        write_session(
            folder / "a.json", session_of(document, state.replace(clip=clip.replace(values=values, capped=True)))
        )
        out = folder / f"{name}.png"
        marks = ["--annotate", "--samples", "2"]
        assert main(["render", "--session", str(folder / "a.json"), "-o", str(out), "--size", "320x240", *marks]) == 0
        import PIL.Image

        pictures[name] = np.asarray(PIL.Image.open(out))[..., :3].astype(int)
    bar = np.abs(pictures["colours"] - pictures["plain"]).max(axis=-1)
    is_background = (pictures["plain"] == pictures["plain"][0, 0]).all(axis=-1)
    assert (bar[is_background] > 60).sum() > 100  # beside everything else


def test_sessions_move_with_their_folder(opened, folder, tmp_path_factory):
    document, state = opened
    write_session(folder / "a.json", session_of(document, state))
    assert '"path": "ball.npy"' in (folder / "a.json").read_text(encoding="utf-8")
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "moved"
    os.rename(folder, elsewhere)
    again = Document()
    assert open_session(again, read_session(elsewhere / "a.json")).object(0).level == state.object(0).level


def test_sessions_need_objects_from_files():
    document = Document()
    source = document.add(source_of(np.random.default_rng(0).normal(size=(6, 6, 6))))
    with pytest.raises(ValueError, match="^session: expected objects that were read from files"):
        session_of(document, ViewState().with_new_object(source.key, 0.0))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"objects": [{"id": 0}]}, r"objects\[0\]: expected source, got id"),
        ({"objects": [{"id": 0, "source": "a", "level": float("nan")}]}, "level: expected a finite number, got nan"),
        ({"objects": [{"id": 0, "source": "a", "opacity": 2}]}, "opacity: expected a finite number from 0 to 1, got 2"),
        ({"objects": [{"id": 0, "source": "a", "color": "rde"}]}, "color: expected .* name of a colour, .*got 'rde'"),
        ({"light": "best"}, "light: expected one of studio, phong, outline, ambient-occlusion, path-trace, got 'best'"),
        ({"clip": {"kind": "plane", "normal": [0, 1]}}, r"normal: expected 3 numbers, got \[0, 1\]"),
        ({"lens": 1}, "session.json.*: expected one of .*, got 'lens'|state: expected one of .*, got 'lens'"),
        ({"camera": {"eye": [0, 0, 0]}}, "camera: expected target, got eye"),
        ({"objects": [{"id": 3, "source": "a"}] * 2}, "id: expected one of its own for each object, got 3 of several"),
        ({"slices": {"volume": "a"}}, "slices: expected the key of a source, got 'a'"),
    ],
)
def test_a_wrong_session_is_one_clear_error(tmp_path, changes, message, capsys):
    path = tmp_path / "session.json"
    path.write_text(json.dumps({"format": "isospline session 2", "sources": [], "state": changes}), encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        read_session(path)
    assert main(["render", "--session", str(path), "-o", str(tmp_path / "a.png")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"level": None}, "level: expected a number, as .*ball.npy is a volume, got null"),
        ({"source": "mesh"}, "level: expected null, as .*one.off is a mesh, got 50"),
        ({"color_by": "curvedness"}, "a.json: color_by: expected one of color, .* or the key of .*, got 'curvedness'"),
        ({"color_by": "mesh"}, "color_by: expected the key of a volume, got 'mesh' of the mesh .*one.off"),
    ],
)
def test_objects_of_a_session_that_was_changed_by_hand_fit_its_files(folder, changes, message, capsys):
    sources = [{"key": "ball", "path": "ball.npy"}, {"key": "mesh", "path": "one.off"}]
    state = {"objects": [{"id": 0, "source": "ball", "level": 50, **changes}], "camera": CAMERA.to_json()}
    session = {"format": "isospline session 2", "sources": sources, "state": state}
    (folder / "a.json").write_text(json.dumps(session), encoding="utf-8")
    assert main(["render", "--session", str(folder / "a.json"), "-o", str(folder / "a.png")]) == 2
    assert re.search(message, capsys.readouterr().err)
    twice = {**session, "sources": [sources[0]] * 2, "state": {}}
    (folder / "a.json").write_text(json.dumps(twice), encoding="utf-8")
    with pytest.raises(ValueError, match="expected a key of its own for each source, got 'ball' of several"):
        read_session(folder / "a.json")


def test_a_session_may_begin_with_the_mark_of_utf_8(tmp_path):
    text = json.dumps({"format": "isospline session 2", "state": {"light": "phong"}})
    (tmp_path / "a.json").write_text(text, encoding="utf-8-sig")
    assert read_session(tmp_path / "a.json").state.light == "phong"


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"format": "isospline session 99"}', "\x00", "[" * 10000])
def test_files_that_are_no_sessions_are_refused(tmp_path, content):
    (tmp_path / "a.json").write_text(content, encoding="utf-8")
    with pytest.raises(ValueError, match="expected a session of isospline"):
        read_session(tmp_path / "a.json")


def test_states_know_their_objects():
    state = ViewState().with_new_object("a", 1.0).with_new_object("a", 2.0)
    assert [each.id for each in state.objects] == [0, 1]
    assert state.objects[0].color != state.objects[1].color
    assert state.without_object(0).with_new_object("a", 3.0).objects[-1].id == 2
    assert state.with_object(1, level=5).object(1).level == 5
    with pytest.raises(ValueError, match="id: expected the id of an object in the view"):
        state.with_object(7, level=5)


def test_records_convert_to_json():
    state = ViewState(camera=PARALLEL, slices=SliceState(True, "a", (1, 2, 3))).with_new_object("a", 1.0, limits=(0, 1))
    assert ViewState.from_json(json.loads(json.dumps(state.to_json())), "state") == state
    assert isinstance(state.objects[0], ObjectState)


def test_camera_states_give_the_rays_of_camera_for():
    for projection in ("perspective", "orthographic"):
        camera = isospline.camera_for([(0, 0, 0), (1, 2, 3)], projection=projection)
        np.testing.assert_array_equal(CameraState.of(camera).camera().rays((5, 4)), camera.rays((5, 4)))


def test_a_solid_is_closed_at_the_border_or_open_as_it_was_given():
    volume = isospline.Volume(np.pad(np.ones((12, 12, 6)), ((0, 0), (0, 0), (0, 6))))
    cut = ClipState("plane", (0.0, 5.0, 0.0), (0.0, 1.0, 0.0), capped=False)
    rays = [(-9.0, 6.0, 6.0, 1.0, 0.0, 0.0)]
    for item, is_closed in (
        (volume, True),
        (isospline.Isosurface(volume, 0.5), False),
        (isospline.Isosurface(volume, 0.5, closed=True), True),
    ):
        with isospline.view(item, levels=[0.5], browser=False) as viewer:
            assert viewer.state.objects[0].closed == is_closed
            for closed in (True, False):
                for changes in ({}, {"clip": cut}):
                    state = viewer.state.with_object(0, closed=closed, level=0.4).replace(camera=CAMERA, **changes)
                    assert ("closed=True" in script(viewer.document, state, SIZE)) == closed
                    with viewer.making() as maker:
                        maker.geometry_ids(state)
                        assert maker.scene.count_intersections(rays) == (2 if closed else 1)


def test_a_ct_is_shown_without_its_table(tmp_path, scan_with_table, monkeypatch):
    path, _ = scan_with_table
    with isospline.view(path, browser=False) as viewer:
        (each,) = viewer.state.objects
        assert each.level > 0 > each.body_level
        about = viewer.document[each.source].about()
        assert about.body_level == each.body_level
        state = viewer.state.replace(camera=CAMERA)
        cut = ClipState("plane", (24.0, 16.0, 20.0), (0.0, 0.0, 1.0))
        with viewer.making() as maker:

            def extent(state):
                maker.geometry_ids(state)
                return maker.scene.extent([(0, 1, 0)])[0]

            for changes in ({}, {"clip": cut}):
                for level in (each.level, each.level + 1):
                    changed = state.with_object(each.id, level=level).replace(**changes)
                    np.testing.assert_allclose(extent(changed), (12, 20), atol=0.75)
                    assert extent(changed.with_object(each.id, body_level=None))[1] > 38
        session = session_of(viewer.document, state)
        again = Document()
        np.testing.assert_array_equal(shot(again, open_session(again, session)), shot(viewer.document, state))
        monkeypatch.chdir(tmp_path)
        known = {}
        exec(compile(script(viewer.document, state, SIZE), "picture.py", "exec"), known)
        np.testing.assert_array_equal(known["image"].to_srgb(), shot(viewer.document, state))
    with isospline.view(isospline.read_volume(path), browser=False) as viewer:
        assert viewer.state.objects == state.objects
    with isospline.view(np.load(path.with_suffix(".npy")), levels=[300], browser=False) as viewer:
        assert viewer.state.objects[0].body_level is None


def test_the_thickness_of_an_object_is_its_own():
    """An object within does not end the way to the other side."""

    def cube(half):
        corners = half * (2.0 * np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), -1).reshape(8, 3) - 1)
        faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        return isospline.Mesh(corners, [f for a, b, c, d in faces for f in ((a, b, c), (a, c, d))])

    scene = isospline.Scene([cube(0.8), cube(0.3)])
    camera = isospline.camera_for(scene, view="front", size=(64, 48))
    assert measure(scene, {0: 0, 1: 1}, camera, (64, 48), (32, 24)).thickness == pytest.approx(1.6)
