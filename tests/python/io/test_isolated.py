"""Readers in a process of their own: what they do to it does not reach the caller, and nothing is left behind."""

import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import threading
import time

import numpy as np
import psutil
import pytest

from isospline.io import isolated, landlock

READERS = """
import ctypes, os, subprocess, sys, time
import numpy as np

def arrays(path, count):
    rng = np.random.default_rng(count)
    kinds = ("u1", ">i2", "<f8", "?")
    return {"many": [rng.integers(0, 2, (count, 2)).astype(kind) for kind in kinds], "path": path, "none": None}

def big(path): return np.full((256, 512, 512), 7, np.uint8)
def segfault(path): ctypes.string_at(0)
def abort(path): os.abort()
def exit(path): os._exit(0)
def spin(path):
    while True: pass
def sleep(path): time.sleep(1000)
def allocate(path): return len(np.ones(1 << 50, np.uint8))
def fill(path): return b"".join(bytes(1 << 26) for _ in range(1 << 20))
def missing(path): open(path + "/none")
def fail(path, kind): raise {"value": ValueError, "key": KeyError, "memory": MemoryError}[kind]("some reason")
def no_module(path): import not_a_package
def objects(path): return np.array([object()])
def pid(path): return os.getpid()
def child(path): return subprocess.Popen([sys.executable, "-c", "import time; time.sleep(1000)"]).pid
def environment(path): return dict(os.environ)
def read(path, file): return open(file).read()
def listed(path, file): return os.listdir(file)
def written(path, file): open(file, "w").close()
def removed(path, file): os.remove(file)
def connected(path, port):
    import socket
    socket.create_connection(("127.0.0.1", port)).close()
def lazily(path):
    import sqlite3, xml.dom.minidom, zoneinfo
    return str(zoneinfo.ZoneInfo("UTC")) + sqlite3.connect(":memory:").execute("select 'a'").fetchone()[0]
def count(path, output, blocks, then=None):
    for number in range(blocks):
        output.write(bytes([number]) * 1000)
    output.flush()
    then and globals()[then](path)
def broken(path): raise ValueError("some reason")
def noise(path): print("noise"); sys.stderr.write("noise"); return 1
"""


