"""The server of `isolated`: forks a process for each call, which reads, and a second one, which watches it."""

from __future__ import annotations

import contextlib
import gc
import importlib
import json
import math
import mmap
import os
import resource
import select
import signal
import socket
import sys
import warnings

import numpy as np
import psutil

from . import landlock, seccomp
from .isolated import ERRORS, MESSAGE

#: Seconds without a call, after which the server ends; the next call starts another.
IDLE = 120.0
#: Arrays begin at multiples of this.
_ALIGNMENT = 64


def serve(number: int) -> None:
    """Answer the calls that come by a socket until it is closed."""
    control = socket.socket(fileno=number)
    control.settimeout(IDLE)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for the watching processes
    warnings.simplefilter("ignore")
    while True:
        try:
            message, fds, _, _ = socket.recv_fds(control, MESSAGE, 2)
        except TimeoutError:
            return
        if not message:
            return
        for library in message.decode().split():
            if library not in sys.modules:
                with contextlib.suppress(ImportError):  # the call raises it
                    importlib.import_module(library)
                landlock.needed.cache_clear()
        landlock.needed()
        seccomp.program()
        gc.freeze()  # so that collections of the forked processes do not copy pages
        if os.fork() == 0:
            control.close()
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            _watch(socket.socket(fileno=fds[0]), fds[1])
            os._exit(0)
        for fd in fds:
            os.close(fd)


def _watch(caller, shared):
    """Fork the reading process, wait for it, and report how it ended; end it after its time and with its caller."""
    request = json.loads(caller.makefile("rb").readline())
    caller.sendall(b"\n")
    end, held = os.pipe()
    reader = os.fork()
    if reader == 0:
        os.setpgid(0, 0)
        os.close(end)
        _read(request, caller, shared)
        os._exit(0)
    os.close(held)
    poll = select.poll()
    poll.register(end, select.POLLIN)
    poll.register(caller, select.POLLHUP)
    events = dict(poll.poll(1000 * request["clock"] if "streams" not in request else None))
    if end not in events:
        os.kill(reader, signal.SIGKILL)
    os.waitid(os.P_PID, reader, os.WEXITED | os.WNOWAIT)
    with contextlib.suppress(OSError):
        os.killpg(reader, signal.SIGKILL)  # processes that it has started
    _, status = os.waitpid(reader, 0)
    ended = {"signal": os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0, "late": not events}
    with contextlib.suppress(OSError):  # the caller may be gone
        caller.sendall(json.dumps(ended).encode() + b"\n")


def _read(request, caller, shared):
    """Call the function under limits, and send its result."""
    _limit(request)
    gc.enable()
    try:
        landlock.read_only(request["readable"])
        seccomp.deny()
        module, name = request["function"].split(":")
        read = getattr(importlib.import_module(module), name)
        if "streams" in request:
            with open(shared, "wb") as output:
                result = read(output=output, **request["arguments"])
        else:
            result = read(**request["arguments"])
        answer = {"value": _without_arrays(result, shared)}
    except Exception as error:
        answer = {
            "error": {
                "kind": next((kind.__name__ for kind in type(error).__mro__ if kind.__name__ in ERRORS), "ValueError"),
                "message": getattr(error, "strerror", None) or str(error) or type(error).__name__,
                "errno": getattr(error, "errno", None),
                "filename": getattr(error, "filename", None),
                "name": getattr(error, "name", None),
            }
        }
    with open(caller.fileno(), "wb", closefd=False) as file:  # the system calls of sockets are denied
        file.write(json.dumps(answer, default=str).encode() + b"\n")


def _limit(request):
    """Limit memory beyond what libraries have already, and processor time; write no image of a crashed process."""
    used = psutil.Process().memory_info().vms
    seconds = math.ceil(request["seconds"])
    for limit, value in (
        (resource.RLIMIT_AS, used + request["memory"]),
        (resource.RLIMIT_CPU, seconds),
        (resource.RLIMIT_CORE, 0),
    ):
        _, most = resource.getrlimit(limit)
        value = value if most == resource.RLIM_INFINITY else min(value, most)
        resource.setrlimit(limit, (value, most))


def _without_arrays(value, shared):
    """The result, with arrays in the shared file in place of arrays."""
    if isinstance(value, (list, tuple)):
        return [_without_arrays(item, shared) for item in value]
    if isinstance(value, dict):
        return {key: _without_arrays(item, shared) for key, item in value.items()}
    if not isinstance(value, np.ndarray):
        return value
    offset = -(-os.fstat(shared).st_size // _ALIGNMENT) * _ALIGNMENT
    os.ftruncate(shared, offset + value.nbytes)
    if value.nbytes:
        with mmap.mmap(shared, offset + value.nbytes) as mapped:
            place = np.frombuffer(mapped, value.dtype, value.size, offset).reshape(value.shape)
            np.copyto(place, value)
            del place
    return {"array": [value.dtype.str, list(value.shape), offset]}
