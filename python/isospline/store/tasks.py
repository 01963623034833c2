"""Runs tasks for many blocks, in sequence or in parallel: on local threads, or with Dask on a cluster's workers."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
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
    elif workers == 1 or len(items) < 2:
        for item in items:
            done(function(item))
    else:
        _run_on_threads(function, items, workers, done)


def _run_on_threads(function, items, workers, done):
    with ThreadPoolExecutor(workers) as pool:
        try:
            for future in as_completed([pool.submit(function, item) for item in items]):
                done(future.result())
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def _run_on_cluster(function, items, client, done):
    from dask import distributed

    futures = client.map(function, items, pure=False)
    try:
        for future in distributed.as_completed(futures):
            done(future.result())
    finally:
        client.cancel([future for future in futures if not future.done()])
