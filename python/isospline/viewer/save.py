"""Files that a window saves: pictures, turntables, meshes, the session, and the Python code of the picture."""

from __future__ import annotations

import contextlib
import os

import numpy as np

from .. import _core
from ..interop.single_precision import offset_for
from ..interop.trimesh import joined
from ..picture.cameras import extent_of, turn
from ..picture.video import write_video
from ..scene import Isosurface, Mesh
from .bundle import write_bundle
from .checked import choice, count, flag
from .picture import FINAL_SAMPLES, Stage
from .rulers import draw_measurements, length_unit
from .script import script
from .session import session_of, sources_of
from .state import CameraState

#: What can be saved.
SAVED = ("png", "exr", "turntable", "mesh", "session", "python")
#: The largest number of pixels of a picture.
MOST_PIXELS = 1 << 26
#: Pictures of a turntable, and samples per pixel.
TURN, TURN_SAMPLES = 90, 4


def save(viewer, what, state, size, options):
    """The name and the content of a file.

    Parameters
    ----------
    viewer : Viewer
    what : {"png", "exr", "turntable", "mesh", "session", "python"}
        A mesh has all visible isosurfaces, with their cuts. A session with uploads is a ZIP file with their files.
    state : ViewState
        A state with a camera.
    size : (int, int)
        Width and height of pictures.
    options : dict
        "width" and "height" of pictures, if they are not `size`; whether their background is "transparent"; whether PNG
        files show "measurements", by default they do; "pictures" and "samples" of a turntable, whose background is
        never transparent.
    """
    choice(*SAVED)(what, "what")
    size = _size(options, size)
    background = "transparent" if flag(options.get("transparent", False), "transparent") else state.background
    if what == "python":
        return "picture.py", script(viewer.document, state, size, background=background).encode()
    uploaded = any(each.within is not None for each in sources_of(viewer.document, state))
    if what == "session" and not uploaded:
        return "session.json", session_of(viewer.document, state).to_text().encode()
    with _folder(viewer) as folder:
        if what == "session":
            path = os.path.join(folder, "session.zip")
            write_bundle(path, viewer.document, state)
        elif what == "turntable":
            path = os.path.join(folder, "turntable.mp4")
            _write_turntable(viewer, path, state, size, options)
        elif what == "mesh":
            mesh = _mesh(viewer, state)
            # The page shows no warnings, and far from the origin STL does not keep the place.
            suffix = "ply" if offset_for(mesh.vertices, mesh.faces).any() else "stl"
            path = os.path.join(folder, f"mesh.{suffix}")
            mesh.write(path)
        else:
            path = os.path.join(folder, f"picture.{what}")
            look = {"layers": ("depth", "normal", "position") if what == "exr" else (), "background": background}
            with viewer.making() as maker:
                stage = Stage(FINAL_SAMPLES[state.light], True)
                image = maker.render(state, size, stage, _progress(viewer, "rendering"), **look)
                if what == "png" and flag(options.get("measurements", True), "measurements"):
                    draw_measurements(
                        image, state.measurements, state.camera.camera(), length_unit(viewer.document, state)
                    )
                image.write(path)
                maker.end_path_tracing()
        with open(path, "rb") as file:
            return os.path.basename(path), file.read()


def _size(options, size):
    """The size of the options, or that of the page."""
    size = tuple(count(options.get(name, side), name) for name, side in zip(("width", "height"), size))
    if size[0] * size[1] > MOST_PIXELS:
        raise ValueError(f"size: expected at most {MOST_PIXELS} pixels, got {size[0]} x {size[1]}")
    return size


@contextlib.contextmanager
def _folder(viewer):
    """A private folder while a file is written."""
    folder = viewer.uploads.folder()
    try:
        yield folder
    finally:
        viewer.uploads.discard(folder)


def _mesh(viewer, state):
    """The meshes of the visible isosurfaces as one, of the finest scale of stores."""
    with viewer.making() as maker:
        ids = maker.geometry_ids(state, lambda source: None if source.scales is None else 0)
        items = [maker.scene.object(geometry) for geometry in ids.values()]
        surfaces = [item for item in items if isinstance(item, Isosurface)]
        if not surfaces:
            raise ValueError("mesh: expected a visible isosurface, got none")
        meshes = [
            surface.to_mesh(progress=_progress(viewer, "meshing", number / len(surfaces), 1 / len(surfaces)))
            for number, surface in enumerate(surfaces)
        ]
    return Mesh(**joined([{"vertices": mesh.vertices, "faces": mesh.faces} for mesh in meshes]))


def _write_turntable(viewer, path, state, size, options):
    pictures, samples = (
        count(options.get(name, usual), name) for name, usual in (("pictures", TURN), ("samples", TURN_SAMPLES))
    )
    even = tuple(max(2, side - side % 2) for side in size)
    camera = state.camera
    towards = np.subtract(camera.eye, camera.target)
    with viewer.making() as maker:
        maker.geometry_ids(state)
        whole = extent_of(maker.scene)

        def extent(directions):
            if not viewer.is_open:
                raise _core.Cancelled("the viewer was closed")
            return whole(directions)

        framing = dict(projection=camera.projection, field_of_view=camera.field_of_view, size=even)
        cameras = turn(extent, pictures, towards, _axis(camera.up), **framing)

        def images():
            for number, each in enumerate(cameras):
                progress = _progress(viewer, "rendering the turntable", number / pictures, 1 / pictures)
                turned = state.replace(camera=CameraState.of(each, camera.field_of_view))
                yield maker.render(turned, even, Stage(samples, True), progress)

        write_video(path, images())


def _axis(up):
    """The world axis nearest to the upward direction: rotation about it keeps the horizon level."""
    axis = np.zeros(3)
    nearest = int(np.argmax(np.abs(up)))
    axis[nearest] = np.sign(up[nearest])
    return axis


def _progress(viewer, title, begin=0.0, share=1.0):
    """A callable that shows a task's progress on the pages, and cancels the task when the viewer closes."""

    def progress(fraction):
        viewer.tell(title, begin + share * fraction)
        return viewer.is_open

    return progress
