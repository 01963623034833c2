"""The tasks that run on workers."""

from __future__ import annotations

import pickle
from typing import Any

from .. import _core
from ..picture.files import surface_of
from ..picture.image import Image
from ..picture.rendering import render
from ..scene import Scene
from ..store.volume import open_volume
from . import fragments
from .fragments import PartOfPicture
from .parts import Description, PartOfScene

#: Bytes of a worker's process without volumes and pictures, and the default limit of the whole process.
PROCESS, DEFAULT_LIMIT = 320 * 10**6, 4 * 10**9


def load(pickled: bytes) -> Any:
    """The data that all tasks of a picture share, once for each worker."""
    return pickle.loads(pickled)


def open_scene(path: str, level: float, memory_limit: int | None, scale: int = 0) -> Scene:
    """The scene of one isosurface of a scale of a store."""
    limit = memory_limit or DEFAULT_LIMIT
    volume = open_volume(path, memory_limit=max(limit - PROCESS, limit // 4), scale=scale)
    return Scene([surface_of(volume, level)])


def open_store(store: tuple[str, float, int | None, int], pickled: bytes) -> tuple[Scene, Any]:
    """The scene of a store, and the other options of its picture."""
    return open_scene(*store), pickle.loads(pickled)


def load_part(description: Description, part: Any) -> PartOfScene:
    """Make a part of a scene on a worker."""
    return PartOfScene(description, part)


def render_window(picture: tuple[Scene, dict[str, Any]], camera: Any, window: Any, threads: int | None) -> Image:
    """Render a window of a picture; the picture is a scene and options of `render`."""
    _use(threads)
    scene, options = picture
    return render(scene, camera, crop=window, **options)


def render_part(
    part: PartOfScene, camera: Any, window: Any, options: dict[str, Any], threads: int | None
) -> PartOfPicture:
    """Render a window of a picture from a part of its scene; options are those of `_core.render_part`."""
    _use(threads)
    return fragments.render_part(part.scene, camera, options | {"crop": window})


def compose(parts: list[PartOfPicture], camera: Any, window: Any, options: dict[str, Any]) -> Image:
    """The window, from all parts of the scene."""
    return fragments.compose(parts, camera, options | {"crop": window})


def _use(threads):
    if threads is not None and _core.thread_count() != threads:
        _core.set_thread_count(threads)
