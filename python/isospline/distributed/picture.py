"""A picture that workers render: submits its tasks, and puts the results together."""

from __future__ import annotations

import functools
import inspect
import numbers
import os
import pickle
from typing import Any

from .. import _core
from ..base.parameters import check_count, check_path, check_type
from ..base.progress import tell
from ..base.views import SIZE
from ..picture.cameras import check_camera
from ..picture.defaults import background_of, marks_of, samples_of
from ..picture.image import Image
from ..picture.layers import compiled, names_of
from ..picture.lights import resolve
from ..picture.marks import Marks
from ..picture.rendering import lit
from ..picture.rendering import render as render_here
from ..picture.scenes import as_scene
from ..picture.studio import Studio
from ..store.detail import Scales
from . import parts as scene_parts
from . import tasks
from .cluster import dask_distributed, submit, worker_count
from .windows import Canvas, checked_window, split

#: Parts of a scene per worker. With several, a worker whose part is hardly visible takes another one.
_PARTS_A_WORKER = 2

#: The options of `render` that rendering by parts supports, with their defaults.
_OF_PARTS = {
    "size": SIZE,
    "light": None,
    "background": None,
    "samples": 1,
    "layers": (),
    "ambient_occlusion_samples": 16,
    "encoding": "linear",
}


class PictureInTheMaking:
    """A picture whose tasks are submitted when this object is made, and cancelled when it is closed.

    Parameters
    ----------
    client : dask.distributed.Client
        The cluster.
    scene
        As in `isospline.distributed.render`.
    memory_limit : int or None
        Bytes of a worker.
    threads : int or None
        Of a worker.
    number : int
        Number of the picture; pictures with smaller numbers are rendered first.
    options : dict
        The options of `isospline.distributed.render` for the picture.
    """

    def __init__(
        self,
        client: Any,
        scene: Any,
        memory_limit: int | None,
        threads: int | None,
        number: int,
        options: dict[str, Any],
    ) -> None:
        self._client, self._threads, self._priority = client, threads, -number
        tile_size = options.pop("tile_size", (128, 128))
        self._by = by = options.pop("by", "tiles")
        parts = options.pop("parts", None)
        if by not in ("tiles", "parts"):
            raise ValueError(f"by: expected 'tiles' or 'parts', got {by!r}")
        if parts is not None and by != "parts":
            raise ValueError("parts: cannot be combined with by='tiles'; did you mean by='parts'?")
        if parts is not None:
            check_count(parts, "parts", 1 << 20)
        self._scene = _GivenScene(scene, options.pop("level", None), memory_limit)
        self._prepare(options)
        windows = split(self._window, tile_size)
        if by == "tiles":
            self._futures = self._submit_tiles(windows)
        else:
            self._futures = self._submit_parts(windows, int(parts or _PARTS_A_WORKER * worker_count(client)))

    def image(self, progress: Any) -> Image:
        """Wait for the picture. `progress` is as in `as_callable`."""
        canvas = Canvas(self._window)
        tell(progress, 0.0)
        for done, future in enumerate(dask_distributed().as_completed(self._futures)):
            canvas.paste(future.result())
            tell(progress, (done + 1) / len(self._futures))
        image = Image(canvas.image()._arrays, self._layers)
        return self._marks.draw(image, self._camera, is_fitted=self._is_fitted)

    def close(self) -> None:
        """Cancel unfinished tasks."""
        self._client.cancel([future for future in self._futures if not future.done()])
        self._futures = []

    def _prepare(self, options):
        """Check the options of `render`, and remove those that concern the whole picture."""
        try:
            inspect.signature(render_here).bind(None, **options)
        except TypeError as error:
            raise TypeError(f"isospline.distributed.render: {error}") from None
        changes = options.pop("color", None), options.pop("opacity", None)
        light, environment = options.get("light"), options.pop("environment", None)
        is_default = light is None and environment is None
        if is_default and self._by == "parts":
            light, is_default = "phong", False
        size = options.get("size", SIZE)
        self._camera = options.pop("camera", None)
        if self._camera is not None:
            check_camera(self._camera)
        light = lit(self._scene.here, self._camera, size, light, environment)
        look = options["light"] = resolve(self._scene.here, light, *changes)
        options["samples"] = samples_of(options.get("samples"), look)
        options["background"] = background_of(options.get("background"), look)
        crop = options.pop("crop", None)
        self._window = checked_window(crop, size)
        unit, legend = options.pop("unit", None), options.pop("legend", False)
        annotate, is_crop = options.pop("annotate", None), crop is not None
        given = self._scene.here, self._camera, look, unit
        names = marks_of(annotate, *given, is_default=is_default, is_crop=is_crop)
        if (names or legend) and crop is not None:
            raise ValueError(f"{'annotate' if names else 'legend'}: cannot be combined with a crop")
        self._marks = Marks(self._scene.here, look, size, names, legend, unit)
        self._is_fitted = self._camera is None
        if self._camera is None:
            self._camera = self._marks.camera(size=size)
        self._scene.choose_scale(self._camera, size)
        shown = self._scene.in_detail
        if shown is not self._scene.here:  # rules and their bars measure what is shown
            look = options["light"] = resolve(shown, light, *changes)
            self._marks = Marks(shown, look, size, names, legend, unit)
        self._layers = names_of(options.get("layers", ()))
        self._options = options | {"layers": compiled(self._layers)}

    def _submit(self, function, *arguments):
        return submit(self._client, function, *arguments, priority=self._priority)

    def _submit_tiles(self, windows):
        picture = self._scene.on_worker(self._submit, self._options)
        return [self._submit(tasks.render_window, picture, self._camera, window, self._threads) for window in windows]

    def _submit_parts(self, windows, count):
        more = {name: value for name, value in self._options.items() if name not in _OF_PARTS and value is not None}
        if more:
            raise ValueError(f"{min(more)}: expected by='tiles' for this option, got by='parts'")
        options = _OF_PARTS | self._options
        options = {name: options[name] for name in _OF_PARTS}
        options["shading"] = options.pop("light")
        if isinstance(options["shading"], (Studio, _core.PathTracer)):
            kind = type(options["shading"]).__name__
            raise ValueError(f"light: a {kind} cannot be combined with by='parts'; did you mean by='tiles'?")
        options = self._submit(tasks.load, pickle.dumps(options, protocol=5))
        scene = self._scene.in_detail
        description = scene_parts.describe(scene)
        pictures: dict[Any, list[Any]] = {window: [] for window in windows}
        for part in scene_parts.split(scene_parts.largest_shape(scene), count):
            on_worker = self._submit(tasks.load_part, description, part)
            for window in windows:
                of_part = self._submit(tasks.render_part, on_worker, self._camera, window, options, self._threads)
                pictures[window].append(of_part)
        return [self._submit(tasks.compose, pictures[window], self._camera, window, options) for window in windows]


