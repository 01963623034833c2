"""The state of a viewer in immutable records: objects and their looks, light, cuts, slices and the camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..cameras import OrthographicCamera, PerspectiveCamera
from ..clips import Box, HalfSpace
from ..colors import BACKGROUND, COLORS, CURVATURES
from .checked import (
    Checked,
    choice,
    color,
    count,
    field,
    flag,
    interval,
    number,
    optional,
    record,
    records,
    text,
    vector,
    whole,
)
from .measurements import Measurement

#: The lights of the viewer.
VIEWER_LIGHTS = ("studio", "phong", "outline", "ambient-occlusion", "path-trace")
#: Colour maps to choose from.
COLOR_MAPS = ("viridis", "magma", "coolwarm", "turbo", "gray", "cividis", "plasma", "RdBu")


@dataclass(frozen=True)
class ObjectState(Checked):
    """An isosurface of a volume, or a mesh.

    Attributes
    ----------
    id : int
        Unique to the object.
    source : str
        The key of the volume or the mesh.
    level : float or None
        The level of the isosurface; None for a mesh.
    largest : int or None
        The number of connected components of the isosurface's solid to keep; None keeps all.
    closed : bool
        Whether the isosurface's solid is closed at the border of the volume.
    body_level : float or None
        Only what is in the largest connected component at this level is shown: a patient without the table. None shows
        everything.
    color_by : str
        "color", "own", "normal", a curvature such as "mean-curvature", or the key of a volume. "own" is the rule that
        the object was given, or `color` without one.
    """

    id: int = field(whole)
    source: str = field(text)
    level: float | None = field(optional(number()), None)
    largest: int | None = field(optional(count), None)
    closed: bool = field(flag, True)
    body_level: float | None = field(optional(number()), None)
    color: str = field(color, COLORS[0])
    opacity: float = field(number(0, 1), 1.0)
    silhouette_opacity: float | None = field(optional(number(0, 1)), None)
    visible: bool = field(flag, True)
    color_by: str = field(text, "color")
    cmap: str = field(choice(*COLOR_MAPS), "coolwarm")
    limits: tuple[float, ...] | None = field(optional(interval), None)
    metallic: float = field(number(0, 1), 0.0)
    roughness: float = field(number(0, 1), 0.5)

    @property
    def is_seen(self):
        """Whether the object is visible."""
        return self.visible and (self.opacity > 0 or bool(self.silhouette_opacity))


@dataclass(frozen=True)
class ClipState(Checked):
    """A cut by a plane, which keeps the side that its normal points to, or by a box, which keeps its inside."""

    kind: str = field(choice("none", "plane", "box"), "none")
    point: tuple[float, ...] = field(vector(3), (0.0, 0.0, 0.0))
    normal: tuple[float, ...] = field(vector(3), (0.0, 1.0, 0.0))
    minimum: tuple[float, ...] = field(vector(3), (0.0, 0.0, 0.0))
    maximum: tuple[float, ...] = field(vector(3), (1.0, 1.0, 1.0))
    capped: bool = field(flag, True)
    values: bool = field(flag, False)

    def __post_init__(self):
        super().__post_init__()
        self.cuts()  # raises for a zero normal and for a box without volume

    @property
    def shows_values(self):
        """Whether caps have the colours of the volume's values."""
        return self.kind != "none" and self.capped and self.values

    def cuts(self):
        """The value for `Isosurface(clip=)`."""
        if self.kind == "plane":
            return [HalfSpace(self.point, self.normal)]
        if self.kind == "box":
            lower, upper = np.minimum(self.minimum, self.maximum), np.maximum(self.minimum, self.maximum)
            return [Box(lower, upper)]
        return None


@dataclass(frozen=True)
class SliceState(Checked):
    """Three slices through a point of a volume, and the values that they show as black and white."""

    shown: bool = field(flag, False)
    volume: str | None = field(optional(text), None)
    index: tuple[float, ...] = field(vector(3), (0.0, 0.0, 0.0))
    window: tuple[float, ...] | None = field(optional(vector(2)), None)


