"""The viewer shows an overview of a store while something moves, and the level that a still picture needs."""

import numpy as np
import pytest

import isospline
from isospline import volumes
from isospline.viewer.document import Document, read_source
from isospline.viewer.picture import PictureMaker, Stage, passes
from isospline.viewer.save import save
from isospline.viewer.script import script
from isospline.viewer.session import open_session, read_session, session_of, write_session
from isospline.viewer.state import CameraState, ViewState

pytest.importorskip("zarr")

SHAPE, SIZE = (40, 40, 400), (64, 48)
LEVEL = 0.0
NEAR = CameraState(eye=(150.0, -60.0, 30.0), target=(150.0, 20.0, 20.0), up=(0.0, 0.0, 1.0))
FAR = NEAR.replace(eye=(200.0, -3000.0, 900.0))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("store") / "long.zarr"
    isospline.convert(volumes.gyroid().values(SHAPE), folder)
    return folder


@pytest.fixture
def opened(folder):
    document = Document()
    source = document.add(read_source(folder))
    return document, source, ViewState(camera=NEAR).with_new_object(source.key, LEVEL)


def test_scales_follow_the_camera(opened, folder):
    document, source, state = opened
    assert source.item.shape == (20, 20, 200) and source.is_volume
    maker = PictureMaker(document)
    maker.render(state, SIZE)
    assert maker.scales == {source.key: 1}
    still = maker.render(state, SIZE, Stage(1, True))
    assert maker.scales == {source.key: 0}
    far = maker.render(state.replace(camera=FAR), SIZE, Stage(1, True))
    assert maker.scales[source.key] > 1
    moving = maker.render(state, SIZE)
    assert maker.scales == {source.key: 1}

    assert still.color.any() and moving.color.any() and far.color.any()
    assert (still.color != moving.color).any()


@pytest.mark.parametrize("camera", [NEAR, FAR], ids=["near", "far"])
@pytest.mark.parametrize("shown", ["its colour", "values on a cut", "values of the store"])
def test_script_makes_the_very_picture(opened, camera, shown, tmp_path, monkeypatch):
    document, source, state = opened
    state = state.replace(camera=camera)
    if shown == "values on a cut":
        cut = {"kind": "plane", "point": (150.0, 20.0, 20.0), "normal": (0.0, 1.0, 0.3), "values": True}
        state = state.replace(clip=state.clip.replace(**cut))
    elif shown == "values of the store":
        state = state.with_object(0, color_by=source.key, cmap="viridis", limits=(-0.5, 0.5))
    monkeypatch.chdir(tmp_path)
    known = {}
    exec(compile(script(document, state, SIZE), "picture.py", "exec"), known)
    image = PictureMaker(document).render(state, SIZE, passes(state)[-1])
    np.testing.assert_array_equal(known["image"].to_srgb(), image.to_srgb())


def test_a_saved_mesh_is_that_of_the_finest_scale(folder, tmp_path):
    with isospline.view(browser=False) as viewer:
        viewer.open(folder)
        state = viewer.state.replace(camera=NEAR, objects=()).with_new_object("source1", LEVEL)
        name, content = save(viewer, "mesh", state, SIZE, {})
    (tmp_path / name).write_bytes(content)
    expected = isospline.Isosurface(isospline.open_volume(folder), LEVEL, closed=True).to_mesh()
    assert len(isospline.read_mesh(tmp_path / name).faces) == len(expected.faces)


def test_a_store_tells_whether_it_is_of_a_patient(opened, tmp_path):
    assert not opened[1].about().patient
    scan = isospline.VolumeData(volumes.gyroid().values(20), patient=True)
    isospline.convert(scan, tmp_path / "scan.zarr")
    assert Document().add(read_source(tmp_path / "scan.zarr")).about().patient


def test_sessions_open_the_store(opened, tmp_path):
    document, source, state = opened
    write_session(tmp_path / "a.json", session_of(document, state))
    again = Document()
    assert open_session(again, read_session(tmp_path / "a.json")) == state
    assert next(iter(again)).item.shape == source.item.shape
