"""The Dask clusters that render pictures."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator
from typing import Any

from ..base.parameters import check_count, check_type
from ..store.budget import default_threads

#: Fraction of a worker's memory at which Dask ends it and starts its tasks again. Dask's other limits make it wait.
_TERMINATE = 0.95


def dask_distributed() -> Any:
    """The package dask.distributed."""
    try:
        import dask.distributed
    except ImportError as error:
        raise ModuleNotFoundError(
            f"isospline.distributed needs the package {error.name}: pip install isospline[distributed]", name=error.name
        ) from error
    return dask.distributed


@contextlib.contextmanager
def connected(client: Any, workers: int | None, memory_limit: int | None) -> Iterator[tuple[Any, int | None]]:
    """A client, and the number of threads of each worker; None leaves the choice to the worker.

    Without a client, a cluster of `workers` processes is started on this machine, and stopped at the end.
    """
    distributed = dask_distributed()
    if client is not None:
        check_type(client, "client", distributed.Client, "a dask.distributed.Client")
        if client.asynchronous:
            raise ValueError("client: expected a synchronous client, got an asynchronous one")
        if workers is not None:
            raise ValueError("workers: cannot be combined with a client, which has its own")
        yield client, None
        return
    if workers is not None:
        check_count(workers, "workers", 4096)
    processors = default_threads()
    count = int(workers or processors)
    with local_cluster(count, memory_limit) as cluster, distributed.Client(cluster) as own:
        yield own, max(processors // count, 1)


@contextlib.contextmanager
def local_cluster(workers: int, memory_limit: int | None) -> Iterator[Any]:
    """A cluster of processes of this machine, each with a memory limit."""
    import dask

    distributed = dask_distributed()
    memory: dict[str, Any] = {f"distributed.worker.memory.{name}": False for name in ("target", "spill", "pause")}
    memory["distributed.worker.memory.terminate"] = _TERMINATE
    with dask.config.set(memory):
        cluster = distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            memory_limit=0 if memory_limit is None else int(memory_limit / _TERMINATE),
            dashboard_address="127.0.0.1:0",
        )
        with cluster:
            yield cluster


def submit(client: Any, function: Any, *arguments: Any, **options: Any) -> Any:
    """Submit a task. Its arguments stay with the scheduler, so that they survive the end of a worker."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Sending large graph")
        return client.submit(function, *arguments, pure=False, **options)


def worker_count(client: Any) -> int:
    """The current number of workers, at least 1."""
    return max(len(client.nthreads()), 1)
