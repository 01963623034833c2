"""Calls the readers of other libraries in a process of their own, with limits.

A damaged or hostile file may crash a library, or make it use all memory or run without end. Then the process ends, and
the caller gets an exception. One server process per caller imports the libraries once and forks a process for each
call, so that calls take milliseconds and no file can affect the next one. Where the kernel has Landlock, these read
little else than the file, and write nothing; where libseccomp is installed, they reach no socket and no other process.
Results come back as JSON, and arrays in memory that both processes map, or as a stream of bytes; nothing that the
process sends is executed.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import mmap
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..base.system import child_environment
from . import landlock, seccomp
from .checks import available_memory

#: Seconds of processor time for any file, and for each byte of it; the time on the clock may be several times as long.
SECONDS, SECONDS_OF_BYTE, CLOCK = 20.0, 4e-6, 5.0
#: Bytes of a message to the server, and of a result without its arrays.
MESSAGE, RESULT_LIMIT = 256, 1 << 24

_BEGIN = (
    "import gc, json, sys\ngc.disable()\nsys.path[:] = json.loads(sys.argv[2])\n"
    "from isospline.io.isolated_server import serve\nserve(int(sys.argv[1]))"
)
# Libraries would start threads, with which processes cannot be forked safely.
_ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "VECLIB")}
_KILLED = "the system ended the reader, most likely for lack of memory"
ERRORS = {
    kind.__name__: kind
    for kind in (ValueError, TypeError, MemoryError, OSError, ModuleNotFoundError, ImportError, RuntimeError)
}


def call(
    function: str,
    path: Path,
    libraries: str = "",
    *,
    readable: Sequence[str] | None = None,
    size: int = 0,
    **arguments: Any,
) -> Any:
    """Call ``function(path, **arguments)`` in a process of its own.

    Parameters
    ----------
    function : str
        A function, as ``"isospline.io.vtk:load"``. It returns what JSON can hold, and arrays of numbers.
    path : Path
        A file or a folder.
    libraries : str
        Names of the packages to import before the call, separated by blanks.
    readable : sequence of str, optional
        The files and folders that the process may read, if the kernel has Landlock; by default, the folder of the file,
        or the folder itself, with the targets of its symbolic links.
    size : int
        Bytes of the result, if they are known. They and the size of the file determine the limit of time.
    **arguments
        What JSON can hold.
    """
    request = _request(function, path, readable, arguments, size)
    with _shared_file() as file, _SERVERS.connect(request, libraries, file.fileno()) as connection:
        return _result(_answer(connection, request["seconds"]), request["seconds"], file)


@contextlib.contextmanager
def stream(function: str, path: Path, **arguments: Any) -> Iterator[Stream]:
    """The bytes that ``function(path, output, **arguments)`` writes, called in a process of its own.

    ``output`` is a file. The stream is to be read to its end. Exceptions of the function are raised here, at the latest
    at the end of the context. The limit of time on the clock is that of each part of the stream.
    """
    request = {**_request(function, path, None, arguments), "streams": True}
    read, write = os.pipe()
    with os.fdopen(read, "rb", buffering=0) as file:
        try:
            connection = _SERVERS.connect(request, "", write)
        finally:
            os.close(write)
        with connection:
            stream = Stream(file, connection, request["seconds"])
            yield stream
            file.close()
            stream.finish()


class Stream:
    """Bytes that a process sends."""

    def __init__(self, file: Any, connection: socket.socket, seconds: float) -> None:
        self._file, self._connection, self._seconds, self._is_finished = file, connection, seconds, False
        self._poll = select.poll()
        self._poll.register(file, select.POLLIN)

    def readinto(self, content: memoryview) -> int:
        """Read into a buffer; returns the number of bytes, 0 at the end."""
        if not self._poll.poll(1000 * CLOCK * self._seconds):
            raise _late(self._seconds)
        return self._file.readinto(content) or self.finish()

    def finish(self) -> int:
        """Raise the exception of the process, if it had one, after it has ended; returns 0, no bytes."""
        if not self._is_finished:
            self._is_finished = True
            _result(_answer(self._connection, self._seconds), self._seconds)
        return 0


def _request(function, path, readable, arguments, size=0):
    seconds = SECONDS + SECONDS_OF_BYTE * (_size(path) + size)
    return {
        "function": function,
        "arguments": {"path": os.path.abspath(path), **arguments},
        "readable": _surroundings(path) if readable is None else list(readable),
        "memory": available_memory(),
        "seconds": seconds,
        "clock": CLOCK * seconds,
    }


def unconfined() -> str:
    """What does not confine the processes on this system, with the remedy; empty if nothing is missing."""
    reasons = []
    if landlock.version() == 0:
        reasons.append(
            "without Landlock it can read and write your files (Linux 5.13 or later has it, containers may forbid it)"
        )
    if not seccomp.is_available():
        reasons.append("without libseccomp it can reach sockets and other processes (Debian: apt install libseccomp2)")
    remedy = "open only files that you trust"
    return f"the process that reads files is not fully confined: {'; '.join((*reasons, remedy))}" if reasons else ""


class _Servers:
    """The server of this process; a forked process gets its own."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._control: socket.socket | None = None
        self._process: Any = None
        os.register_at_fork(after_in_child=self._forget)
        atexit.register(self.stop)

    def _forget(self) -> None:
        """Leave the server to the process that was forked, which started it."""
        self._lock = threading.Lock()
        if self._control is not None:
            self._control.close()
            self._control = None
        if self._process is not None:  # None also while another thread started it
            self._process.returncode = 0  # it is not a child of this process, which need not wait for it
            self._process = None

    def connect(self, request, libraries, shared):
        """A connection to the process for a request, after it has begun."""
        for _ in range(2):  # the server may end meanwhile, which it does when it is not needed
            here, there = socket.socketpair()
            try:
                with there, self._lock:
                    message = libraries.encode().ljust(MESSAGE)
                    fds = [there.fileno(), shared]
                    try:
                        socket.send_fds(self._server(), [message], fds)
                    except (BrokenPipeError, ConnectionResetError):
                        self._start()
                        socket.send_fds(self._server(), [message], fds)
                here.settimeout(2 * request["clock"])
                with contextlib.suppress(BrokenPipeError, ConnectionResetError):
                    here.sendall(json.dumps(request).encode() + b"\n")
                    if here.recv(1):
                        return here
            except BaseException:
                here.close()
                raise
            here.close()
        raise MemoryError(_KILLED)

    def _server(self):
        if self._control is None:
            self._start()
        return self._control

    def _start(self):
        self.stop()
        self._control, there = socket.socketpair()
        package = str(Path(__file__).resolve().parents[2])
        paths = [entry for entry in sys.path if entry]
        with there:
            self._process = subprocess.Popen(
                [sys.executable, "-I", "-c", _BEGIN, str(there.fileno()), json.dumps([*paths, package])],
                pass_fds=[there.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C is for the caller, who then closes the connection
                env=child_environment(**_ONE_THREAD),
            )

    def stop(self):
        """End the server, which waits for messages only."""
        if self._control is not None:
            self._control.close()
            try:
                self._process.wait(5)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._control = None


_SERVERS = _Servers()


def _size(path):
    if not path.is_dir():
        return path.stat().st_size
    return sum(entry.stat().st_size for entry in os.scandir(path) if entry.is_file())


def referenced(within: str | os.PathLike[str] | None) -> list[str]:
    """What may be read of a format that refers to other files: a folder, or without one all files."""
    return ["/" if within is None else os.path.abspath(within)]


def _surroundings(path):
    """The folder of a file or the folder itself, and what symbolic links lead to."""
    folder = path if path.is_dir() else path.parent
    links = [entry.path for entry in os.scandir(path) if entry.is_symlink()] if path.is_dir() else [path]
    return [os.path.realpath(each) for each in (folder, *links)]


def _shared_file():
    """A file without a name, in memory if the system has such files."""
    if hasattr(os, "memfd_create"):
        return os.fdopen(os.memfd_create("isospline", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING), "r+b", buffering=0)
    return tempfile.TemporaryFile(buffering=0)


def _answer(connection, seconds):
    """The bytes of the answer, to its end."""
    answer = bytearray()
    try:
        while len(answer) < RESULT_LIMIT and (part := connection.recv(1 << 16)):
            answer += part
    except (BrokenPipeError, ConnectionResetError):
        pass
    except TimeoutError:
        raise _late(seconds) from None
    return bytes(answer)


def _late(seconds):
    return ValueError(f"the reader found no end in {seconds:.0f} s: the file is damaged")


def _result(answer, seconds, file=None):
    """The result of a call; or its exception, or a ValueError for a process that died."""
    lines = answer.split(b"\n")
    try:
        result = json.loads(lines[-3]) if len(lines) > 2 else None
        status = json.loads(lines[-2]) if len(lines) > 1 else {"signal": signal.SIGKILL}
        number, is_late = int(status["signal"]), bool(status.get("late"))
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"expected an answer of the reader, got {error}") from error
    if is_late or number == signal.SIGXCPU:
        raise _late(seconds)
    if number == signal.SIGKILL:
        raise MemoryError(_KILLED)
    if number or not isinstance(result, dict):
        name = signal.Signals(number).name if number else "no result"
        raise ValueError(f"the reader crashed ({name}): the file is damaged")
    if "error" in result:
        raise _exception(result["error"])
    return _with_arrays(result["value"], _mapped(file) if file else b"")


