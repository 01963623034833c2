"""Runs tasks for many blocks, in sequence or in parallel: with Dask, on local threads or on a cluster's workers."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any


def run(
    function: Callable[[Any], Any],
    items: Iterable[Any],
    *,
    workers: int,
    client: Any = None,
    done: Callable[[Any], None],
) -> None:
    """Call `function` for each item; `done` gets each result, in the calling thread.

    The first error is raised when all running calls have ended. At most `workers` calls run at a time in this process.
    """
    items = list(items)
    if client is not None:
        _run_on_cluster(function, items, client, done)
    elif workers == 1 or len(items) < 2 or not _has_dask():
        for item in items:
            done(function(item))
    else:
        _run_on_threads(function, items, workers, done)


def _has_dask():
    try:
        import dask  # noqa: F401
    except ImportError:
        return False
    return True


def _run_on_threads(function, items, workers, done):
    from dask.base import compute
    from dask.callbacks import Callback
    from dask.delayed import delayed

    def finished(key, result, *_):
        done(result)

    tasks = [delayed(function, pure=False)(item) for item in items]
    with Callback(posttask=finished):
        compute(*tasks, scheduler="threads", num_workers=workers, optimize_graph=False)


def _run_on_cluster(function, items, client, done):
    from dask.distributed import as_completed

    futures = client.map(function, items, pure=False)
    try:
        for future in as_completed(futures):
            done(future.result())
    finally:
        client.cancel([future for future in futures if not future.done()])