class _GivenScene:
    """The given scene, or the given store; in this process and on workers."""

    def __init__(self, scene, level, memory_limit):
        self._here: Any = None
        self._store: Any = None
        self._scale = 0
        if not isinstance(scene, (str, os.PathLike)):
            self._here = as_scene(scene, level)
            return
        check_path(scene)
        check_type(level, "level", numbers.Real, "a number for the folder of a store")
        self._store = os.path.abspath(scene), float(level), memory_limit
        self._scales = Scales(self._store[0])

    @property
    def here(self):
        """The scene, for this process: of a store the overview."""
        if self._here is None:
            self._here = self._at_scale(self._scales.overview)
        return self._here

    @functools.cached_property
    def in_detail(self):
        """The scene that is rendered, for this process: of a store the chosen scale."""
        is_here = self._store is None or self._scale == self._scales.overview
        return self.here if is_here else self._at_scale(self._scale)

    def _at_scale(self, scale):
        path, level, memory_limit = self._store
        return tasks.open_scene(path, level, memory_limit, scale)

    def choose_scale(self, camera, size):
        """Choose the scale of a store that a picture needs."""
        if self._store is not None:
            self._scale = self._scales.choose([camera], size)

    def on_worker(self, submit, options):
        """The scene and the other options of the picture, as one future: volumes that both use are sent once."""
        if self._store is not None:
            return submit(tasks.open_store, (*self._store, self._scale), pickle.dumps(options, protocol=5))
        return submit(tasks.load, pickle.dumps((self._here, options), protocol=5))