def _mapped(file):
    """The content of a file that the process cannot make shorter."""
    size = os.fstat(file.fileno()).st_size
    import fcntl  # of POSIX alone

    if hasattr(fcntl, "F_ADD_SEALS"):
        fcntl.fcntl(file.fileno(), fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK)
    return mmap.mmap(file.fileno(), size) if size else b""


def _exception(error):
    kind, message = ERRORS.get(error["kind"], ValueError), str(error["message"])
    if kind is OSError:
        return OSError(error["errno"], message, error["filename"]) if error["errno"] else OSError(message)
    return ModuleNotFoundError(message, name=error["name"]) if kind is ModuleNotFoundError else kind(message)


def _with_arrays(value, shared):
    """The result, with the arrays that it refers to."""
    if isinstance(value, list):
        return [_with_arrays(item, shared) for item in value]
    if not isinstance(value, dict):
        return value
    if "array" not in value:
        return {key: _with_arrays(item, shared) for key, item in value.items()}
    dtype, shape, offset = value["array"]
    dtype = np.dtype(dtype)
    if dtype.kind not in "biuf":
        raise ValueError(f"expected numbers, got {dtype}")
    count = int(np.prod(shape, dtype=object))
    return np.frombuffer(shared, dtype, count, offset).reshape(shape) if count else np.empty(shape, dtype)
