"""Files that pages upload, in a private folder and within limits."""

from __future__ import annotations

import os
import re
import shutil
import threading
from collections import Counter

from ..base.parameters import check_count
from ..io.raw_shape import describe_raw
from ..store.budget import parse_memory
from .dropped import paths_to_open
from .session import SESSION_SUFFIXES, is_inside
from .temporary import TemporaryFolder
from .to_page import Progress, Raw, Uploaded

#: By default, the most bytes of all uploads of a viewer together, and their largest number of files.
UPLOAD_LIMIT: int | str = "8GB"
UPLOAD_COUNT: int = 10_000


class Uploads:
    """The uploaded files of a viewer.

    Parameters
    ----------
    limit : int or str
        The most bytes of all files together, or a text such as "2GB".
    count : int
        The largest number of files.
    """

    def __init__(self, limit, count):
        self._limit = parse_memory(limit, "upload_limit")
        check_count(count, "upload_count")
        self._count = int(count)
        self._lock = threading.Lock()
        self._temporary = None
        self._used = {}  # bytes and files by folder
        self._held: Counter[str] = Counter()  # folders whose files are being opened, and how often

    @property
    def path(self):
        """The folder that has all of them; None before the first."""
        return self._temporary and self._temporary.path

    def without_folders(self, text):
        """A text that names files of uploads, without their temporary folders."""
        if self.path is None:
            return text
        text = re.sub(rf"{re.escape(self.path)}[/\\][^/\\\s]+[/\\]", "", text)
        return re.sub(rf"{re.escape(self.path)}[/\\][^/\\\s:]+", "the uploaded files", text)

    def folder(self, sizes=()):
        """A new folder for files of some sizes. It is removed with the viewer, or by `discard`.

        Raises
        ------
        ValueError
            If the files exceed a limit or the free space of the disk.
        """
        with self._lock:
            total, count = sum(sizes), len(sizes)
            self._check(total + sum(each for each, _ in self._used.values()), "bytes", self._limit, "upload_limit")
            self._check(count + sum(each for _, each in self._used.values()), "files", self._count, "upload_count")
            if self._temporary is None:
                self._temporary = TemporaryFolder()
            free = shutil.disk_usage(self._temporary.path).free
            if total > free:
                raise ValueError(f"files: expected at most the free space of the disk, {free} bytes, got {total}")
            folder = self._temporary.folder()
            self._used[folder] = (total, count)
            return folder

    def root_of(self, path):
        """The folder that has a path; None if there is none any more."""
        with self._lock:
            return next((folder for folder in self._used if is_inside(path, folder)), None)

    def hold(self, folder):
        """Keep a folder until it is released, whether its files are used or not."""
        with self._lock:
            self._held[folder] += 1

    def release(self, folder):
        with self._lock:
            self._held[folder] -= 1

    def is_held(self, folder):
        with self._lock:
            return self._held[folder] > 0

    def discard(self, folder):
        """Remove a folder of files that are not used."""
        shutil.rmtree(folder, ignore_errors=True)
        with self._lock:
            self._used.pop(folder, None)

    def remove(self):
        """Remove all files."""
        with self._lock:
            if self._temporary is not None:
                self._temporary.remove()

    @staticmethod
    def _check(number, unit, limit, parameter):
        if number > limit:
            raise ValueError(f"files: expected at most {limit} {unit} in all uploads ({parameter}), got {number}")


class Upload:
    """Writes the files of an upload, which arrive as a stream of bytes, into a folder of their own.

    Parameters
    ----------
    uploads : Uploads
    files : sequence of from_page.UploadedFile

    Raises
    ------
    ValueError
        For files without a name, for two files of the same name, and for files that exceed a limit.
    """

    def __init__(self, uploads, files):
        if not files:
            raise ValueError("files: expected a list of names and sizes")
        sizes = {}
        for each in files:
            name = _last_name(each.name)
            if name in sizes:
                raise ValueError(f"files: expected different names, got {name!r} twice")
            sizes[name] = each.size
        self._uploads = uploads
        self.folder = uploads.folder(sizes.values())
        self._left = [(os.path.join(self.folder, name), size) for name, size in sizes.items()]
        self._paths = [path for path, _ in self._left]
        self._total = sum(sizes.values())
        self._written = 0
        try:
            for path in self._paths:
                open(path, "xb").close()
        except BaseException:
            self.discard()
            raise

    @property
    def fraction(self):
        return self._written / self._total if self._total else 1.0

    @property
    def complete(self):
        return self._written == self._total

    def write(self, content):
        """Write the next bytes."""
        self._written += len(content)
        if self._written > self._total:
            raise ValueError(f"files: expected {self._total} bytes, got more")
        while content:
            path, size = self._left[0]
            part = content[:size]
            with open(path, "ab") as file:
                file.write(part)
            content = content[size:]
            if size > len(part):
                self._left[0] = (path, size - len(part))
            else:
                self._left.pop(0)

    def discard(self):
        """Remove the files."""
        self._uploads.discard(self.folder)

    def session(self):
        """The path of a session, whose files may be the others of the upload; None without one."""
        sessions = [path for path in self._paths if path.lower().endswith(SESSION_SUFFIXES)]
        if len(sessions) > 1:
            names = ", ".join(map(os.path.basename, sessions))
            raise ValueError(f"files: expected one session, got {names}")
        return sessions[0] if sessions else None

    def paths(self, others=()):
        """The paths to open: series of slices as folders, and files without those that others name or are opened."""
        known = set(others)
        return paths_to_open(self.folder, [path for path in self._paths if path not in known])


