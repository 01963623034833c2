"""The system around the package: warnings at the user's line, programs that it starts, and files written whole."""

from __future__ import annotations

import contextlib
import errno
import os
import signal
import sys
import threading
import warnings
from collections.abc import Iterator
from contextvars import ContextVar

from .. import _core
from .handed import handed

_is_silent = ContextVar("is_silent", default=False)


@handed
def warn(message: str) -> None:
    """Warn the user, at the line that called this package; compiled functions warn in this way, too."""
    if _is_silent.get():
        return
    frame = sys._getframe(1)
    level = 2
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "isospline":
        frame = frame.f_back
        level += 1
    warnings.warn(message, UserWarning, stacklevel=level)


@contextlib.contextmanager
def without_warnings() -> Iterator[None]:
    """Leave out the warnings of this package on this thread; `warnings.catch_warnings` changes those of all threads."""
    token = _is_silent.set(True)
    try:
        yield
    finally:
        _is_silent.reset(token)


def child_environment(**variables: str) -> dict[str, str]:
    """The environment of this process without this package's own variables, one of which is the viewer's token."""
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("ISOSPLINE_")}
    return {**inherited, **variables}


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Delay Ctrl-C to the end of the context. Within `subprocess.Popen` it leaves a process that nobody holds."""
    handler = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(handler):
        yield
        return
    received = []
    signal.signal(signal.SIGINT, lambda *arguments: received.append(arguments))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if received:
            handler(*received[0])


@contextlib.contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[str]:
    """The name of a temporary file next to `path`. It replaces `path` at the end, and is removed on an error."""
    file = _core.OutputFile(path)
    temporary = file.temporary
    try:
        yield temporary
        file.commit()
    except OSError as error:
        if error.filename not in (None, temporary):
            raise
        raise OSError(error.errno or errno.EIO, error.strerror or str(error), os.fspath(path)) from None
    finally:
        file.discard()
