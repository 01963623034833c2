"""Sessions: the open files and the displayed state, in a small text file."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from typing import Any

from ..base.parameters import check_path
from ..base.system import warn, whole_file
from .checked import Checked, field, options, record, records, text
from .document import is_mesh, read_source
from .state import COLOR_RULES, ViewState

#: The value of a session's first field. Sessions 1 had `shading` for `light`.
FORMAT = "isospline session 2"
#: Suffixes of sessions, and of sessions with their files.
SESSION_SUFFIXES = (".json", ".zip")

# The options of files that a session may have.
_READ_OPTIONS = ("shape", "dtype", "offset", "spacing", "origin", "direction", "name", "nan")
_MODEL_OPTIONS = ("degree", "boundary", "filter", "smoothing")


@dataclass(frozen=True)
class SessionSource(Checked):
    """A file and its key in states; its path is relative if it is below the session's folder."""

    key: str = field(text)
    path: str = field(text)
    read_options: dict[str, Any] = field(options(*_READ_OPTIONS), {})
    model_options: dict[str, Any] = field(options(*_MODEL_OPTIONS), {})


@dataclass(frozen=True)
class Session(Checked):
    """Files and a state.

    Examples
    --------
    >>> from isospline.viewer.session import Session, SessionSource
    >>> from isospline.viewer.state import ViewState
    >>> session = Session("isospline session 2", (SessionSource("source1", "head.nii.gz"),), ViewState())
    >>> Session.from_text(session.to_text()) == session
    True
    """

    format: str = field(text)
    sources: tuple[SessionSource, ...] = field(records(SessionSource), ())
    state: ViewState = field(record(ViewState), ViewState())

    def to_text(self):
        """The session as indented JSON."""
        return json.dumps(self.to_json(), indent=1) + "\n"

    @classmethod
    def from_text(cls, content, name="session"):
        """Parse a session."""
        try:
            data = json.loads(content)
        except (ValueError, RecursionError) as error:
            raise ValueError(f"{name}: expected a session of isospline, got text that is not JSON: {error}") from None
        if not isinstance(data, dict) or data.get("format") != FORMAT:
            raise ValueError(f"{name}: expected a session of isospline with the format {FORMAT!r}")
        session = cls.from_json(data, name)
        session._check_keys(name)
        return session

    def _check_keys(self, name):
        """Check that each source has a key of its own, and that the state names no others."""
        keys: set[str] = set()
        for source in self.sources:
            if source.key in keys:
                raise ValueError(f"{name}: expected a key of its own for each source, got {source.key!r} of several")
            keys.add(source.key)
        for each in self.state.objects:
            if each.source not in keys:
                raise ValueError(f"{name}: expected a source for each object, got none for {each.source!r}")
            if each.color_by not in (*COLOR_RULES, *keys):
                expected = f"color_by: expected one of {', '.join(COLOR_RULES)} or the key of a source"
                raise ValueError(f"{name}: {expected}, got {each.color_by!r}")
        if self.state.slices.volume not in (None, *keys):
            raise ValueError(f"{name}: slices: expected the key of a source, got {self.state.slices.volume!r}")


def sources_of(document, state):
    """The sources that a state shows."""
    used = state.named_sources()
    return [source for source in document if source.key in used]


def session_of(document, state, path_of=None):
    """The session of a document and a state with a camera.

    ``path_of(source)`` is the path of a source in the session; by default, that of its file.

    Raises
    ------
    ValueError
        If the state shows an object that was not read from a file, or is of an upload, whose files do not stay, or a
        surface that was given with parameters that a session cannot keep.
    """
    sources = sources_of(document, state)
    for source in sources:
        if source.path is None:
            raise ValueError(f"session: expected objects that were read from files, got {source.name} from memory")
        if lost := source.only_in_memory(state):
            raise ValueError(
                f"session: expected surfaces without parameters that it cannot keep, got {source.name} with "
                f"{', '.join(lost)}"
            )
        if source.within is not None and path_of is None:
            raise ValueError(f"session: expected files that stay, got {source.name} of an upload: save a bundle")
    place = path_of or (lambda source: source.path)
    return Session(
        FORMAT,
        tuple(SessionSource(each.key, place(each), each.read_options, each.model_options) for each in sources),
        state,
    )


def write_session(path, session):
    """Write a session; paths below its folder become relative to it."""
    folder = os.path.dirname(os.path.abspath(os.fspath(path)))
    sources = tuple(source.replace(path=_relative(source.path, folder)) for source in session.sources)
    with whole_file(path) as temporary, open(temporary, "w", encoding="utf-8") as file:
        file.write(session.replace(sources=sources).to_text())