@pytest.fixture
def call(tmp_path, monkeypatch):
    """Calls a function of READERS with a path."""
    (tmp_path / "some_readers.py").write_text(READERS, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    isolated._SERVERS.stop()
    yield lambda name, **arguments: isolated.call(f"some_readers:{name}", tmp_path, **arguments)
    isolated._SERVERS.stop()


def wait_for(condition, seconds=120):  # for a busy machine
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def descendants():
    return psutil.Process().children(recursive=True)


@pytest.fixture
def elsewhere(tmp_path_factory):
    path = tmp_path_factory.mktemp("elsewhere") / "secret"
    path.write_text("secret", encoding="utf-8")
    return path


needs_landlock = pytest.mark.skipif(landlock.version() == 0, reason="the kernel has no Landlock")


@needs_landlock
def test_readers_read_only_the_folder_of_the_file(call, tmp_path, elsewhere):
    (tmp_path / "own").write_text("own", encoding="utf-8")
    assert call("read", file=str(tmp_path / "own")) == "own"
    home = os.path.expanduser("~")
    for function, name in (
        ("read", elsewhere),
        ("listed", elsewhere.parent),
        ("listed", home),
        ("listed", "/"),
        ("listed", "/tmp"),
    ):
        with pytest.raises(PermissionError):
            call(function, file=str(name))


@needs_landlock
def test_readers_follow_links_of_a_folder_when_they_are_asked_for_it(call, tmp_path, elsewhere):
    (tmp_path / "link").symlink_to(elsewhere)
    assert call("read", file=str(tmp_path / "link")) == "secret"
    with pytest.raises(PermissionError):
        call("read", file=str(tmp_path / "link"), readable=[str(tmp_path)])


@needs_landlock
def test_readers_write_nothing(call, tmp_path, elsewhere):
    own = tmp_path / "own"
    own.write_text("own", encoding="utf-8")
    for readable in ([str(tmp_path)], ["/"]):
        for function, name in (
            ("written", own),
            ("removed", own),
            ("written", tmp_path / "new"),
            ("removed", elsewhere),
        ):
            with pytest.raises(PermissionError):
                call(function, file=str(name), readable=readable)
    assert own.read_text(encoding="utf-8") == "own"
    assert not (tmp_path / "new").exists()


@pytest.mark.skipif(landlock.version() < 4, reason="the kernel's Landlock has no rules for connections")
def test_readers_open_no_connection(call):
    with socket.create_server(("127.0.0.1", 0)) as server, pytest.raises(PermissionError):
        call("connected", port=server.getsockname()[1])


def test_readers_import_what_they_need(call):
    assert call("lazily") == "UTCa"


def test_arrays_and_other_values_come_back(call, tmp_path):
    for count in (0, 1, 5, 1000):
        value = call("arrays", count=count)
        rng = np.random.default_rng(count)
        for array, kind in zip(value["many"], ("u1", ">i2", "<f8", "?")):
            expected = rng.integers(0, 2, (count, 2)).astype(kind)
            np.testing.assert_array_equal(array, expected)
            assert array.dtype == expected.dtype
            if count:
                array[0] = 1  # arrays can be changed
        assert (value["path"], value["none"]) == (str(tmp_path), None)


def test_large_arrays_are_mapped_and_not_copied(call):
    process = psutil.Process()
    before = process.memory_info()
    array = call("big")
    after = process.memory_info()
    assert (after.rss - after.shared) - (before.rss - before.shared) < array.nbytes / 4
    assert array.min() == array.max() == 7


@pytest.mark.parametrize(
    "name, kind, message",
    [
        ("segfault", ValueError, r"the reader crashed \(SIGSEGV\): the file is damaged"),
        ("abort", ValueError, r"the reader crashed \(SIGABRT\): the file is damaged"),
        ("exit", ValueError, r"the reader crashed \(no result\): the file is damaged"),
        ("allocate", MemoryError, "Unable to allocate"),
        ("fill", MemoryError, "MemoryError"),
        ("objects", ValueError, "OBJECT array"),
    ],
)
def test_a_crash_and_a_lack_of_memory_are_exceptions(call, monkeypatch, name, kind, message):
    monkeypatch.setattr(isolated, "available_memory", lambda: 1 << 28)
    with pytest.raises(kind, match=message):
        call(name)
    assert call("pid") not in (os.getpid(), isolated._SERVERS._process.pid)


def read_stream(path, size, **arguments):
    content = bytearray(size)
    with isolated.stream("some_readers:count", path, **arguments) as stream:
        done = 0
        while done < size and (got := stream.readinto(memoryview(content)[done:])):
            done += got
    return bytes(content[:done])


def test_bytes_come_as_a_stream(call, tmp_path):
    expected = b"".join(bytes([number]) * 1000 for number in range(200))
    assert read_stream(tmp_path, 200_000, blocks=200) == expected
    assert read_stream(tmp_path, 300_000, blocks=200) == expected
    assert read_stream(tmp_path, 300_000, blocks=0) == b""


@pytest.mark.parametrize(
    "then, message", [("broken", "some reason"), ("segfault", r"the reader crashed \(SIGSEGV\): the file is damaged")]
)
def test_a_stream_ends_with_the_exception_of_the_reader(call, tmp_path, then, message):
    for size in (5000, 9000):  # it is not lost if all bytes were read before
        with pytest.raises(ValueError, match=message):
            read_stream(tmp_path, size, blocks=5, then=then)


@pytest.mark.slow
@pytest.mark.parametrize("then", ["spin", "sleep"])
def test_a_stream_has_limited_time(call, tmp_path, monkeypatch, then):
    monkeypatch.setattr(isolated, "SECONDS", 1.0)
    monkeypatch.setattr(isolated, "CLOCK", 2.0)
    for size in (5000, 9000):
        with pytest.raises(ValueError, match="the reader found no end in 1 s: the file is damaged"):
            read_stream(tmp_path, size, blocks=5, then=then)


def test_a_stream_that_is_left_early_ends_its_process(call, tmp_path):
    call("pid")
    others = set(descendants())
    with pytest.raises(KeyError), isolated.stream("some_readers:count", tmp_path, blocks=250, then="sleep") as stream:
        stream.readinto(memoryview(bytearray(10)))
        raise KeyError
    wait_for(lambda: set(descendants()) <= others)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["spin", "sleep"])
def test_a_reader_has_limited_time(call, monkeypatch, name):
    monkeypatch.setattr(isolated, "SECONDS", 1.0)
    monkeypatch.setattr(isolated, "CLOCK", 3.0)
    with pytest.raises(ValueError, match="the reader found no end in 1 s: the file is damaged"):
        call(name)


def test_exceptions_keep_their_kind(call, tmp_path):
    with pytest.raises(ValueError, match="some reason"):
        call("fail", kind="value")
    with pytest.raises(ValueError, match="some reason"):
        call("fail", kind="key")
    with pytest.raises(MemoryError, match="some reason"):
        call("fail", kind="memory")
    with pytest.raises(ModuleNotFoundError) as caught:
        call("no_module")
    assert caught.value.name == "not_a_package"
    with pytest.raises(OSError) as caught:
        call("missing")
    assert caught.value.filename == f"{tmp_path}/none"


