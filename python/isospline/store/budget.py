"""The size of blocks, and the number of blocks processed at a time, that a memory limit allows."""

from __future__ import annotations

import math
import os
import re
from typing import Any

from ..base.parameters import check_count
from .layout import shard_edge
from .pyramid import reduction_memory

_POWERS = {"": 0, "k": 1, "m": 2, "g": 3, "t": 4}

#: Bytes for packages and threads that the work needs, and bytes of a worker process before it begins to work.
_OVERHEAD, _PROCESS = 64 * 2**20, 128 * 2**20


def parse_memory(limit: Any, parameter: str = "memory_limit") -> int:
    """Convert a number of bytes, or a text such as "2GB" or "512 MiB", to bytes."""
    if isinstance(limit, str):
        match = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*([kmgt]?)(i?)b?\s*", limit.lower())
        if match is None:
            raise ValueError(f'{parameter}: expected bytes, or a text such as "2GB" or "512MiB", got {limit!r}')
        return int(float(match[1]) * (1024 if match[3] else 1000) ** _POWERS[match[2]])
    check_count(limit, parameter, 2**62)
    return int(limit)


class Budget:
    """Edges of shards, and the number of blocks that are processed at a time.

    Parameters
    ----------
    limit : int
        Bytes of each process, including those that it already uses.
    threads : int
        Largest number of blocks at a time.
    source : Source
        The samples.
    model : Model
        The model to compute from them.
    chunk : int
        Coefficients along each edge of a chunk.
    shard_chunks : int
        Largest number of chunks along each edge of a shard.
    is_remote : bool
        Whether other processes compute the blocks; their memory is not known.
    """

    def __init__(
        self, limit: int, threads: int, source: Any, model: Any, chunk: int, shard_chunks: int, is_remote: bool
    ) -> None:
        self._limit, self._threads, self._source, self._model = limit, threads, source, model
        self._chunk, self._shard_chunks, self._reach = chunk, shard_chunks, model.reach
        import psutil  # only if it is needed: it is slow to import

        self._begin = _OVERHEAD + (_PROCESS if is_remote else psutil.Process().memory_info().rss)

    def shard(self) -> tuple[int, ...]:
        """The largest shard that the limit allows to process."""
        for chunks in range(self._shard_chunks, 0, -1):
            edges = tuple(shard_edge(size, self._chunk, chunks) for size in self._source.shape)
            if self._free() >= self.needed(edges):
                return edges
        raise ValueError(self._message(edges))

    def workers(self, shard: Any) -> int:
        """The number of shards that can be processed at a time."""
        count = self._free() // self.needed(shard)
        if count < 1:
            raise ValueError(self._message(shard))
        return max(min(count, self._threads), 1)

    def needed(self, shard: Any) -> int:
        """An upper bound on the bytes needed to make a shard."""
        grown = tuple(min(edge + 2 * self._reach, size) for edge, size in zip(shard, self._source.shape))
        samples, shards = math.prod(grown), 4 * math.prod(shard)
        reading = self._source.working_memory(grown) + samples * self._source.dtype.itemsize
        filtering = samples * (self._source.dtype.itemsize + 4)
        # Zarr copies the shard, encodes its chunks and joins them.
        writing = (4 + self._source.dtype.itemsize) * samples + 4 * shards
        return max(reading, filtering, writing, reduction_memory(shard, self._model.degree))

    def _free(self):
        return self._limit - self._begin

    def _message(self, shard):
        least = self._begin + self.needed(shard)
        return (
            f"memory_limit: expected at least {math.ceil(least / 1e6)}MB for blocks of "
            f"{' x '.join(map(str, shard[::-1]))} samples and {self._reach} around them, got {self._limit / 1e6:.0f}MB"
        )


def default_threads() -> int:
    """The number of processors that this process may use."""
    return len(os.sched_getaffinity(0))
