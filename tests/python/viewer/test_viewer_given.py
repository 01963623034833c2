"""Surfaces and meshes that Python gives a viewer: their options and their looks, in pictures, sessions and code."""

import numpy as np
import pytest
import trimesh
from browser import shown

import isospline
from isospline import volumes
from isospline.cli.main import main
from isospline.viewer.document import Document
from isospline.viewer.picture import PictureMaker, passes
from isospline.viewer.script import script
from isospline.viewer.session import open_session, session_of, write_session
from isospline.viewer.state import CameraState, ClipState

SIZE = (48, 36)
CAMERA = CameraState(eye=(30.0, -50.0, 40.0), target=(12.0, 11.0, 10.0), up=(0.0, 0.0, 1.0))
PART = np.arange(24 * 22 * 20).reshape(20, 22, 24) % 24 < 12  # of x


def shot(document, state):
    return PictureMaker(document).render(state, SIZE, passes(state)[-1]).to_srgb()


def test_other_levels_of_a_surface_have_its_options():
    data = volumes.sphere(0.7).values(20)
    mask = np.ones(data.shape, bool)
    volume = isospline.Volume(data)
    mask[:10] = False
    surface = isospline.Isosurface(volume, 0.0, mask=mask)
    with isospline.view(surface, browser=False) as viewer:
        state = viewer.state.with_object(0, level=0.1).replace(camera=CAMERA)
        with viewer.making() as maker:
            (geometry,) = maker.geometry_ids(state).values()
            found = maker.scene.object(geometry)
    assert found.level == 0.1 and surface.level == 0.0
    np.testing.assert_array_equal(found.shell.mask, surface.with_level(0.1).shell.mask)
    assert not found.shell.mask[:10].any() and found.shell.mask.any()


@pytest.mark.parametrize("axes", ["zyx", "xyz"])
@pytest.mark.parametrize(
    "options",
    [
        {"inside": "below", "closed": True},
        {"mask": PART},
        {"clip": isospline.HalfSpace((10.1, 11, 0), (1, 2, 0)), "capped": True},
    ],
    ids=["inside", "mask", "clip"],
)
def test_other_options_leave_those_of_a_given_surface(options, axes):
    samples = volumes.sphere(0.6).values((20, 22, 24))
    if "mask" in options:
        options = {"mask": PART if axes == "zyx" else PART.T}
    volume = isospline.Volume(samples if axes == "zyx" else samples.T, axes=axes)
    surface = isospline.Isosurface(volume, 0.0, **options)
    with isospline.view(surface, browser=False) as viewer:
        maker, given = PictureMaker(viewer.document), viewer.state
        for state, closed in ((given, surface.closed), (given.with_object(0, largest=1), surface.closed)):
            ids = maker.geometry_ids(state)
            shown = maker.scene.object(ids[0])
            assert (shown.inside, shown.closed, shown.capped) == (surface.inside, closed, surface.capped)
            assert shown.enclosed_volume().value == pytest.approx(surface.enclosed_volume().value, rel=1e-3)
        opened = given.with_object(0, closed=not surface.closed)
        expected = isospline.Isosurface(surface.volume, 0.0, **{**options, "closed": not surface.closed})
        shown = maker.scene.object(maker.geometry_ids(opened)[0])
        assert shown.area().value == pytest.approx(expected.area().value, rel=1e-3)
        cut = given.replace(clip=ClipState("plane", (12.0, 11.0, 10.0), (0.0, 1.0, 0.0)))
        assert maker.scene.object(maker.geometry_ids(cut)[0]).inside == surface.inside


def test_hidden_objects_of_a_scene_are_hidden():
    ball = volumes.sphere(0.6).volume(16)
    scene = isospline.Scene([isospline.Isosurface(ball, 0.0), isospline.Isosurface(ball, 0.1)])
    scene.set_visibility(scene.ids[1], visible=False)
    with isospline.view(scene, browser=False) as viewer:
        assert [each.visible for each in viewer.state.objects] == [True, False]


def mesh_of_a_ball(place, **attributes):
    """A ball at a place, with attributes by function of the vertices."""
    mesh = isospline.Isosurface(volumes.sphere(0.6).volume(12), 0.2).to_mesh()
    parts = {name: function(mesh.vertices) for name, function in attributes.items()}
    return isospline.Mesh(mesh.vertices + place, mesh.faces, **parts)


def with_values(place=(2, 0, 0)):
    return mesh_of_a_ball(place, values=lambda vertices: vertices[:, 2])


@pytest.mark.parametrize("light", ["studio", "phong", "ambient-occlusion"])
def test_objects_have_their_own_look(light):
    ball, half = volumes.sphere(0.6).volume(24), isospline.HalfSpace((0, 0.2, 0), (0.3, 1, 0))
    glass = isospline.Material("gold", specular=0.9, opacity=0.4, silhouette_opacity=0.9, silhouette_exponent=1.5)
    inner = isospline.Material(isospline.ColorByVolume(ball, "magma"), cap_color="red")
    scene = isospline.Scene(
        isospline.Isosurface(ball, 0.0, material=glass),
        isospline.Isosurface(ball, 0.2, material=inner, clip=half, capped=True),
        with_values(),
        mesh_of_a_ball((0, 0, 2), colors=lambda vertices: (vertices + 1) / 2),
    )
    camera = isospline.camera_for(scene, view=(0.2, 1.0, -0.1), size=SIZE)
    with isospline.view(scene, browser=False) as viewer:
        state = viewer.state.replace(camera=CameraState.of(camera), light=light)
        options = {"background": state.background, "samples": passes(state)[-1].samples}
        expected = isospline.render(scene, camera, size=SIZE, light=light, **options).to_srgb()
        np.testing.assert_array_equal(shot(viewer.document, state), expected)
        plain = state.with_object(1, color_by="color").with_object(2, color_by="color")
        assert (shot(viewer.document, plain) != expected).any()


