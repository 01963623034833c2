"""One window of a viewer: requests of its page, and messages to it."""

from __future__ import annotations

import itertools
import json
import math
import threading
import time

import numpy as np

from .. import colors
from . import to_page
from .checked import number, text, whole
from .encode import encode_jpeg, encode_png, packed
from .from_page import FROM_PAGE
from .measure import index_of, measure
from .measurements import to_csv, with_point
from .picture import PictureMaker, default_limits, passes, picture_part
from .save import save
from .schedule import AdaptiveResolution, FrameScheduler
from .session import check_kinds
from .slices import COARSE, sample_slices, value_at, with_slices
from .state import COLOR_MAPS, COLOR_RULES
from .upload import Receiver


class Window:
    """Answers the messages of a page.

    Parameters
    ----------
    viewer : Viewer
    transmit : callable
        Sends text or bytes to the page, from any thread.
    ended : callable
        Called when the viewer ends.
    """

    def __init__(self, viewer, transmit, ended=lambda: None):
        self._viewer, self._transmit, self._ended = viewer, transmit, ended
        self._lock = threading.Lock()
        self._camera, self._size, self._newest_input = None, None, 0
        self._shown, self._shown_input = None, 0  # the newest picture, and the newest change that it shows
        self._maker = PictureMaker(viewer.document)
        self._resolution = AdaptiveResolution()
        self._receiver = Receiver(viewer, self.send, self._failed)
        self._frames = FrameScheduler(self._draw, self._transmit, lambda shown: passes(shown[0]), failed=self._failed)
        self._slices = FrameScheduler(
            self._draw_slices, self._transmit, lambda shown: (1.0,), failed=self._failed, in_flight=8
        )
        self._slices_shown, self._slice_views = None, None
        viewer.attach(self)

    # -- To the page -----------------------------------------------------------------------------------------------

    def send(self, message):
        """Send a message of `to_page`."""
        self._transmit(json.dumps(to_page.to_message(message)))

    def send_file(self, name, content):
        """Send a file for the page to save."""
        self._transmit(packed(to_page.to_message(to_page.File(name)), content))

    def state_changed(self):
        """Show the viewer's state."""
        state = self._viewer.state
        with self._lock:
            newest = self._newest_input
        limits = {each.id: default_limits(each, self._viewer.document) for each in state.objects}
        results = tuple(each.result for each in state.measurements)
        self.send(to_page.State(newest, state, limits, results, self._viewer.history))
        self._request()
        self._request_slices(state)

    def document_changed(self, fit=False):
        """Send the open sources; `fit` moves the camera to show all of them."""
        self.send(to_page.Document(tuple(source.about() for source in self._viewer.document)))
        if fit and self._size:
            self._viewer.submit(self._attempt, self._look_from, "home")

    def make_room(self, state, box):
        """Move the camera for a state that will be shown: home, or backwards if not all of a box is in the picture."""
        with self._lock:
            camera, size = self._camera, self._size
        if size is None:
            return
        if box is None:
            self._attempt(self._look_from, "home", state=state)
        elif camera is not None and not _shows(camera.camera(), size, box):
            view = tuple(np.subtract(camera.eye, camera.target))
            self._attempt(self._look_from, view, up=camera.up, state=state)

    def source_closed(self):
        """Forget a source that was closed: the picture is drawn again, without it."""
        self.document_changed()
        with self._lock:
            self._shown = None
        self._request()

    def set_camera(self, camera):
        """Change the camera, and tell the page."""
        with self._lock:
            self._camera = camera
        self._viewer.remember_camera(camera)
        self.send(to_page.CameraMoved(camera))
        self._request()

    def _request(self):
        with self._lock:
            if self._camera is None or self._size is None:
                return
            shown = (picture_part(self._viewer.state).replace(camera=self._camera), self._size)
            same, before = shown == self._shown, self._shown_input
            newest = self._newest_input
            self._shown, self._shown_input = shown, newest
            if not same:
                self._frames.request((*shown, newest))
            elif newest > before:
                self.send(to_page.SamePicture(before, newest))

    def _draw(self, shown, stage, progress):
        """Render a state; returns the message with its picture."""
        state, full, newest = shown
        size = self._resolution.size(full) if stage is None else full
        begin = time.perf_counter()
        image = self._maker.render(state, size, stage, progress, encoding="srgb8").to_srgb()
        drawn = time.perf_counter()
        content = encode_jpeg(image) if stage is None else encode_png(image)
        end = time.perf_counter()
        if stage is None:
            self._resolution.record(size, end - begin)
        with self._lock:  # it shows later changes as well if they did not change it
            newest = self._shown_input if (state, full) == self._shown else newest
        about = to_page.Frame(
            input=newest,
            size=size,
            camera=state.camera,
            format="jpeg" if stage is None else "png",
            samples=stage.samples if stage else 0,
            final=stage is not None and stage.final,
            objects=len(self._maker.scene.ids),
            scales=tuple(sorted(set(self._maker.scales.values()))),
            milliseconds=((drawn - begin) * 1e3, (end - drawn) * 1e3),
        )
        return packed(to_page.to_message(about), content)

    def _request_slices(self, state):
        slices = state.slices
        if slices.shown and slices.volume is not None:
            wanted = (slices.volume, slices.index, self._slice_views)
            if wanted != self._slices_shown:
                self._slices_shown = wanted
                self._slices.request(wanted)
        else:
            self._slices_shown = None

    def _draw_slices(self, wanted, share, progress):
        key, index, views = wanted
        source = self._viewer.document.get(key)
        if source is None:  # it was closed
            return None
        slices = sample_slices(source.grid, index, views, share or COARSE, progress=progress)
        regions = tuple((tuple(lower.tolist()), tuple(upper.tolist())) for lower, upper, _ in slices)
        about = to_page.SliceValues(key, index, regions, tuple(values.shape for _, _, values in slices))
        return packed(to_page.to_message(about), b"".join(values.tobytes() for _, _, values in slices))

    def _attempt(self, function, *arguments, **options):
        """Call a function, and tell the page of an error."""
        try:
            function(*arguments, **options)
        except Exception as error:
            self._failed(error)

    def _failed(self, error):
        """Tell the page of an error, without the temporary folders of uploads."""
        words = self._viewer.uploads.without_folders(str(error)).split()
        self.send(to_page.Error(" ".join(words) or type(error).__name__))

    # -- From the page ---------------------------------------------------------------------------------------------

    def receive(self, message):
        """Handle a message. The page is told of errors; text that is not JSON raises one."""
        number = None
        try:
            if isinstance(message, bytes):
                self._receiver.write(message)
                return
            message = json.loads(message, parse_float=_finite, parse_constant=_finite)
            if not isinstance(message, dict):
                raise ValueError(f"message: expected an object, got {type(message).__name__}")
            kind, number = message.pop("type", None), message.pop("input", None)
            if not isinstance(kind, str) or kind not in FROM_PAGE:
                raise ValueError(f"type: expected a type of message, got {kind!r}")
            if number is not None:
                with self._lock:
                    self._newest_input = whole(number, "input")
            getattr(self, f"_on_{kind}")(FROM_PAGE[kind].from_json(message, kind))
        except (json.JSONDecodeError, RecursionError):
            raise
        except (
            *(TypeError, ValueError, ArithmeticError),
            *(ImportError, OSError, RuntimeError, MemoryError),
        ) as error:
            self._failed(error)
            if number is not None:  # the page shows the change already
                self.state_changed()

    def _on_hello(self, message):
        self._set_size(message)
        maps = {name: tuple(map(colors.hex_of, colors.color_map(name)[::17])) for name in COLOR_MAPS}
        self.send(to_page.Options(self._viewer.run, maps, COLOR_RULES))
        if self._viewer.progress.title is not None:
            self.send(self._viewer.progress)
        state = self._viewer.state
        self.document_changed(fit=state.camera is None)
        self.state_changed()
        if state.camera is not None:
            self.set_camera(state.camera)

    def _on_size(self, message):
        self._set_size(message)
        self._request()

    def _set_size(self, message):
        with self._lock:
            self._size = (message.width, message.height)

    def _on_acknowledge(self, message):
        (self._slices if message.slices else self._frames).acknowledge()

    def _on_camera(self, message):
        with self._lock:
            self._camera = message.camera
        self._viewer.remember_camera(message.camera)
        self._request()

    def _on_look(self, message):
        self._viewer.submit(self._attempt, self._look_from, message.view)

    def _look_from(self, view, **options):
        with self._lock:
            now, size = self._camera, self._size
        angle = now.field_of_view if now else 30.0
        projection = now.projection if now else "perspective"
        self.set_camera(self._viewer.camera_towards(view, size, projection, angle, **options))

    def _on_change(self, message):
        changes = message.changes
        state = self._viewer.state.replace(**changes)
        if state.slices.volume is not None and not self._viewer.document[state.slices.volume].is_volume:
            raise ValueError(f"slices: expected a volume, got {state.slices.volume}")
        self._viewer.change(lambda state: state.replace(**changes))

    def _on_change_object(self, message):
        id, changes = message.id, message.changes
        rule = text(changes.get("color_by", "color"), "color_by")
        if rule not in COLOR_RULES and not self._viewer.document[rule].is_volume:
            raise ValueError(f"color_by: expected one of {', '.join(COLOR_RULES)} or a volume, got {rule!r}")
        if "level" in changes:
            self._check_level(self._viewer.document[self._viewer.state.object(id).source], changes["level"])
        self._viewer.change(lambda state: state.with_object(id, **changes))

    @staticmethod
    def _check_level(source, level):
        if (level is not None) != source.is_volume:
            raise ValueError(f"level: expected a number for an isosurface, none for a mesh, got {level}")
        if source.is_volume:
            source.check_level(number()(level, "level"))

    def _on_add_object(self, message):
        source = self._viewer.document[message.source]
        self._check_level(source, message.level)
        look = {} if source.is_volume else source.look
        self._viewer.change(lambda state: with_slices(state.with_new_object(source.key, message.level, **look), source))

    def _on_remove_object(self, message):
        self._viewer.change(lambda state: state.without_object(message.id))

    def _on_close(self, message):
        self._viewer.submit(self._attempt, self._close_source, message.source)

    def _close_source(self, key):
        if key in self._viewer.document:  # two windows may close it
            self._viewer.close_source(key)

    def _on_undo(self, _):
        self._viewer.undo()

    def _on_redo(self, _):
        self._viewer.redo()

    def _on_sample(self, message):
        source = self._viewer.document[message.volume]
        if not source.is_volume:
            raise ValueError(f"volume: expected a volume, got {source.key}")
        self._viewer.submit(self._attempt, self._sample, source, message.index)  # a store is read

    def _sample(self, source, index):
        self.send(to_page.Sampled(index, value_at(source.grid, index)))

    def _on_slice_views(self, message):
        self._slice_views = message.views
        self._request_slices(self._viewer.state)

    def _on_pick(self, message):
        self._viewer.submit(self._attempt, self._pick, (message.x, message.y), message.tool)

    def _pick(self, pixel, tool):
        state = self._viewer.state.replace(camera=self._camera)
        with self._viewer.making() as maker:
            camera, size = state.camera.camera(), self._size
            ids = maker.geometry_ids(state, lambda source: source.scale(camera, size))
            found = measure(maker.scene, ids, camera, size, pixel)
        if found is not None:
            if found.index is not None:  # of the picture's scale
                grid = self._viewer.document[state.object(found.object).source].grid
                found = found.replace(index=index_of(found.position, grid))
            self._measure(lambda all: with_point(all, tool, found))
        self.send(to_page.Measured(found))

    def _on_clear_measurements(self, _):
        self._measure(lambda _: ())

    def _on_remove_measurement(self, message):
        self._measure(lambda all: [each for each in all if each.id != message.id])

    def _measure(self, function):
        """Replace the measurements by ``function(measurements)``."""
        self._viewer.change(lambda state: state.replace(measurements=function(state.measurements)))

    def _on_save(self, message):
        self._viewer.submit(self._save, message.what, message.options)

    def _save(self, what, options):
        self._attempt(self._send_saved, what, options)
        self.send(to_page.Progress(None, 1.0))

    def _send_saved(self, what, options):
        if what == "measurements":
            names = {each.id: self._viewer.document[each.source].name for each in self._viewer.state.objects}
            self.send_file("measurements.csv", to_csv(self._viewer.state.measurements, names).encode())
            return
        state = self._viewer.state.replace(camera=self._camera)
        self.send_file(*save(self._viewer, what, state, self._size, options))

    def _on_restore(self, message):
        """Show the state of a page that was connected to another viewer, as far as the same files are open."""
        state, keys, left, kinds = message.state, {}, list(message.sources), {}
        for each in self._viewer.document:  # files of the same name are in order
            if (before := next((old for old in left if old.name == each.name), None)) is not None:
                keys[before.key] = each.key
                kinds[each.key] = each.name, not each.is_volume
                left.remove(before)
        shown = state.with_keys(keys).replace(camera=None)
        check_kinds(shown, kinds)
        self._viewer.change(lambda _: shown)
        if state.camera is not None:
            self.set_camera(state.camera)

    def _on_upload(self, message):
        self._receiver.begin(message.files)

    def _on_open_raw(self, message):
        self._receiver.answer(message.number, message.options and message.options.to_json())

    def end(self):
        """Close the window because the viewer ends."""
        self.close()
        self._ended()

    def close(self):
        """Stop drawing, and leave the viewer."""
        self._receiver.end()
        self._viewer.detach(self)
        self._frames.close()
        self._slices.close()


def _shows(camera, size, box):
    """Whether all corners of a box are in a camera's picture."""
    corners = np.array([[*corner, 1.0] for corner in itertools.product(*np.transpose(box))])
    x, y, _, depth = camera.world_to_ndc(size) @ corners.T
    return bool((depth > 0).all() and all(((each >= 0) & (each <= depth)).all() for each in (x, y)))


def _finite(text):
    """The number of a text in JSON, which may also be Infinity, NaN or too large."""
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"message: expected finite numbers, got {text}")
    return number
