"""Denies system calls to the calling process that Landlock does not, with a filter that libseccomp makes.

The process reaches nobody by a socket, changes no attribute of a file, and reaches no other process. What is denied
fails with EPERM, also in processes that this one starts. libseccomp is a package of the system, which most have. See
seccomp(2).
"""

from __future__ import annotations

import ctypes
import functools
import os

from .landlock import NO_NEW_PRIVILEGES, control_process

_ALLOW, _DENY = 0x7FFF0000, 0x00050001  # with EPERM
_NOT_EQUAL = 1

#: System calls that are denied. Those that the kernel or the processor do not have are left out.
_DENIED = """
    socket connect bind listen accept accept4 sendmsg sendmmsg
    chmod fchmod fchmodat fchmodat2 chown fchown lchown fchownat utime utimes futimesat utimensat
    setxattr lsetxattr fsetxattr setxattrat removexattr lremovexattr fremovexattr removexattrat file_setattr
    tkill rt_sigqueueinfo rt_tgsigqueueinfo pidfd_open pidfd_send_signal pidfd_getfd
    ptrace process_vm_readv process_vm_writev process_madvise process_mrelease kcmp setsid setpgid
    setpriority ioprio_set sched_setscheduler sched_setparam sched_setattr
    shmget shmat shmctl semget semop semtimedop semctl msgget msgsnd msgrcv msgctl mq_open mq_unlink
    mount umount umount2 mount_setattr move_mount open_tree fsopen fsconfig fsmount fspick pivot_root chroot
    unshare setns name_to_handle_at open_by_handle_at fanotify_init quotactl quotactl_fd swapon swapoff acct
    io_uring_setup io_uring_enter io_uring_register bpf perf_event_open userfaultfd add_key request_key keyctl
    init_module finit_module delete_module kexec_load kexec_file_load reboot syslog
    settimeofday clock_settime clock_adjtime adjtimex sethostname setdomainname iopl ioperm personality
"""
#: System calls that are denied unless one of their arguments has one value: that argument's position, and the value.
#: They are allowed for this process alone; sendto, between the two ends of a pair of sockets, which asyncio makes.
_DENIED_UNLESS = {
    "kill": (0, os.getpid),
    "tgkill": (0, os.getpid),
    "prlimit64": (0, lambda: 0),
    "sched_setaffinity": (0, lambda: 0),
    "sendto": (4, lambda: 0),
}


# Operations of prctl, and the bytes of an instruction of a filter.
_SET_SECCOMP, _MODE_FILTER = 22, 2
_INSTRUCTION = 8


class _Filter(ctypes.Structure):
    _fields_ = (("count", ctypes.c_ushort), ("instructions", ctypes.c_void_p))


class _Comparison(ctypes.Structure):
    _fields_ = (
        ("argument", ctypes.c_uint),
        ("operator", ctypes.c_int),
        ("value", ctypes.c_uint64),
        ("unused", ctypes.c_uint64),
    )


def is_available() -> bool:
    """Whether libseccomp is installed, and the kernel has filters."""
    library = _library()
    return library is not None and library.seccomp_api_get() > 0


def deny() -> bool:
    """Deny the system calls to this process, and those that it starts.

    Returns
    -------
    bool
        Whether it could be done.

    Raises
    ------
    OSError
        If it can in general, but the kernel refuses this.
    """
    if not is_available():
        return False
    # The kernel takes the strictest answer of all filters. That of most calls is made once: libseccomp needs 3 ms.
    filters = [program(), _program([(name, _unless(*each)) for name, each in _DENIED_UNLESS.items()])]
    control_process(NO_NEW_PRIVILEGES, 1, 0)
    for each in filters:
        instructions = ctypes.create_string_buffer(each, len(each))
        filter = _Filter(len(each) // _INSTRUCTION, ctypes.addressof(instructions))
        control_process(_SET_SECCOMP, _MODE_FILTER, ctypes.byref(filter))
    return True


@functools.cache
def program() -> bytes:
    """The filter of the system calls that are always denied. It is made once, for forked processes, too."""
    return _program([(name, ()) for name in _DENIED.split()]) if is_available() else b""


def _unless(argument, allowed):
    return (_Comparison(argument, _NOT_EQUAL, allowed(), 0),)


def _program(rules):
    """The kernel's filter with these rules, each a system call and comparisons of its arguments."""
    library = _library()
    context = ctypes.c_void_p(library.seccomp_init(_ALLOW))
    try:
        for name, comparisons in rules:
            number = library.seccomp_syscall_resolve_name(name.encode())
            if number >= 0:
                array = (_Comparison * len(comparisons))(*comparisons)
                _check(library.seccomp_rule_add_array(context, _DENY, number, len(comparisons), array))
        with os.fdopen(os.memfd_create("filter"), "rb") as file:  # a file could not be made under Landlock
            _check(library.seccomp_export_bpf(context, file.fileno()))
            file.seek(0)
            return file.read()
    finally:
        library.seccomp_release(context)


def _library():
    """The library, whose version 2.4 or later is needed; None without it."""
    try:
        library = ctypes.CDLL("libseccomp.so.2")
        library.seccomp_api_get.restype = ctypes.c_uint
    except (OSError, AttributeError):
        return None
    library.seccomp_init.argtypes, library.seccomp_init.restype = (ctypes.c_uint32,), ctypes.c_void_p
    library.seccomp_release.restype = None
    library.seccomp_rule_add_array.argtypes = (
        ctypes.c_void_p, ctypes.c_uint32, ctypes.c_int, ctypes.c_uint, ctypes.POINTER(_Comparison),
    )  # fmt: skip
    return library


def _check(result):
    if result < 0:
        raise OSError(-result, os.strerror(-result))
