"""The viewer: the open sources, the state, and the windows that show it."""

from __future__ import annotations

import contextlib
import html
import os
import secrets
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..base.system import warn
from ..io import isolated
from ..levels import count_pieces
from ..scene import Isosurface
from .bundle import bundle_sizes, is_bundle, unpack
from .document import Document, read_source, source_of
from .framing import camera_towards
from .history import History
from .picture import PictureMaker
from .session import is_inside, open_session, read_session, warn_of_level
from .slices import with_slices
from .state import ViewState
from .to_page import Progress, Steps
from .upload import UPLOAD_COUNT, UPLOAD_LIMIT, Uploads

_LEADING = '<!doctype html><meta name="referrer" content="no-referrer"><meta http-equiv="refresh" content="0; url={}">'


class Viewer:
    """Shows volumes and meshes in any number of browser windows at once.

    `isospline.view` makes it. All windows show the same objects; each window has its own camera. Any thread may call
    the methods.

    Attributes
    ----------
    url : str
        The address to open in a browser.
    state : ViewState
        The displayed state. It is immutable; `change` replaces it.
    """

    def __init__(self, *, host="127.0.0.1", port=0, token=None, upload_limit=UPLOAD_LIMIT, upload_count=UPLOAD_COUNT):
        if missing := isolated.unconfined():
            warn(missing)
        self.document = Document()
        self._lock = threading.RLock()
        self._state = ViewState()
        self._history = History()
        self._windows = []
        self._closed = threading.Event()
        self._workers = ThreadPoolExecutor(2, "isospline-view")
        self._making = threading.Lock()
        self._maker = PictureMaker(self.document)
        self._camera = None
        self.progress = Progress(None, 1.0)
        self.uploads = Uploads(upload_limit, upload_count)
        #: Another value for each viewer: a page sees that it is connected to another one.
        self.run = secrets.token_hex(8)
        from .server import Server  # asyncio is slow to import

        self._server = Server(self, host, port, token)

    @property
    def url(self) -> str:
        return self._server.url

    @property
    def address(self) -> str:
        """The same without the token."""
        return self._server.address

    @property
    def is_open(self) -> bool:
        """Whether it is neither closed nor closing: long tasks go on."""
        return not self._closed.is_set()

    @property
    def state(self) -> ViewState:
        with self._lock:
            return self._state.replace(camera=self._camera)

    def change(self, function: Callable[[ViewState], ViewState]) -> None:
        """Replace the state by ``function(state)``, and show it in all windows."""
        self._change(function, is_step=True)

    def undo(self) -> None:
        """Return to the state before the last change; quick changes of the same things, as by dragging, are one."""
        self._change(self._history.undo, is_step=False)

    def redo(self) -> None:
        """Make the change again that was undone last."""
        self._change(self._history.redo, is_step=False)

    @property
    def history(self):
        """Which of undo and redo there is something for, for pages."""
        with self._lock:
            return Steps(self._history.can_undo, self._history.can_redo)

    def _change(self, function, is_step):
        with self._lock:
            before, self._state = self._state, self._open_part(function(self._state))
            if is_step and before != ViewState():  # not the first file
                self._history.record(before, self._state)
            windows = list(self._windows)
        for window in windows:
            window.state_changed()

    def _open_part(self, state):
        """A state without what is made of sources that are not open."""
        keys = {each.key: each.key for each in self.document}
        return state if state.named_sources() <= keys.keys() else state.with_keys(keys)

    # -- Opening ---------------------------------------------------------------------------------------------------

    def open(self, path, *, levels=None, largest=None, table=False, read_options=None, model_options=None, within=None):
        """Read a file and show it: a mesh, or isosurfaces of a volume, by default at a suggested level.

        By default, a CT of a patient is shown without the table and other things apart from the body. `within` is the
        folder of an upload, whose files may refer to no others.
        """
        options = {"read_options": read_options, "model_options": model_options, "within": within}
        return self._show(read_source(path, progress=self.tell, **options), levels, {"largest": largest}, table)

    def add(self, item, *, levels=None, **look):
        """Show a Volume, VolumeData, array, Isosurface or Mesh.

        Isosurfaces and meshes have their own look: a rule for their colour is "own" in the state. Other levels of an
        isosurface get its options, until the viewer's own cut replaces its clip and mask.
        """
        if isinstance(item, Isosurface):
            known = self.document.source_of_volume(item.volume)

            def make(key):
                return replace(known or source_of(item.volume)(key), key=key, template=item)

            return self._show(make, [item.level], {"largest": item.largest, "closed": item.closed, **look})
        return self._show(source_of(item), levels, look)

    def close_source(self, key: str) -> None:
        """Close a volume or a mesh by its key, that of `open`'s result and of ``viewer.document``.

        Its objects and their measurements go, and its memory and its uploaded files are free. This cannot be undone.
        """
        source = self.document[key]
        others = [each for each in self.document if each.key != key]
        keys = {each.key: each.key for each in others}
        volume = next((each for each in others if each.is_volume), None)

        def without(state):
            state = state.with_keys(keys)
            return state if volume is None else with_slices(state, volume)

        self._change(without, is_step=False)
        with self._lock:  # what was made of it meanwhile goes, too
            self.document.remove(key)
            self._history.replace(without, without(self._state))
        self._change(lambda state: state, is_step=False)
        for window in self.windows():
            window.source_closed()
        with self.making() as maker:
            maker.forget_closed()
        if source.within is not None:
            self.discard_unused(source.within)

    @contextlib.contextmanager
    def holding(self, folder):
        """Keep a folder of uploads while its files are opened; at the end, remove it if none is open."""
        self.uploads.hold(folder)
        try:
            yield
        finally:
            self.uploads.release(folder)
            self.discard_unused(folder)

    def discard_unused(self, path):
        """Remove the folder of uploads that has a path, if nothing in it is open or being opened."""
        folder = self.uploads.root_of(path)
        used = [each.within for each in self.document if each.within is not None]
        if folder and not self.uploads.is_held(folder) and not any(is_inside(each, folder) for each in used):
            self.uploads.discard(folder)

    def read_session(self, path):
        """Read a session or a bundle: returns the session, and the folder of the bundle's files or None."""
        if not is_bundle(path):
            return read_session(path), None
        folder = self.uploads.folder(bundle_sizes(path))
        try:
            return read_session(unpack(path, folder)), folder
        except BaseException:
            self.uploads.discard(folder)
            raise

    def open_session(self, session, folder=None, uploaded=False):
        """Read the files of a session, and show its state; the other parameters are those of `open_session`."""
        with self._telling_end():
            state = open_session(self.document, session, self.tell, folder, uploaded)
        with self._lock:
            self._camera = state.camera
        for source in self.document:  # a session may have no slices
            if source.key in {each.source for each in state.objects}:
                state = with_slices(state, source)
        self.change(lambda _: state.replace(camera=None))
        for window in self.windows():
            window.document_changed(fit=state.camera is None)
            if state.camera is not None:
                window.set_camera(state.camera)

    def _show(self, make, levels, look=None, table=False):
        with self._telling_end():
            source = self.document.add(make)
            try:
                return self._show_source(source, levels, look or {}, table)
            except BaseException:
                self.document.remove(source.key)
                raise

    def _show_source(self, source, levels, look, table):
        if "color" in look:
            look = {"color_by": "color", **look}
        look = {**source.look, **look}
        if not source.is_volume:
            levels = [None]
        elif levels is None:
            level, body_level = source.default_levels()
            levels = [level]
            if body_level is not None and not table:
                self.tell(f"finding the body in {source.name}", 0.0)
                look = {**look, "body_level": body_level}
            if source.scales is None and not table and look.get("largest") is None:
                mask = source.mask(look.get("body_level"))
                kept, found = count_pieces(Isosurface(source.item, level, mask=mask))
                look = {**look, "largest": kept if kept < found else None}

        def add(state):
            for level in levels:
                state = state.with_new_object(source.key, level, **look)
            return with_slices(state, source)

        self._make_room(add(self.state), source)
        self.change(add)
        for level in levels:
            warn_of_level(source, level)
        for window in self.windows():
            window.document_changed()
        return source

    def _make_room(self, state, source):
        """Move the cameras before a source is shown in a state: for the first, and for one that reaches farther."""
        before = {each.source for each in self._state.objects}
        known, box = self.document.bounds(before), np.asarray(source.item.bounds)
        if before and (known[0] <= box[0]).all() and (box[1] <= known[1]).all():
            return
        self.tell(f"finding the view of {source.name}", 0.0)
        for window in self.windows():
            window.make_room(state, box if before else None)

    @contextlib.contextmanager
    def _telling_end(self):
        try:
            yield
        finally:
            self.tell(None, 1.0)

    # -- Windows ---------------------------------------------------------------------------------------------------

    def windows(self):
        """The open windows."""
        with self._lock:
            return list(self._windows)

    def attach(self, window):
        """Add a window, which will show every change."""
        with self._lock:
            self._windows.append(window)

    def detach(self, window):
        """Remove a window."""
        with self._lock:
            if window in self._windows:
                self._windows.remove(window)

    def tell(self, title, fraction):
        """Show the progress of long work in all windows, also new ones; a title of None ends it."""
        self.progress = Progress(title, fraction)
        for window in self.windows():
            window.send(self.progress)

    def remember_camera(self, camera):
        """Remember the camera that was moved last, for new windows and for sessions."""
        with self._lock:
            self._camera = camera

    def submit(self, function, *arguments):
        """Run a long task on a thread of the viewer, apart from those of the windows."""
        with contextlib.suppress(RuntimeError):  # the viewer is closing
            self._workers.submit(function, *arguments)

    @contextlib.contextmanager
    def making(self):
        """The picture maker for pictures that belong to no window; one thread at a time has it."""
        with self._making:
            yield self._maker

    def camera_towards(self, view, size, projection="perspective", field_of_view=30.0, *, up=None, state=None):
        """The state of a camera that shows all objects from a side, of the viewer's state or another one."""
        with self.making() as maker:
            return camera_towards(self.document, maker, state or self.state, view, size, projection, field_of_view, up)

    # -- The end ---------------------------------------------------------------------------------------------------

    def wait(self) -> None:
        """Wait until the viewer is closed; Ctrl-C ends the wait with a KeyboardInterrupt."""
        while not self._closed.wait(0.2):
            pass

    def close(self) -> None:
        """Close the windows and stop listening."""
        if self._closed.is_set():
            return
        self._closed.set()
        self._server.close()
        for window in self.windows():
            window.end()
        self._workers.shutdown(wait=True, cancel_futures=True)
        self.uploads.remove()

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self):
        return f"Viewer({self.address}, {len(self.windows())} windows)"  # not the token: texts of objects are logged

    def open_in_browser(self) -> None:
        """Open the page in the user's browser, if there is one.

        The browser gets the name of a private file that leads to the page: all users can read the arguments of
        programs.
        """
        import webbrowser

        path = os.path.join(self.uploads.folder(), "open.html")
        with open(path, "w", encoding="utf-8") as file:
            file.write(_LEADING.format(html.escape(self.url)))
        with contextlib.suppress(webbrowser.Error, OSError):
            webbrowser.open(Path(path).as_uri())
