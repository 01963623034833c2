"""The common part of both kinds of cases."""

import contextlib
import re

import isospline

#: Exceptions that a call may raise.
SANE = (TypeError, ValueError, OverflowError, MemoryError, OSError, ImportError, isospline.Cancelled, RuntimeError)
INSANE = (RecursionError, NotImplementedError)


class Failed(Exception):
    """A case had an outcome that is not allowed."""


@contextlib.contextmanager
def peak_memory():
    """A function that returns the growth of the peak of resident memory since the beginning, in bytes."""
    with open("/proc/self/clear_refs", "w", encoding="utf-8") as file:
        file.write("5")
    begin = _status("VmRSS")
    yield lambda: _status("VmHWM") - begin


def _status(name):
    with open("/proc/self/status", encoding="utf-8") as file:
        return int(re.search(rf"{name}:\s+(\d+) kB", file.read())[1]) * 1024
