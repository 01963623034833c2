"""Confines the calling process with Landlock: it reads some files only, writes none and opens no TCP connection.

Landlock is part of Linux from 5.13 on. Rules hold for all later opens, also of processes that this one starts; files
that are open already can still be used. See landlock(7).
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import os
import site
import sys
from collections.abc import Iterable
from typing import Any

# System calls, which have the same numbers on all processors, and an operation of prctl.
_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
NO_NEW_PRIVILEGES = 38
_VERSION_FLAG = 1
_PATH_BENEATH = 1
_EXECUTE, _READ_FILE, _READ_FOLDER = 1, 4, 8
#: Rights over files that each version of the interface knows, by their number; later versions have the last one's.
_RIGHTS_OF_VERSION = {1: 13, 2: 14, 3: 15, 4: 15, 5: 16}
_CONNECTIONS = 3  # of TCP: bind, connect; from version 4 on
_SCOPES = 3  # abstract Unix sockets and signals of processes that are not confined; from version 6 on

#: What Python and libraries need: programs, shared libraries, time zones, the number of processors.
_SYSTEM = (
    "/usr", "/bin", "/lib", "/lib64", "/etc/ld.so.cache", "/etc/localtime", "/dev/null", "/dev/urandom", "/dev/zero",
    "/proc/cpuinfo", "/proc/meminfo", "/sys/devices/system/cpu",
)  # fmt: skip


class _Ruleset(ctypes.Structure):
    _fields_ = (("files", ctypes.c_uint64), ("connections", ctypes.c_uint64), ("scopes", ctypes.c_uint64))


class _Rule(ctypes.Structure):
    _pack_ = 1
    _layout_ = "ms"
    _fields_ = (("rights", ctypes.c_uint64), ("descriptor", ctypes.c_int32))


def version() -> int:
    """The version of Landlock's interface that the kernel offers; 0 without it."""
    return max(0, _libc().syscall(_CREATE_RULESET, None, ctypes.c_size_t(0), _VERSION_FLAG))


def outermost(paths: Iterable[str | os.PathLike[str]]) -> list[str]:
    """The real paths of files and folders, without those that are in one of the others."""
    kept: list[str] = []
    for path in sorted({os.path.realpath(each) for each in paths}, key=lambda path: path.split("/")):
        if not (kept and (path == kept[-1] or path.startswith(kept[-1].rstrip("/") + "/"))):
            kept.append(path)
    return kept


@functools.cache
def needed() -> list[str]:
    """What Python and the imported packages consist of. It is found once, also for processes that this one forks."""
    return outermost((*_SYSTEM, *_packages()))


def read_only(paths: Iterable[str | os.PathLike[str]]) -> bool:
    """Let this process read only the given files and folders, and what Python and its packages consist of.

    Returns
    -------
    bool
        Whether the kernel can do so.

    Raises
    ------
    OSError
        If it can in general, but refuses this.
    """
    offered = version()
    if offered == 0:
        return False
    files = (1 << _RIGHTS_OF_VERSION.get(offered, _RIGHTS_OF_VERSION[5])) - 1
    ruleset = _Ruleset(files, _CONNECTIONS if offered >= 4 else 0, _SCOPES if offered >= 6 else 0)
    known = 3 if offered >= 6 else 2 if offered >= 4 else 1  # fields of the structure
    size = known * ctypes.sizeof(ctypes.c_uint64)
    descriptor = _call(_CREATE_RULESET, ctypes.byref(ruleset), ctypes.c_size_t(size), 0)
    try:
        for path in outermost((*paths, "/proc/self", *needed())):
            with contextlib.suppress(FileNotFoundError, PermissionError):
                _allow(descriptor, path)
        control_process(NO_NEW_PRIVILEGES, 1, 0)
        _call(_RESTRICT_SELF, descriptor, 0)
    finally:
        os.close(descriptor)
    return True


def _allow(ruleset, path):
    place = os.open(path, os.O_PATH | os.O_CLOEXEC)
    try:
        rights = _EXECUTE | _READ_FILE | (_READ_FOLDER if os.path.isdir(path) else 0)
        _call(_ADD_RULE, ruleset, _PATH_BENEATH, ctypes.byref(_Rule(rights, place)), 0)
    finally:
        os.close(place)


def _packages():
    """Folders of Python, of installed packages and of those that are imported."""
    yield from (sys.prefix, sys.base_prefix, sys.exec_prefix, site.getusersitepackages())
    yield from (path for path in sys.path if os.path.basename(path) in ("site-packages", "dist-packages"))
    for name, module in list(sys.modules.items()):
        if "." not in name:
            yield from getattr(module, "__path__", ())


def _call(number, *arguments):
    result = _libc().syscall(number, *arguments)
    if result < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    return result


def control_process(operation: int, argument: int, pointer: Any) -> None:
    """Call prctl. Raises OSError if the kernel refuses."""
    if _libc().prctl(operation, argument, pointer, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


@functools.cache
def _libc():
    return ctypes.CDLL(None, use_errno=True)