@dataclass(frozen=True)
class CameraState(Checked):
    """A perspective or an orthographic camera; `height` is the orthographic image's height in world units."""

    eye: tuple[float, ...] = field(vector(3))
    target: tuple[float, ...] = field(vector(3))
    up: tuple[float, ...] = field(vector(3))
    projection: str = field(choice("perspective", "orthographic"), "perspective")
    field_of_view: float = field(number(1, 150), 30.0)
    height: float = field(number(), 1.0)

    @classmethod
    def of(cls, camera, field_of_view=30.0):
        """The state of a camera that `camera_for` made."""
        vectors: dict[str, Any] = {name: tuple(map(float, getattr(camera, name))) for name in ("eye", "target", "up")}
        if isinstance(camera, OrthographicCamera):
            return cls(**vectors, projection="orthographic", height=camera.height, field_of_view=field_of_view)
        distance = float(np.linalg.norm(np.subtract(vectors["eye"], vectors["target"])))
        height = 2 * distance * float(np.tan(np.radians(camera.field_of_view) / 2))
        return cls(**vectors, field_of_view=camera.field_of_view, height=height)

    def __post_init__(self):
        super().__post_init__()
        self.camera()  # raises if it looks nowhere

    def camera(self):
        """The camera itself."""
        if self.projection == "orthographic":
            return OrthographicCamera(self.eye, self.target, self.up, height=self.height)
        return PerspectiveCamera(self.eye, self.target, self.up, self.field_of_view)


@dataclass(frozen=True)
class ViewState(Checked):
    """Everything that determines a picture, except its size, and the measurements."""

    objects: tuple[ObjectState, ...] = field(records(ObjectState), ())
    light: str = field(choice(*VIEWER_LIGHTS), "studio")
    shadows: bool = field(flag, False)
    exponent: float = field(number(0.1, 100), 2.0)
    background: str = field(color, BACKGROUND)
    clip: ClipState = field(record(ClipState), ClipState())
    slices: SliceState = field(record(SliceState), SliceState())
    camera: CameraState | None = field(optional(record(CameraState)), None)
    measurements: tuple[Measurement, ...] = field(records(Measurement), ())

    def __post_init__(self):
        super().__post_init__()
        for kind, parts in (("object", self.objects), ("measurement", self.measurements)):
            ids = set()
            for each in parts:
                if each.id in ids:
                    raise ValueError(f"id: expected one of its own for each {kind}, got {each.id} of several")
                ids.add(each.id)

    def object(self, id):
        """The object with an id."""
        for each in self.objects:
            if each.id == id:
                return each
        raise ValueError(f"id: expected the id of an object in the view, got {id!r}")

    def with_object(self, id, **changes):
        """The same state with changes to an object."""
        changed = self.object(id).replace(**changes)
        return self.replace(objects=tuple(changed if each.id == id else each for each in self.objects))

    def without_object(self, id):
        """The same state without an object."""
        gone = self.object(id)
        return self.replace(objects=tuple(each for each in self.objects if each is not gone))

    def with_keys(self, keys):
        """The same state with other keys of sources; what is made of sources without a new key is left out."""

        def color_by(rule):
            return rule if rule in COLOR_RULES else keys.get(rule, "color")

        objects = tuple(
            each.replace(source=keys[each.source], color_by=color_by(each.color_by))
            for each in self.objects
            if each.source in keys
        )
        gone = {each.id for each in self.objects} - {each.id for each in objects}
        measurements = tuple(each for each in self.measurements if gone.isdisjoint(each.objects))
        slices = self.slices.replace(volume=keys.get(self.slices.volume))
        return self.replace(objects=objects, slices=slices, measurements=measurements)

    def named_sources(self):
        """The keys of the sources that the state names."""
        rules = {each.color_by for each in self.objects}.difference(COLOR_RULES)
        return {each.source for each in self.objects} | rules | {self.slices.volume} - {None}

    def with_new_object(self, source, level=None, **look):
        """The same state with one more object, in its own colour."""
        measured = {id for each in self.measurements for id in each.objects}
        id = max({each.id for each in self.objects} | measured, default=-1) + 1
        look.setdefault("color", COLORS[id % len(COLORS)])
        return self.replace(objects=(*self.objects, ObjectState(id=id, source=source, level=level, **look)))


#: The sources of an object's colour, besides the keys of volumes.
COLOR_RULES = ("color", "own", "normal", *CURVATURES)
