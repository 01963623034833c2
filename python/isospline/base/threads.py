"""The number of threads of long operations."""

from __future__ import annotations

from .. import _core
from .signatures import explained


@explained
def set_thread_count(count: int) -> None:
    """Limit the number of threads of all long operations from now on.

    Parameters
    ----------
    count : int
        0, the default, is one thread for each processor that this process may use.

    Raises
    ------
    ValueError
        For a negative number.
    """
    _core.set_thread_count(count)


@explained
def thread_count() -> int:
    """Number of threads that a long operation may use."""
    return _core.thread_count()
