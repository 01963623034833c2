"""What a library that a file took over could do to the rest of the system, from the process that reads."""

import errno
import os
import socket
import subprocess
import sys

import pytest

from isospline.io import isolated, landlock, seccomp

PROBES = """
import ctypes, os, resource, signal, socket

def udp(port): socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b"a", ("127.0.0.1", port))
def tcp(port): socket.create_connection(("127.0.0.1", port))
def listen(port): socket.create_server(("127.0.0.1", 0))
def unix(name): socket.socket(socket.AF_UNIX).connect(name)
def pair(): socket.socketpair()[0].sendmsg([b"a"])
def datagram(name): socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)[0].sendto(b"a", name)
def chmod(file): os.chmod(file, 0o777)
def chown(file): os.chown(file, os.getuid(), os.getgid())
def utime(file): os.utime(file, (1, 1))
def attribute(file): os.setxattr(file, "user.a", b"1")
def kill(pid): os.kill(pid, 0)
def kill_group(): os.kill(0, 0)
def pidfd(pid): os.pidfd_open(pid)
def limit(pid): resource.prlimit(pid, resource.RLIMIT_NOFILE, (10, 10))
def session(): os.setsid()
def affinity(pid): os.sched_setaffinity(pid, {0})
def priority(pid): os.setpriority(os.PRIO_PROCESS, pid, 10)
def system_call(name, numbers):
    libseccomp, libc = ctypes.CDLL("libseccomp.so.2"), ctypes.CDLL(None, use_errno=True)
    if libc.syscall(libseccomp.seccomp_syscall_resolve_name(name.encode()), *numbers) < 0:
        raise OSError(ctypes.get_errno(), name)

def probe(path, what, **arguments):
    globals()[what](**arguments)
    return "allowed"
def own(path):
    os.kill(os.getpid(), 0)
    resource.prlimit(0, resource.RLIMIT_NOFILE)
    os.sched_setaffinity(0, os.sched_getaffinity(0))
    return "allowed"
"""

needs_seccomp = pytest.mark.skipif(not seccomp.is_available(), reason="libseccomp is not installed")
needs_scopes = pytest.mark.skipif(landlock.version() < 6, reason="the kernel's Landlock has no scopes")


@pytest.fixture
def probe(tmp_path, monkeypatch):
    """Whether the process that reads is denied something, and by which error."""
    (tmp_path / "some_probes.py").write_text(PROBES, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    isolated._SERVERS.stop()

    def check_denied(what, **arguments):
        with pytest.raises(OSError) as caught:
            isolated.call("some_probes:probe", tmp_path, what=what, **arguments)
        assert caught.value.errno == errno.EPERM

    yield check_denied
    isolated._SERVERS.stop()


@needs_seccomp
def test_no_socket_is_opened(probe, tmp_path):
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as datagrams,
        socket.create_server(("127.0.0.1", 0)) as server,
        socket.socket(socket.AF_UNIX) as by_path,
        socket.socket(socket.AF_UNIX) as abstract,
    ):
        datagrams.bind(("127.0.0.1", 0))
        names = [str(tmp_path / "socket"), f"\0isospline-{os.getpid()}"]
        for each, name in zip((by_path, abstract), names):
            each.bind(name)
            each.listen()
        probe("udp", port=datagrams.getsockname()[1])
        for what in ("tcp", "listen"):
            probe(what, port=server.getsockname()[1])
        for name in names:
            probe("unix", name=name)
        probe("pair")
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as receiver:
            receiver.bind(str(tmp_path / "receiver"))
            probe("datagram", name=str(tmp_path / "receiver"))
        for each in (datagrams, server, by_path, abstract):
            each.settimeout(0)
        with pytest.raises(BlockingIOError):
            datagrams.recv(1)
        for each in (server, by_path, abstract):
            with pytest.raises(BlockingIOError):
                each.accept()


@needs_seccomp
def test_no_attribute_of_a_file_is_changed(probe, tmp_path_factory, tmp_path):
    for folder in (tmp_path, tmp_path_factory.mktemp("elsewhere")):
        file = folder / "file"
        file.write_text("a", encoding="utf-8")
        file.chmod(0o600)
        before = file.stat()
        for what in ("chmod", "chown", "utime", "attribute"):
            probe(what, file=str(file))
        after = file.stat()
        assert (after.st_mode, after.st_mtime_ns, after.st_ctime_ns) == (
            before.st_mode,
            before.st_mtime_ns,
            before.st_ctime_ns,
        )


@needs_seccomp
def test_no_other_process_is_reached(probe, tmp_path):
    for what in ("kill", "pidfd", "limit", "affinity", "priority"):
        probe(what, pid=os.getpid())
    for what in ("kill_group", "session"):
        probe(what)
    for name in ("ptrace", "process_vm_readv", "process_vm_writev", "kcmp", "tkill", "rt_sigqueueinfo"):
        probe("system_call", name=name, numbers=[16, os.getpid(), 0, 0, 0, 0])
    assert isolated.call("some_probes:own", tmp_path) == "allowed"


@needs_seccomp
@pytest.mark.parametrize("name", ["io_uring_setup", "bpf", "keyctl", "mount", "unshare", "userfaultfd", "shmget"])
def test_other_doors_of_the_kernel_are_closed(probe, name):
    probe("system_call", name=name, numbers=[0, 0, 0, 0, 0])


@needs_scopes
def test_landlock_alone_denies_signals_and_abstract_sockets(tmp_path):
    name = f"isospline-{os.getpid()}-alone"
    program = (
        "import os, socket\nfrom isospline.io import landlock\nlandlock.read_only([])\n"
        f"for act in (lambda: os.kill({os.getpid()}, 0), lambda: socket.socket(socket.AF_UNIX).connect('\\0{name}')):\n"
        "    try:\n        act()\n        print('allowed')\n    except PermissionError:\n        print('denied')\n"
    )
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(f"\0{name}")
        server.listen()
        run = subprocess.run([sys.executable, "-c", program], capture_output=True, encoding="utf-8", timeout=120)
    assert run.stdout.split() == ["denied", "denied"], run.stderr


@pytest.mark.parametrize(
    "missing, words",
    [((), ""), (("Landlock",), "Linux 5.13"), (("libseccomp",), "install libseccomp2"), (("Landlock", "libsecc"), "")],
)
def test_what_does_not_confine_is_told_with_its_remedy(monkeypatch, missing, words):
    monkeypatch.setattr(landlock, "version", lambda: 0 if "Landlock" in missing else 4)
    monkeypatch.setattr(seccomp, "is_available", lambda: not any("libsecc" in name for name in missing))
    text = isolated.unconfined()
    assert bool(text) == bool(missing) and "\n" not in text and words in text
    assert all(name in text for name in missing)
    assert ("Landlock" in text) == ("Landlock" in missing)


def test_reading_works_without_libseccomp(tmp_path, monkeypatch):
    def missing(name, *args, **options):
        raise OSError(f"{name}: no such file")

    monkeypatch.setattr(seccomp.ctypes, "CDLL", missing)
    assert not seccomp.is_available() and not seccomp.deny()
