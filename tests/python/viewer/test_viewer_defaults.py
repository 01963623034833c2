"""What a viewer shows of itself: slices, levels, and the files that are open already."""

import numpy as np
import pytest

import isospline
from isospline import volumes
from isospline.viewer.cell import still
from isospline.viewer.session import Session, session_of
from isospline.viewer.state import CameraState, SliceState
from isospline.viewer.window import Window


def test_levels_without_a_volume_are_refused(tmp_path):
    volume = isospline.Volume(volumes.sphere(0.7).values(20))
    for item in (isospline.Isosurface(volume, 0.0), isospline.Isosurface(volume, 0.0).to_mesh(), tmp_path / "m.stl"):
        with pytest.raises(ValueError, match="^levels: expected volumes"):
            isospline.view(item, levels=[0.1], browser=False)


def test_slices_are_those_of_the_first_volume_also_after_undo_and_without_them_in_a_session(tmp_path):
    np.save(tmp_path / "v.npy", volumes.sphere(0.7).values(20))
    with isospline.view(tmp_path / "v.npy", levels=[0.0], browser=False) as viewer:
        session = session_of(viewer.document, viewer.state.replace(slices=SliceState()))
        viewer.change(lambda state: state.without_object(0).replace(slices=SliceState()))
        window = Window(viewer, lambda message: None)
        window.receive('{"type": "add_object", "source": "source1", "level": 0.1}')
        assert viewer.state.slices.volume == "source1" and viewer.state.slices.index == (9.5, 9.5, 9.5)
        window.close()
    with isospline.view(browser=False) as viewer:
        viewer.open_session(session)
        assert viewer.state.slices.volume == "source1"


def test_an_uploaded_session_finds_a_file_that_is_open_with_options(tmp_path):
    path = tmp_path / "v.raw"
    volumes.sphere(0.7).values(20).astype("<f4").tofile(path)
    options = {"shape": (20, 20, 20), "dtype": "float32", "spacing": (1.0, 1.0, 2.0)}
    with isospline.view(browser=False) as viewer:
        viewer.open(path, levels=[0.0], read_options=options)
        text = session_of(viewer.document, viewer.state).to_text()
        viewer.open_session(Session.from_text(text), str(tmp_path / "folder"), uploaded=True)
        assert len(list(viewer.document)) == 1


def test_the_picture_in_a_cell_has_the_camera_of_the_view():
    with isospline.view(volumes.sphere(0.7).values(20), levels=[0.0], browser=False) as viewer:
        home = still(viewer)
        viewer.remember_camera(CameraState((9.5, -300.0, 9.5), (9.5, 9.5, 9.5), (0.0, 0.0, 1.0)))
        assert still(viewer) != home
