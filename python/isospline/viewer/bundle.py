"""Bundles: a session together with its uploaded files, in one ZIP file."""

from __future__ import annotations

import contextlib
import os
import shutil
import zipfile
import zlib

from .session import SESSION_SUFFIXES, session_of, sources_of

#: The most bytes of files in a bundle. It is sent to the page in one message.
LARGEST_BUNDLE = 1 << 30

# The name of the session in a bundle.
_SESSION = "session.json"


def is_bundle(path):
    """Whether a file is a ZIP file."""
    return zipfile.is_zipfile(path)


def write_bundle(path, document, state):
    """Write a session with the uploads that it shows; paths of other files are absolute.

    Raises
    ------
    ValueError
        If the state shows an object from memory, and if the uploads are larger than `LARGEST_BUNDLE`.
    """
    folders = dict.fromkeys(each.within for each in sources_of(document, state) if each.within is not None)
    names = {folder: f"files{number}" for number, folder in enumerate(folders, 1)}

    def place(source):
        if source.within is None:
            return source.path
        inner = os.path.relpath(source.path, source.within)
        return names[source.within] if inner == os.curdir else f"{names[source.within]}/{inner}".replace(os.sep, "/")

    session = session_of(document, state, place)
    files = [(file, f"{name}/{inner}") for folder, name in names.items() for file, inner in _files(folder)]
    size = sum(os.path.getsize(file) for file, _ in files)
    if size > LARGEST_BUNDLE:
        raise ValueError(
            f"session: expected at most {LARGEST_BUNDLE} bytes of uploaded files, got {size}; open the files by name"
        )
    with zipfile.ZipFile(path, "w") as bundle:
        bundle.writestr(_member(_SESSION), session.to_text())
        for file, name in files:
            member = _member(name)
            member.file_size = os.path.getsize(file)
            with open(file, "rb") as source, bundle.open(member, "w") as target:
                shutil.copyfileobj(source, target)


def _member(name):
    """A member of a bundle without a time, so that bundles of the same session have the same bytes."""
    member = zipfile.ZipInfo(name)  # of 1980
    member.external_attr = 0o600 << 16
    return member


def bundle_sizes(path):
    """The sizes of the files in a bundle."""
    with _errors_name(path), zipfile.ZipFile(path) as bundle:
        return [each.file_size for each in bundle.infolist() if not each.is_dir()]


def unpack(path, folder):
    """Unpack a bundle into a folder, and return the path of its session."""
    with _errors_name(path), zipfile.ZipFile(path) as bundle:
        if _SESSION not in bundle.namelist():
            raise ValueError(f"expected a session of isospline, got a ZIP file without {_SESSION}")
        for each in bundle.infolist():
            parts = each.filename.split("/")
            if os.path.isabs(each.filename) or ".." in parts or "\\" in each.filename:
                raise ValueError(f"expected names inside the bundle, got {each.filename!r}")
            bundle.extract(each, folder)
    return os.path.join(folder, _SESSION)


def _files(folder):
    """The files of an upload, except sessions, and their names in it."""
    for root, folders, names in os.walk(folder):
        folders.sort()
        for name in sorted(names):
            file = os.path.join(root, name)
            if root != folder or not name.lower().endswith(SESSION_SUFFIXES):
                yield file, os.path.relpath(file, folder).replace(os.sep, "/")


@contextlib.contextmanager
def _errors_name(path):
    """Name the file in errors of its contents."""
    try:
        yield
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError) as error:
        raise ValueError(f"{os.path.basename(path)}: {error}") from error
