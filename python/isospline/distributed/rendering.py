"""Rendering on a Dask cluster."""

from __future__ import annotations

import collections
import contextlib
import os
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Literal

from ..base.parameters import check_type
from ..base.progress import as_callable
from ..base.signatures import explained
from ..picture.image import Image
from ..scene import Isosurface, Mesh, Scene
from ..store.budget import parse_memory
from .cluster import connected, dask_distributed
from .picture import PictureInTheMaking

if TYPE_CHECKING:
    from ..base.types import Progress
    from ..cameras.camera import _Camera

#: Pictures of a batch that are rendered at a time, so that workers stay busy while one is put together.
_AHEAD = 3


@explained
def render(
    scene: Scene | Isosurface | Mesh | str | os.PathLike[str],
    camera: _Camera | None = None,
    *,
    level: float | None = None,
    client: Any = None,
    workers: int | None = None,
    tile_size: tuple[int, int] = (128, 128),
    by: Literal["tiles", "parts"] = "tiles",
    parts: int | None = None,
    memory_limit: int | str | None = None,
    progress: Progress = None,
    **options: Any,
) -> Image:
    """Render a picture on many processes or machines.

    The picture is the same as that of `isospline.render`, bit for bit, for any number of workers and any order of their
    work. If a worker crashes or runs out of memory, other workers repeat its tasks.

    Parameters
    ----------
    scene : Scene, Isosurface, Mesh, str or path-like
        The scene, or the folder of a store, which every worker opens at the same path. Volumes of stores in a scene are
        sent as paths too; other volumes are sent whole.
    camera : PerspectiveCamera, ProjectionPlaneCamera, OrthographicCamera or PanoramicCamera, optional
        The camera; by default as in `isospline.render`.
    level : float, optional
        Level of the isosurface; needed if `scene` is the folder of a store.
    client : dask.distributed.Client, optional
        The cluster to use; each worker needs this version of isospline. By default, a cluster of processes is started
        on this machine, and stopped at the end.
    workers : int, optional
        Number of processes of that cluster; by default one for each processor.
    tile_size : (int, int)
        Width and height, in pixels, of the tiles that workers render.
    by : {"tiles", "parts"}
        How the work is divided. "tiles": workers render tiles of the picture, and read from stores only the data that
        these need. "parts": workers render parts of the volumes, which must be in stores, and the nearest hits of all
        parts are merged. This is for opaque surfaces without shadows and ambient occlusion: ``Phong()``, which is the
        default then, and `Outline`.
    parts : int, optional
        Number of the parts; by default two for each worker.
    memory_limit : int or str, bytes, optional
        Limit of each worker process. If `scene` is the folder of a store, it is 4 GB by default, and chunks and bricks
        may use the part of it that the process does not need. Volumes in a `Scene` have their own limit. In a cluster
        that is started here, a worker that would exceed the given limit is ended and starts again.
    progress : callable or True, optional
        As in `isospline.render`.
    **options
        Further options of `isospline.render`: size, crop, light, background, samples, layers and so on.

    Returns
    -------
    Image

    Raises
    ------
    ModuleNotFoundError
        Without the packages of ``pip install isospline[distributed]``.
    ValueError
        As in `isospline.render`, and for a scene that cannot be rendered by parts.
    TypeError
        For the folder of a store without a level.
    distributed.KilledWorker
        If a task has ended several workers.

    Notes
    -----
    A script that starts a cluster of processes needs ``if __name__ == "__main__":`` around its code, because each
    process imports the script.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.torus()
    >>> surface = isospline.Isosurface(field.volume(32), field.level)
    >>> isospline.distributed.render(surface, size=(64, 48), workers=2)  # doctest: +SKIP
    Image(64 x 48, 30% covered)
    """
    given = dict(camera=camera, level=level, tile_size=tile_size, by=by, parts=parts, **options)
    report = as_callable(progress)
    limit = None if memory_limit is None else parse_memory(memory_limit)
    with (
        connected(client, workers, limit) as (cluster, threads),
        contextlib.closing(PictureInTheMaking(cluster, scene, limit, threads, 0, given)) as picture,
    ):
        return picture.image(report)


@explained
def render_batch(
    scene: Scene | Isosurface | Mesh | str | os.PathLike[str],
    pictures: Iterable[Mapping[str, Any]],
    *,
    client: Any = None,
    workers: int | None = None,
    memory_limit: int | str | None = None,
    **options: Any,
) -> Iterator[Image]:
    """Render many pictures on many processes or machines, with different cameras, levels or time steps.

    Parameters
    ----------
    scene, client, workers, memory_limit
        As in `render`.
    pictures : iterable of dict
        The options of each picture: ``{"camera": ...}``, ``{"level": ...}``, ``{"scene": ...}`` with another time step,
        or any other option. A few are read at a time.
    **options
        The options of all pictures, as in `render`; `progress` is told of each picture on its own.

    Yields
    ------
    Image
        The pictures, in the order of `pictures`.

    Examples
    --------
    >>> import isospline
    >>> levels = [{"level": level} for level in (200, 300, 400)]
    >>> for image in isospline.distributed.render_batch("head.zarr", levels, workers=2):  # doctest: +SKIP
    ...     print(image)
    """
    check_type(pictures, "pictures", Iterable, "a sequence of dictionaries")
    limit = None if memory_limit is None else parse_memory(memory_limit)
    dask_distributed()
    return _batch(scene, pictures, client, workers, limit, options)


def _batch(scene, pictures, client, workers, limit, options):
    with connected(client, workers, limit) as (cluster, threads), contextlib.ExitStack() as stack:
        waiting: collections.deque[Any] = collections.deque()
        stack.callback(lambda: [picture.close() for picture, _ in waiting])
        for number, own in enumerate(pictures):
            check_type(own, "pictures", Mapping, "dictionaries")
            given = {**options, **own}
            shown, progress = given.pop("scene", scene), given.pop("progress", None)
            waiting.append((PictureInTheMaking(cluster, shown, limit, threads, number, given), progress))
            if len(waiting) == _AHEAD:
                yield _finished(waiting)
        while waiting:
            yield _finished(waiting)


def _finished(waiting):
    picture, progress = waiting[0]
    image = picture.image(as_callable(progress))
    waiting.popleft()
    picture.close()
    return image
