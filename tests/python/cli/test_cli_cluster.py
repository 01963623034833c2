"""The command line on an existing cluster: `dask scheduler` and two `dask worker` processes."""

import contextlib
import gc
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import isospline
import isospline.cli.main
from isospline.base.progress import Lines
from isospline.cli.main import main

distributed = pytest.importorskip("distributed")
zarr = pytest.importorskip("zarr")
OpenEXR = pytest.importorskip("OpenEXR")

#: Seconds that starting processes may take on a machine that is busy.
PATIENCE = 120


@contextlib.contextmanager
def started(*arguments, **options):
    """A process that ends with the test."""
    process = subprocess.Popen([sys.executable, "-m", *arguments], **options)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """The address of a scheduler, and its workers by their process ids. A test kills one of them."""
    folder = tmp_path_factory.mktemp("cluster")
    quiet = dict(cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    file = folder / "scheduler.json"
    with contextlib.ExitStack() as stack:
        listening = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
        stack.enter_context(started("dask", "scheduler", *listening, "--scheduler-file", str(file), **quiet))
        of_one_thread = ["--nthreads", "1", "--no-dashboard", "--no-nanny", "--memory-limit", "1GB"]
        workers = [
            stack.enter_context(started("dask", "worker", *of_one_thread, "--scheduler-file", str(file), **quiet))
            for _ in range(2)
        ]
        deadline = time.time() + PATIENCE
        while not file.exists() and time.time() < deadline:
            time.sleep(0.1)
        with distributed.Client(scheduler_file=str(file), timeout=PATIENCE) as client:
            client.wait_for_workers(2, timeout=PATIENCE)
            address = client.scheduler.address
        yield address, {worker.pid: worker for worker in workers}


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    field = isospline.volumes.gyroid()
    out = tmp_path_factory.mktemp("stores") / "gyroid.zarr"
    return isospline.convert(field.values(64), out, chunk=16, **field.grid(64))


@pytest.fixture
def kill_at(monkeypatch):
    """A function that arranges for a worker to be killed when a fraction of the command's work is done."""

    def arrange(fraction, workers):
        remaining = len(workers) - 1

        class KillingLines(Lines):
            def __call__(self, done):
                super().__call__(done)
                if done > fraction and len(workers) > remaining:
                    os.kill(workers.popitem()[0], signal.SIGKILL)

        monkeypatch.setattr(isospline.cli.main, "Lines", KillingLines)

    return arrange


def pixels_of(path):
    with OpenEXR.File(str(path)) as file:
        return file.channels()["RGBA"].pixels


@pytest.mark.slow
def test_pictures_come_from_a_scheduler(cluster, store, tmp_path):
    given = ["render", str(store), "--level", "0.1", "--size", "256x192", "--exact", "--fast"]
    assert main([*given, "--quiet", "-o", str(tmp_path / "one.exr")]) == 0
    assert main([*given, "-o", str(tmp_path / "whole.exr"), "--scheduler", cluster[0]]) == 0
    assert np.array_equal(pixels_of(tmp_path / "one.exr"), pixels_of(tmp_path / "whole.exr"))


@pytest.mark.slow
def test_a_scheduler_s_workers_convert(cluster, tmp_path, kill_at):
    np.save(tmp_path / "a.npy", np.random.default_rng(0).normal(size=(100, 90, 80)).astype(np.float32))
    given = ["convert", str(tmp_path / "a.npy"), "--chunk", "16"]
    assert main([*given, str(tmp_path / "one.zarr"), "--quiet"]) == 0
    address, workers = cluster
    count = len(workers)
    kill_at(0.3, workers)
    assert main([*given, str(tmp_path / "many.zarr"), "--scheduler", address]) == 0
    assert len(workers) == count - 1 > 0
    for level in isospline.store.read_metadata(tmp_path / "one.zarr").scales:
        for key in (level.path, level.ranges):
            one, many = (zarr.open_array(tmp_path / name, path=key)[:] for name in ("one.zarr", "many.zarr"))
            assert np.array_equal(one, many)


@pytest.mark.parametrize("command", ["render", "convert"])
def test_a_scheduler_that_does_not_answer_is_named(store, tmp_path, capsys, command):
    out = ["-o", str(tmp_path / "a.png")] if command == "render" else [str(tmp_path / "b.zarr")]
    np.save(tmp_path / "a.npy", np.arange(8.0).reshape(2, 2, 2))
    source = str(store if command == "render" else tmp_path / "a.npy")
    assert main([command, source, *out, "--quiet", "--scheduler", "nonsense"]) == 2
    assert "--scheduler: expected the address of a Dask scheduler, got nonsense" in capsys.readouterr().err
    assert {client.status for client in gc.get_objects() if type(client) is distributed.Client} <= {"closed"}
    assert not (tmp_path / "a.png").exists() and not (tmp_path / "b.zarr").exists()
