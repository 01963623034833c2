"""Sessions: the open files and the displayed state, in a small text file."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from typing import Any

from ..image import whole_file
from .checked import Checked, field, options, record, records, text
from .document import read_source
from .state import ViewState

#: The value of a session's first field.
FORMAT = "isospline session 1"


@dataclass(frozen=True)
class SessionSource(Checked):
    """A file and its key in states; its path is relative if it is below the session's folder."""

    key: str = field(text)
    path: str = field(text)
    read_options: dict[str, Any] = field(options, {})
    model_options: dict[str, Any] = field(options, {})


@dataclass(frozen=True)
class Session(Checked):
    """Files and a state.

    Examples
    --------
    >>> from isospline.viewer.session import Session, SessionSource
    >>> from isospline.viewer.state import ViewState
    >>> session = Session("isospline session 1", (SessionSource("source1", "head.nii.gz"),), ViewState())
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
        keys = {source.key for source in session.sources}
        for each in session.state.objects:
            if each.source not in keys:
                raise ValueError(f"{name}: expected a source for each object, got none for {each.source!r}")
        return session


def session_of(document, state):
    """The session of a document and a state with a camera.

    Raises
    ------
    ValueError
        If the state shows an object that was not read from a file.
    """
    used = {each.source for each in state.objects} | {each.color_by for each in state.objects} | {state.slices.volume}
    sources = [source for source in document if source.key in used]
    for source in sources:
        if source.path is None:
            raise ValueError(f"session: expected objects that were read from files, got {source.name} from memory")
    return Session(
        FORMAT,
        tuple(SessionSource(each.key, each.path, each.read_options, each.model_options) for each in sources),
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
    with open(path, encoding="utf-8", errors="surrogateescape") as file:
        session = Session.from_text(file.read(), os.fspath(path))
    folder = os.path.dirname(os.path.abspath(os.fspath(path)))
    sources = tuple(source.replace(path=os.path.join(folder, source.path)) for source in session.sources)
    return session.replace(sources=sources)


def open_session(document, session, progress=None):
    """Read the files of a session into a document, and return its state with the document's keys."""
    keys = {}
    for source in session.sources:
        make = read_source(
            source.path, progress=progress, read_options=source.read_options, model_options=source.model_options
        )
        keys[source.key] = document.add(make).key
    state = session.state
    objects = tuple(
        each.replace(source=keys[each.source], color_by=keys.get(each.color_by, each.color_by))
        for each in state.objects
    )
    slices = state.slices.replace(volume=keys.get(state.slices.volume))
    return state.replace(objects=objects, slices=slices)


def _relative(path, folder):
    inside = os.path.commonpath([path, folder]) == folder
    return os.path.relpath(path, folder) if inside else path