def test_a_reader_does_not_get_the_viewers_token(call, monkeypatch):
    monkeypatch.setenv("ISOSPLINE_TOKEN", "secret-of-the-viewer")
    monkeypatch.setenv("SOME_VARIABLE", "kept")
    variables = call("environment")
    assert variables["SOME_VARIABLE"] == "kept" and variables["OMP_NUM_THREADS"] == "1"
    assert "ISOSPLINE_TOKEN" not in variables and "secret-of-the-viewer" not in variables.values()


def test_output_of_readers_is_not_shown(call, capfd):
    assert call("noise") == 1
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_processes_that_a_reader_starts_end_with_it(call):
    number = call("child")
    wait_for(lambda: not psutil.pid_exists(number))


def test_threads_read_at_the_same_time(call):
    values, begin = {}, time.monotonic()

    def run(number):
        values[number] = [len(call("arrays", count=number)["many"][0]) for _ in range(10)]

    threads = [threading.Thread(target=run, args=(number,)) for number in range(1, 5)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert values == {number: [number] * 10 for number in range(1, 5)}
    assert time.monotonic() - begin < 60


@pytest.mark.slow
def test_nothing_is_left_behind(call):
    others = set(descendants())  # of other tests
    for _ in range(5):
        call("pid")
    wait_for(lambda: len(set(descendants()) - others) == 1)  # the server
    begin = len(os.listdir("/proc/self/fd"))
    for _ in range(20):
        call("arrays", count=3)
    assert len(os.listdir("/proc/self/fd")) <= begin + 1
    isolated._SERVERS.stop()
    assert set(descendants()) <= others
    assert call("pid")


def test_a_server_that_has_ended_is_started_again(call):
    first = call("pid")
    for kill in (signal.SIGKILL, signal.SIGTERM):
        os.kill(isolated._SERVERS._process.pid, kill)
        isolated._SERVERS._process.wait()
        assert call("pid") != first


def test_a_forked_process_has_its_own_server(call):
    call("pid")
    read, write = os.pipe()
    number = os.fork()
    if number == 0:
        os.write(write, str(len(call("arrays", count=4)["many"])).encode())
        isolated._SERVERS.stop()
        os._exit(0)
    os.waitpid(number, 0)
    assert os.read(read, 10) == b"4"
    assert call("arrays", count=2)["many"][0].shape == (2, 2)
    for fd in (read, write):
        os.close(fd)


def _read_npy(path):
    return isolated.call("isospline.io.checks:check_file", path)


def test_a_spawned_process_reads(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(bytes(12))
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.apply(_read_npy, (path,)) == 12


@pytest.mark.slow
@pytest.mark.parametrize("how", ["stdin", "interactive"])
def test_a_program_from_standard_input_reads(tmp_path, how):
    path = tmp_path / "a"
    path.write_bytes(bytes(12))
    program = f"""
from isospline.io import isolated
from pathlib import Path
print(isolated.call("isospline.io.checks:check_file", Path({str(path)!r})))
"""
    options = ["-i", "-q"] if how == "interactive" else ["-"]
    run = subprocess.run(
        [sys.executable, *options], input=program, capture_output=True, encoding="utf-8", timeout=120, cwd=tmp_path
    )
    assert run.stdout.split() == ["12"], run.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name, kill", [("spin", signal.SIGINT), ("sleep", signal.SIGINT), ("spin", signal.SIGKILL)])
def test_ctrl_c_and_the_end_of_the_caller_stop_a_reader(tmp_path, name, kill):
    (tmp_path / "some_readers.py").write_text(READERS, encoding="utf-8")
    program = (
        f"import sys\nsys.path.append({str(tmp_path)!r})\nfrom isospline.io import isolated\nfrom pathlib import Path\n"
        f"isolated.call('some_readers:pid', Path('/'))\nprint('ready', flush=True)\n"
        f"isolated.call('some_readers:{name}', Path({str(tmp_path)!r}))"
    )
    run = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8"
    )
    with run:
        assert run.stdout.readline() == "ready\n"
        process = psutil.Process(run.pid)
        wait_for(lambda: len(process.children(recursive=True)) >= 3)
        started = process.children(recursive=True)
        run.send_signal(kill)
        _, said = run.communicate(timeout=30)
    assert ("KeyboardInterrupt" in said) == (kill == signal.SIGINT)
    _, alive = psutil.wait_procs(started, timeout=20)
    assert alive == []
