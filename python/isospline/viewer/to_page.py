"""What the viewer tells its pages. tools/write_page_types.py writes it down for the page's type checker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .checked import Checked
from .measurements import MeasuredPoint
from .messages import kind_of, one_of
from .state import CameraState, ViewState

TO_PAGE: dict[str, Any] = {}


@dataclass(frozen=True)
class Steps:
    """Whether there is something to undo, and to redo."""

    undo: bool
    redo: bool


@one_of(TO_PAGE)
class State:
    """The state that is shown, with what pages cannot know; `input` is the newest change that it contains."""

    input: int
    state: ViewState
    default_limits: dict[int, tuple[float, ...] | None]
    results: tuple[float | None, ...]
    history: Steps


@dataclass(frozen=True)
class SourceAbout:
    """An open volume or mesh."""

    key: str
    name: str
    kind: str
    bounds: tuple[tuple[float, ...], ...]
    faces: int | None = None
    range: tuple[float, ...] | None = None
    suggested_levels: tuple[float, ...] = ()
    level_range: tuple[float, ...] | None = None
    spacing_of_values: float = 0.0
    histogram: tuple[float, ...] = ()
    counts: tuple[int, ...] = ()
    affine: tuple[tuple[float, ...], ...] = ()
    window: tuple[float, ...] | None = None
    patient: bool = False
    unit: str = ""
    body_level: float | None = None
    has_rule: bool = False


@one_of(TO_PAGE)
class Document:
    sources: tuple[SourceAbout, ...]


@one_of(TO_PAGE)
class CameraMoved:
    camera: CameraState


@one_of(TO_PAGE)
class Options:
    """What the page may choose from; `run` differs between viewers."""

    run: str
    color_maps: dict[str, tuple[str, ...]]
    color_rules: tuple[str, ...]


@one_of(TO_PAGE)
class SamePicture:
    """A change did not change the picture: it is the one of another number."""

    before: int
    input: int


@one_of(TO_PAGE)
class Error:
    text: str


@one_of(TO_PAGE)
class Progress:
    """Of a long task; a title of None ends it."""

    title: str | None
    fraction: float


@one_of(TO_PAGE)
class Measured:
    """The answer to `Pick`; None is the background."""

    point: MeasuredPoint | None


@one_of(TO_PAGE)
class Sampled:
    """The answer to `Sample`."""

    index: tuple[float, ...]
    value: float


@one_of(TO_PAGE)
class Raw:
    """A question for the shape (nz, ny, nx) and the type of a file of samples alone, with what is suggested."""

    number: int
    name: str
    size: int
    shape: tuple[int, ...] | None
    dtype: str | None


@one_of(TO_PAGE)
class Uploaded:
    """The files of an upload have been opened, or an error has been told."""


@one_of(TO_PAGE)
class Frame:
    """A picture of some objects; it is followed by its file.

    `samples` is 0 in movement; `scales` are those of volumes in stores.
    """

    input: int
    size: tuple[int, ...]
    camera: CameraState
    format: str
    samples: int
    final: bool
    objects: int
    scales: tuple[int, ...]
    milliseconds: tuple[float, ...]


@one_of(TO_PAGE)
class SliceValues:
    """Values of slices follow, float32: of each, the corners of the part, in grid coordinates, and rows and columns."""

    volume: str
    index: tuple[float, ...]
    regions: tuple[tuple[tuple[float, ...], ...], ...]
    shapes: tuple[tuple[int, ...], ...]


@one_of(TO_PAGE)
class File:
    """A file to save follows."""

    name: str


def to_message(message):
    """A message to the page as a dict for JSON."""
    return {"type": kind_of(type(message)), **_plain(message)}


def _plain(value):
    if isinstance(value, Checked):
        return value.to_json()
    if hasattr(value, "__dataclass_fields__"):
        return {name: _plain(getattr(value, name)) for name in value.__dataclass_fields__}
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    return [_plain(each) for each in value] if isinstance(value, (tuple, list)) else value
