"""Sessions: which files are open and how they are shown, in a small text file."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass

from ..image import whole_file
from .checked import Checked, field, options, record, records, text
from .document import read_source
from .state import ViewState

#: What the first field of a session says.
FORMAT = "isospline session 1"


@dataclass(frozen=True)
class SessionSource(Checked):
    """A file under the key that states call it; its path is relative to the session's folder where it is below it."""

    key: str = field(text)
    path: str = field(text)
    read_options: dict = field(options, {})
    model_options: dict = field(options, {})


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
    sources: tuple = field(records(SessionSource), ())
    state: ViewState = field(record(ViewState), ViewState())

    def to_text(self):
        """JSON, laid out to be read."""
        return json.dumps(self.to_json(), indent=1) + "\n"

    @classmethod
    def from_text(cls, content, name="session"):
        """The session of a text."""
        try:
            data = json.loads(content)
        except (ValueError, RecursionError) as error:
            raise ValueError(f"{name}: expected a session of isospline, got text that is no JSON: {error}") from None
        if not isinstance(data, dict) or data.get("format") != FORMAT:
            raise ValueError(f"{name}: expected a session of isospline, whose format is {FORMAT!r}")
        session = cls.from_json(data, name)
        keys = {source.key for source in session.sources}
        for each in session.state.objects:
            if each.source not in keys:
                raise ValueError(f"{name}: expected a source of each object, got none for {each.source!r}")
        return session


def session_of(document, state):
    """The session of a document and a state that has a camera.

    Raises
    ------
    ValueError
        Where the state shows what was not read from a file.
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
    """Write a session; paths in it become relative to its folder where they are below it."""
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
    """Read the files of a session into a document, and return its state with the keys that they have there."""
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
