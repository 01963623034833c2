"""Measurements on surfaces: points, distances, angles and thicknesses, and their table."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass

import numpy as np

from .checked import Checked, choice, field, number, optional, records, vector, whole

#: The number of points that each tool measures.
TOOLS = {"point": 1, "distance": 2, "angle": 3, "thickness": 1}


@dataclass(frozen=True)
class MeasuredPoint(Checked):
    """A point of a surface, in world units.

    Attributes
    ----------
    object : int
        Id of the object in the state.
    position, normal : (3,) tuple of float
    index : (3,) tuple of float or None
        Position in the volume's grid, of a store that of its finest scale; None on a mesh, like value and curvatures.
    value : float or None
        The value of the volume's model at the point.
    mean_curvature, gaussian_curvature : float or None
    thickness : float or None
        Thickness of the wall, in world units. On an isosurface, the diameter of the largest ball in the solid that
        touches the point. On a mesh or a cap, the distance straight through the wall to its other side. None if there
        is no other side.
    """

    object: int = field(whole)
    position: tuple[float, ...] = field(vector(3))
    normal: tuple[float, ...] = field(vector(3))
    index: tuple[float, ...] | None = field(optional(vector(3)), None)
    value: float | None = field(optional(number()), None)
    mean_curvature: float | None = field(optional(number()), None)
    gaussian_curvature: float | None = field(optional(number()), None)
    thickness: float | None = field(optional(number()), None)


@dataclass(frozen=True)
class Measurement(Checked):
    """The points of a tool, up to as many as it measures.

    Attributes
    ----------
    id : int
        Unique to the measurement.
    tool : str
        A key of `TOOLS`.
    points : tuple of MeasuredPoint
    """

    id: int = field(whole)
    tool: str = field(choice(*TOOLS))
    points: tuple[MeasuredPoint, ...] = field(records(MeasuredPoint))

    def __post_init__(self):
        super().__post_init__()
        if not 1 <= len(self.points) <= TOOLS[self.tool]:
            raise ValueError(f"points: expected 1 to {TOOLS[self.tool]} of a {self.tool}, got {len(self.points)}")

    @property
    def is_complete(self):
        return len(self.points) == TOOLS[self.tool]

    @property
    def objects(self):
        """The ids of the objects that have its points."""
        return {each.object for each in self.points}

    @property
    def result(self):
        """The distance or the thickness in world units, or the angle at the second point in degrees.

        None while points are missing, of a single point, and of an angle with two points at one place.
        """
        places = [each.position for each in self.points]
        if not self.is_complete or self.tool == "point":
            return None
        if self.tool == "thickness":
            return self.points[0].thickness
        if self.tool == "distance":
            distance = math.dist(*places)
            return distance if math.isfinite(distance) else None
        sides = [np.subtract(place, places[1]) for place in (places[0], places[2])]
        if not all(each.any() for each in sides):
            return None
        a, b = (each / np.abs(each).max() for each in sides)
        return math.degrees(math.atan2(np.linalg.norm(np.cross(a, b)), a @ b))


def with_point(measurements, tool, point):
    """The measurements with one more point: of the last one, if it is of the same tool and not complete."""
    *others, last = measurements or (None,)
    if last is not None and last.tool == tool and not last.is_complete:
        return (*others, last.replace(points=(*last.points, point)))
    return (*measurements, Measurement(1 + max((each.id for each in measurements), default=0), tool, (point,)))


def to_csv(measurements, names):
    """A table of measurements as CSV, a row for each point; `names` has the objects' names by their ids.

    Distances and angles are in the row of their last point.
    """
    vectors = ("position", "normal", "index")
    scalars = ("value", "mean_curvature", "gaussian_curvature", "thickness")
    places = [f"{name}_{axis}" for name in vectors for axis in "xyz"]
    columns = ["measurement", "tool", "object", *places, *scalars, "distance", "angle"]
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(columns)
    for count, each in enumerate(measurements, 1):
        for point in each.points:
            row = [count, each.tool, names.get(point.object, point.object)]
            for name in vectors:
                row += getattr(point, name) or (None,) * 3
            row += [getattr(point, name) for name in scalars]
            row += [each.result if point is each.points[-1] and each.tool == tool else None for tool in columns[-2:]]
            writer.writerow(["" if value is None else value for value in row])
    return file.getvalue()