def read_session(path):
    """Read a session; paths in it become absolute."""
    check_path(path)
    with open(path, encoding="utf-8-sig", errors="surrogateescape") as file:
        session = Session.from_text(file.read(), os.fspath(path))
    folder = os.path.dirname(os.path.abspath(os.fspath(path)))
    sources = tuple(source.replace(path=os.path.join(folder, source.path)) for source in session.sources)
    return session.replace(sources=sources)


def open_session(document, session, progress=None, folder=None, uploaded=False):
    """Read the files of a session into a document, and return its state with the document's keys.

    Parameters
    ----------
    document : Document
    session : Session
    progress : callable, optional
        ``progress(title, fraction)``.
    folder : str, optional
        The folder of the files that came with the session. They may refer to each other, but not to files elsewhere.
    uploaded : bool
        Whether a page uploaded the session. It may then name the files in the folder, also by their last name, and
        files that are open already.

    Raises
    ------
    ValueError
        Before anything is read, if an uploaded session names another file, and for a volume without a level, a mesh
        with one, and a mesh in the place of a volume.
    """
    check_kinds(session.state, {source.key: (source.path, is_mesh(source.path)) for source in session.sources})
    found = [_source(document, source, progress, folder, uploaded) for source in session.sources]
    opened: list[str] = []
    keys: dict[str, str] = {}
    try:
        for source, each in zip(session.sources, found):
            if callable(each):
                each = document.add(each)
                opened.append(each.key)
            keys[source.key] = each.key
    except BaseException:  # all of them or none
        for key in opened:
            document.remove(key)
        raise
    state = session.state.with_keys(keys)
    for each in state.objects:
        warn_of_level(document[each.source], each.level)
    return state


def warn_of_level(source, level):
    """Warn of an isosurface at a level that its volume does not have: nothing of it is seen."""
    try:
        if source.is_volume:
            source.check_level(level)
    except ValueError as error:
        warn(f"{error}: there is no surface")


def check_kinds(state, sources):
    """Check that isosurfaces are of volumes, and that values on surfaces and slices are.

    `sources` has the name of each source, and whether it is a mesh, by its key.
    """
    for each in state.objects:
        source, is_of_mesh = sources[each.source]
        if is_of_mesh and each.level is not None:
            raise ValueError(f"level: expected null, as {source} is a mesh, got {each.level:g}")
        if not is_of_mesh and each.level is None:
            raise ValueError(f"level: expected a number, as {source} is a volume, got null")
    values = [("color_by", each.color_by) for each in state.objects] + [("slices", state.slices.volume)]
    for name, key in values:
        source, is_of_mesh = sources.get(key, (None, False))
        if is_of_mesh:
            raise ValueError(f"{name}: expected the key of a volume, got {key!r} of the mesh {source}")


def _source(document, source, progress, folder, uploaded):
    """The open source, or the function that reads it, of a file in a session."""
    paths = [source.path]
    if uploaded:
        paths.append(os.path.join(folder, os.path.basename(source.path)))
    for path in paths:
        if folder is not None and os.path.exists(path) and is_inside(path, folder):
            return _reader(path, source, progress, _upload_of(path, folder))
    if not uploaded:
        return _reader(source.path, source, progress, None)
    for each in document:
        opened = json.loads(json.dumps([each.read_options, each.model_options]))  # with lists, as the session
        if each.path == source.path and opened == [source.read_options, source.model_options]:
            return each
    raise ValueError(
        f"session: expected files that are uploaded with it or open in the viewer, got {source.path}; "
        "isospline view --session opens files by name"
    )


def _reader(path, source, progress, within):
    return read_source(
        path,
        progress=progress,
        read_options=source.read_options,
        model_options=source.model_options,
        within=within,
    )


def _upload_of(path, folder):
    """The part of a session's folder that belongs to a file: in a bundle, each upload has a folder."""
    first = os.path.relpath(os.path.realpath(path), os.path.realpath(folder)).split(os.sep)[0]
    upload = os.path.join(folder, first)
    return upload if os.path.isdir(upload) else folder


def is_inside(path, folder):
    """Whether a path, after symbolic links, is in a folder or is the folder."""
    folder = os.path.realpath(folder)
    return os.path.commonpath([os.path.realpath(path), folder]) == folder


def _relative(path, folder):
    inside = os.path.commonpath([path, folder]) == folder
    return os.path.relpath(path, folder) if inside else path