def test_a_colour_goes_before_the_own_one():
    mesh = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], values=[1.0, 2.0, 3.0])
    with isospline.view(browser=False) as viewer:
        viewer.add(mesh)
        viewer.add(mesh, color="red")
        assert [each.color_by for each in viewer.state.objects] == ["own", "color"]


def test_sessions_and_scripts_have_the_colours_of_values_in_files(tmp_path, monkeypatch):
    with_values().write(tmp_path / "part.ply")
    with isospline.view(tmp_path / "part.ply", browser=False) as viewer:
        camera = isospline.camera_for(with_values(), size=SIZE)
        state = viewer.state.replace(camera=CameraState.of(camera))
        assert state.objects[0].color_by == "own"
        picture, again, known = shot(viewer.document, state), Document(), {}
        plain = state.with_object(0, color_by="color")
        assert (shot(viewer.document, plain) != picture).any()
        session = session_of(viewer.document, state)
        np.testing.assert_array_equal(shot(again, open_session(again, session)), picture)
        monkeypatch.chdir(tmp_path)
        exec(compile(script(viewer.document, state, SIZE), "picture.py", "exec"), known)
        np.testing.assert_array_equal(known["image"].to_srgb(), picture)
        write_session("session.json", session)
    look = ["--size", "320x240", "--samples", "1"]
    for marks in ((), ("--annotate",)):
        assert main(["render", "--session", "session.json", "-o", f"{len(marks)}.png", *look, *marks]) == 0
    assert (tmp_path / "0.png").read_bytes() != (tmp_path / "1.png").read_bytes()


@pytest.mark.parametrize(
    ("options", "lost"),
    [
        ({"color": "red", "opacity": 0.4, "closed": True}, None),
        ({"inside": "below", "mask": np.arange(8000).reshape(20, 20, 20) % 20 < 10}, "inside, mask"),
        ({"clip": isospline.HalfSpace((12, 11, 10), (0, 1, 0))}, "clip"),
        ({"color": isospline.ColorByNormal()}, "color"),
        ({"material": isospline.Material("red", specular=0, cap_color="blue")}, "specular, cap_color"),
    ],
)
def test_sessions_keep_a_given_surface_or_say_what_they_cannot(ball, options, lost):
    with isospline.view(ball, browser=False) as viewer:
        viewer.add(isospline.Isosurface(viewer.document["source1"].item, 100.0, **options))
        state = viewer.state.without_object(0).replace(camera=CAMERA)
        code = script(viewer.document, state, SIZE)
        assert ("# Its surface was given with" in code) == bool(lost)
        if lost:
            assert f"given with {lost}, which" in code
            with pytest.raises(ValueError, match=f"^session: expected surfaces .* got ball.npy with {lost}$"):
                session_of(viewer.document, state)
            return
        again = Document()
        shown = open_session(again, session_of(viewer.document, state))
        np.testing.assert_array_equal(shot(again, shown), shot(viewer.document, state))
        assert (shown.objects[0].color, shown.objects[0].opacity) == ("#ff0000", 0.4)


@pytest.mark.slow
def test_a_mesh_has_the_colours_of_its_values_and_others(browser):
    sphere = trimesh.creation.icosphere(2)
    mesh = isospline.Mesh(sphere.vertices, sphere.faces, values=sphere.vertices[:, 2])
    with shown(browser, mesh) as (page, viewer):
        rules, before = page.page.get_by_label("Colour by", exact=True), page.pixels()
        assert rules.input_value() == "own"
        for rule in ("color", "own"):
            rules.select_option(rule)
            page.settle()
            assert (page.pixels() != before).any() == (rule == "color")
        page.page.get_by_role("button", name="Remove").click()
        page.page.get_by_role("button", name="+ source1").click()
        page.settle()
        assert viewer.state.objects[0].color_by == "own"


def test_a_mesh_without_vertices_is_refused(ball):
    """Its bounds would be infinite, which pages cannot read, and so would be the picture's."""
    with isospline.view(ball, browser=False) as viewer:
        with pytest.raises(ValueError, match="^source2: expected a mesh with vertices, got one without"):
            viewer.add(isospline.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)))
        assert [each.key for each in viewer.document] == ["source1"]


def test_levels_that_are_no_numbers_open_nothing(ball):
    with isospline.view(browser=False) as viewer:
        with pytest.raises(ValueError, match="^level: expected a finite number, got 'a'"):
            viewer.open(ball, levels=["a"])
        assert not list(viewer.document)


def test_a_moved_mesh_keeps_vertices_without_a_normal():
    scene = isospline.Scene()
    mesh = isospline.Mesh(9 * np.eye(3), [(0, 1, 2)], [(0, 0, 0), (0, 0, 1), (0, 1, 0)])
    scene.add(mesh, transform=np.diag([2.0, 1.0, -3.0, 1.0]))
    with isospline.view(scene, browser=False) as viewer:
        (source,) = viewer.document
        np.testing.assert_array_equal(source.item.normals, [(0, 0, 0), (0, 0, -1), (0, 1, 0)])
