"""The viewer shows an overview of a store while something moves, and the level that a still picture needs."""

import threading

import numpy as np
import pytest
from viewer_client import Client

import isospline
from isospline import volumes
from isospline._core import Cancelled
from isospline.store import detail
from isospline.viewer import window
from isospline.viewer.document import Document, read_source
from isospline.viewer.picture import PictureMaker, Stage, passes
from isospline.viewer.save import save
from isospline.viewer.script import script
from isospline.viewer.session import open_session, read_session, session_of, write_session
from isospline.viewer.slices import SliceView, sample_slices
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


def test_slices_have_the_grid_of_the_finest_scale(opened, folder):
    _, source, _ = opened
    about, finest = source.about(), isospline.open_volume(folder)
    assert about.counts == SHAPE[::-1] and source.middle == (199.5, 19.5, 19.5)
    np.testing.assert_array_equal(about.affine, finest.affine)


@pytest.mark.parametrize("overview", [1, 3])
def test_a_slice_shows_the_scale_with_a_sample_for_each_point(folder, overview, monkeypatch):
    """From the whole slice at few points to a part at every sample: at a tenth of a sample, too."""
    monkeypatch.setattr(detail, "_OVERVIEW", 400 >> overview)
    scales, (z, y, x) = detail.Scales(folder), (20.0, 21.5, 200.25)
    for extent, points, needed in ((399, 2, 3), (399, 51, 2), (399, 200, 1), (399, 201, 0), (39, 40, 0), (4, 41, 0)):
        view = SliceView((0, 10), (extent, 10 + min(extent, 29)), points)
        lower, upper, values = sample_slices(
            scales, (x, y, z), [view.replace(lower=(0, 0), upper=(39, 39)), view, view]
        )[2]
        rows, columns = values.shape
        assert (tuple(lower), tuple(upper)) == (view.lower, view.upper) and columns <= points
        along = np.linspace(view.lower[0], view.upper[0], columns), np.linspace(view.lower[1], view.upper[1], rows)
        index = np.stack([*np.meshgrid(*along), np.full(values.shape, z)], axis=-1)
        volume = isospline.open_volume(folder, scale=min(needed, overview))
        np.testing.assert_array_equal(values, volume.sample(index).astype(np.float32))


def test_only_the_chunks_of_a_slice_are_read(opened):
    scales = opened[1].grid
    before = scales.volume(0).paging["chunks_read"]
    views = [SliceView((2, 2), (25, 25), 24)] * 3
    sample_slices(scales, (16, 16, 16), views)
    assert scales.volume(0).paging["chunks_read"] - before == 1


def test_reading_of_slices_can_be_cancelled(opened):
    with pytest.raises(Cancelled):
        sample_slices(opened[1].grid, (16, 16, 16), progress=lambda _: False)


@pytest.fixture
def viewer(folder):
    with isospline.view(browser=False) as viewer:
        viewer.open(folder, levels=[LEVEL])
        yield viewer


def test_the_value_under_the_pointer_is_that_of_the_finest_scale(viewer, folder):
    client, finest = Client(viewer), isospline.open_volume(folder)
    client.send(type="sample", volume="source1", index=[311, 17, 5])
    about, _ = client.receive("sampled")
    assert about["index"] == [311, 17, 5]
    assert about["value"] == finest.sample((311.0, 17.0, 5.0))
    assert finest.paging["chunks_read"] == 1
    client.close()


def test_a_measured_index_is_that_of_the_finest_scale(viewer, folder):
    """Also at a picture of a coarser one."""
    client = Client(viewer)
    client.send(type="camera", camera=FAR.replace(target=(199.5, 19.5, 19.5)).to_json())
    client.send(type="pick", x=32, y=24)
    point = client.receive("measured")[0]["point"]
    assert max(point["position"]) > 100 and viewer.document["source1"].scale(FAR.camera(), SIZE) > 1
    to_index = np.linalg.inv(isospline.open_volume(folder).affine)
    np.testing.assert_allclose(point["index"], (to_index @ (*point["position"], 1.0))[:3], atol=1e-9)
    client.close()


def test_pictures_do_not_wait_for_the_value_under_the_pointer(viewer, monkeypatch):
    may_read = threading.Event()

    def value_at(*_):
        assert may_read.wait(30)
        return 7.0

    monkeypatch.setattr(window, "value_at", value_at)
    client = Client(viewer)
    client.send(type="sample", volume="source1", index=[3, 1, 2])
    client.send(type="change_object", id=0, changes={"level": 0.25}, input=5)
    while client.receive("frame")[0]["input"] != 5:
        pass
    may_read.set()
    assert client.receive("sampled")[0]["value"] == 7.0
    client.close()


def test_sessions_open_the_store(opened, tmp_path):
    document, source, state = opened
    write_session(tmp_path / "a.json", session_of(document, state))
    again = Document()
    assert open_session(again, read_session(tmp_path / "a.json")) == state
    assert next(iter(again)).item.shape == source.item.shape
