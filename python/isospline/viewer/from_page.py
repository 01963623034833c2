"""What pages tell the viewer. tools/write_page_types.py writes it down for the page's type checker."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from .checked import (
    Checked,
    choice,
    count,
    field,
    flag,
    number,
    optional,
    options,
    record,
    records,
    text,
    vector,
    whole,
)
from .measurements import TOOLS
from .messages import one_of
from .save import SAVED
from .slices import SliceView
from .state import CameraState, ObjectState, ViewState

#: The largest width or height, in pixels, of a picture that a page may request.
LARGEST = 4096
#: The fields of the state that pages may change directly.
CHANGEABLE = ("light", "shadows", "exponent", "background", "clip", "slices")
#: The fields of objects that they may change.
OF_OBJECTS = tuple(each.name for each in fields(ObjectState) if each.name not in ("id", "source"))

FROM_PAGE: dict[str, Any] = {}


def _side(value, name):
    if count(value, name) > LARGEST:
        raise ValueError(f"{name}: expected 1 to {LARGEST} pixels, got {value}")
    return value


def _shape(value, name):
    vector(3)(value, name)
    return tuple(count(each, name) for each in value)


# A message that may change the picture has a number beside its fields, `input`.


@one_of(FROM_PAGE)
class Size(Checked):
    """The picture has another size."""

    width: int = field(_side)
    height: int = field(_side)


@one_of(FROM_PAGE)
class Hello(Size):
    """A page has connected. Its picture has this size."""


@one_of(FROM_PAGE)
class Acknowledge(Checked):
    """A picture has arrived, or slices."""

    slices: bool = field(flag, False)


@one_of(FROM_PAGE)
class Camera(Checked):
    """The camera has moved."""

    camera: CameraState = field(record(CameraState))


@one_of(FROM_PAGE)
class Look(Checked):
    """Look from a side, as `camera_for` names it, or at everything, "home"."""

    view: str = field(text)


@one_of(FROM_PAGE)
class Change(Checked):
    """Change fields of the state."""

    changes: dict[str, Any] = field(options(*CHANGEABLE))


@one_of(FROM_PAGE)
class ChangeObject(Checked):
    """Change fields of an object."""

    id: int = field(whole)
    changes: dict[str, Any] = field(options(*OF_OBJECTS))


@one_of(FROM_PAGE)
class AddObject(Checked):
    """Add a surface at a level, or a mesh."""

    source: str = field(text)
    level: float | None = field(optional(number()), None)


@one_of(FROM_PAGE)
class RemoveObject(Checked):
    id: int = field(whole)


@one_of(FROM_PAGE)
class Close(Checked):
    """Close a volume or a mesh."""

    source: str = field(text)


@one_of(FROM_PAGE)
class Undo(Checked):
    pass


@one_of(FROM_PAGE)
class Redo(Checked):
    pass


@one_of(FROM_PAGE)
class Sample(Checked):
    """Tell the value of a volume's model at a point, in grid coordinates."""

    volume: str = field(text)
    index: tuple[float, ...] = field(vector(3))


@one_of(FROM_PAGE)
class SliceViews(Checked):
    """Other parts of the three slices are seen."""

    views: tuple[SliceView, ...] = field(records(SliceView))

    def __post_init__(self):
        super().__post_init__()
        if len(self.views) != 3:
            raise ValueError(f"views: expected 3, got {len(self.views)}")


@one_of(FROM_PAGE)
class Pick(Checked):
    """Measure the point at a pixel with a tool."""

    x: float = field(number())
    y: float = field(number())
    tool: str = field(choice(*TOOLS), "point")


@one_of(FROM_PAGE)
class RemoveMeasurement(Checked):
    id: int = field(whole)


@one_of(FROM_PAGE)
class ClearMeasurements(Checked):
    pass


@one_of(FROM_PAGE)
class Save(Checked):
    """Make a file for the page to save. The options are those of `save.save`."""

    what: str = field(choice(*SAVED, "measurements"))
    options: dict[str, Any] = field(
        options("width", "height", "transparent", "measurements", "pictures", "samples"), {}
    )


@dataclass(frozen=True)
class NamedSource(Checked):
    key: str = field(text)
    name: str = field(text)


@one_of(FROM_PAGE)
class Restore(Checked):
    """Show what was shown by another viewer, as far as files of the same names are open."""

    sources: tuple[NamedSource, ...] = field(records(NamedSource))
    state: ViewState = field(record(ViewState))


@dataclass(frozen=True)
class UploadedFile(Checked):
    name: str = field(text)
    size: int = field(whole)


@one_of(FROM_PAGE)
class Upload(Checked):
    """The bytes of files follow, one file after the other: names and sizes."""

    files: tuple[UploadedFile, ...] = field(records(UploadedFile))


@dataclass(frozen=True)
class RawOptions(Checked):
    """Options of `read_volume` for a file of samples alone."""

    shape: tuple[int, ...] = field(_shape)
    dtype: str = field(text)
    offset: int = field(whole, 0)
    spacing: tuple[float, ...] = field(vector(3), (1.0, 1.0, 1.0))


@one_of(FROM_PAGE)
class OpenRaw(Checked):
    """The answer to `Raw`; None leaves the file out."""

    number: int = field(whole)
    options: RawOptions | None = field(optional(record(RawOptions)), None)
