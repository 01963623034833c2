"""What the cases of both kinds have in common."""

import contextlib
import re

import isospline

#: What a call may raise.
SANE = (TypeError, ValueError, OverflowError, MemoryError, OSError, ImportError, isospline.Cancelled, RuntimeError)
INSANE = (RecursionError, NotImplementedError)


class Failed(Exception):
    """A case has not gone as it may."""


@contextlib.contextmanager
def peak_memory():
    """A function that tells by how many bytes the peak of resident memory was above that at the beginning."""
    with open("/proc/self/clear_refs", "w") as file:
        file.write("5")
    begin = _status("VmRSS")
    yield lambda: _status("VmHWM") - begin


def _status(name):
    with open("/proc/self/status") as file:
        return int(re.search(rf"{name}:\s+(\d+) kB", file.read())[1]) * 1024