class Receiver:
    """Receives the uploads of a page, one after the other, and opens them.

    Parameters
    ----------
    viewer : Viewer
    send : callable
        Sends a message to the page.
    failed : callable
        ``failed(error)`` tells the page of an error.
    """

    def __init__(self, viewer, send, failed):
        self._viewer, self._send, self._failed = viewer, send, failed
        self._upload = None
        self._lock = threading.Lock()
        self._raw = {}  # files of samples alone, whose shapes the page has been asked for: (path, folder) by number
        self._asked, self._has_ended = 0, False

    def begin(self, files):
        """Begin an upload."""
        self._end_upload()
        self._upload = Upload(self._viewer.uploads, files)
        self.write(b"")

    def end(self):
        """Remove the files that were not opened."""
        self._end_upload()
        with self._lock:
            self._has_ended = True
            numbers = list(self._raw)
        for number in numbers:
            self.answer(number, None)

    def answer(self, number, read_options):
        """Open a file of samples alone with options of `read_volume`; None removes it."""
        with self._lock:
            if number not in self._raw:
                raise ValueError(f"number: expected that of a question, got {number!r}")
            path, folder = self._raw.pop(number)
        self._viewer.submit(self._open_raw, path, folder, read_options)

    def _end_upload(self):
        if self._upload is not None:
            self._upload.discard()
            self._upload = None

    def write(self, content):
        """Write the next bytes; open the files when they are complete."""
        if self._upload is None:
            return
        try:
            self._upload.write(content)
        except Exception:
            self._end_upload()
            raise
        self._send(Progress("uploading", self._upload.fraction))
        if self._upload.complete:
            upload, self._upload = self._upload, None
            self._viewer.submit(self._open, upload)

    def _open(self, upload):
        """Open uploaded files, which may refer to each other and to nothing else."""
        with self._viewer.holding(upload.folder):
            try:
                session = upload.session()
                opened = []
                if session is not None:
                    self._open_session(session, upload.folder)
                    opened = [session, *(each.path for each in self._viewer.document)]
                for path in upload.paths(opened):
                    if path.lower().endswith(".raw"):
                        self._ask(path, upload.folder)
                    else:
                        self._open_file(path, upload.folder)
            except Exception as error:
                self._failed(error)
        self._send(Progress(None, 1.0))
        self._send(Uploaded())

    def _open_session(self, path, folder):
        content, unpacked = self._viewer.read_session(path)
        with self._viewer.holding(unpacked or folder):
            self._viewer.open_session(content, unpacked or folder, uploaded=True)

    def _ask(self, path, folder):
        """Ask the page for the shape of a file of samples alone, and suggest one."""
        name = os.path.basename(path)
        self._send(Progress(f"looking at {name}", 0.0))
        shape, dtype = describe_raw(path) or (None, None)
        with self._lock:
            if self._has_ended:
                return
            self._asked += 1
            number = self._asked
            self._raw[number] = path, folder
            self._viewer.uploads.hold(folder)
        self._send(Raw(number, name, os.path.getsize(path), shape, dtype))

    def _open_raw(self, path, folder, read_options):
        with self._viewer.holding(folder):
            self._viewer.uploads.release(folder)
            if read_options is not None:
                self._open_file(path, folder, read_options)
        self._send(Uploaded())

    def _open_file(self, path, folder, read_options=None):
        try:
            self._viewer.open(path, within=folder, read_options=read_options)
        except Exception as error:
            self._failed(error)


def _last_name(name):
    """The name of a file without folders."""
    last = os.path.basename(name.replace("\\", "/"))
    if last in ("", ".", "..") or "\0" in last:
        raise ValueError(f"files: expected a name for each file, got {name!r}")
    return last
