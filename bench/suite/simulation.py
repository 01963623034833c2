"""A model of many machines: measured costs of tasks, list scheduling, and a network with a store behind it."""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Network:
    """What is not measured but assumed; bytes a second, and seconds."""

    machine: float = 1.25e9  # of each machine: 10 Gbit/s
    store: float = 20e9  # of the file system, which all machines share
    latency: float = 1e-3  # of a message between two processes, with what Dask does to it


@dataclass(frozen=True)
class Work:
    """Tasks, in the order in which they are handed out."""

    seconds: np.ndarray  # of computation
    read: np.ndarray  # bytes from the store
    result: np.ndarray  # bytes to the client
    start_seconds: float = 0.0  # of each worker, before its first task
    start_read: float = 0.0  # bytes, for the same
    overhead: float = 0.0  # seconds of the scheduler for each task, one after the other


def makespan(work: Work, workers: int, network: Network) -> float:
    """Seconds until the client has all results: whichever worker is free first takes the next task (R. L. Graham,
    "Bounds on multiprocessing timing anomalies", SIAM Journal on Applied Mathematics 17(2), 1969)."""
    bandwidth = min(network.machine, network.store / workers)
    start = work.start_seconds + work.start_read / bandwidth
    free = [start] * workers
    handed_out = received = 0.0
    for seconds, read, result in zip(work.seconds, work.read, work.result):
        handed_out += work.overhead
        begin = max(heapq.heappop(free), handed_out + network.latency)
        end = begin + seconds + read / bandwidth
        heapq.heappush(free, end)
        received = max(received, end + network.latency) + result / network.machine
    return received


def efficiency(work: Work, workers: int, network: Network) -> float:
    """The part of so many workers' time that one worker would have needed."""
    return makespan(work, 1, network) / (workers * makespan(work, workers, network))


def enlarged(costs: np.ndarray, columns: int, times: int) -> np.ndarray:
    """Costs of tiles, row by row, of a picture with so many times as many tiles along each axis of the same view."""
    rows = costs.reshape(-1, columns)
    return rows.repeat(times, axis=0).repeat(times, axis=1).ravel()
