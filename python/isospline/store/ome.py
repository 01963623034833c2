"""OME-Zarr metadata of the samples in a store."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

VERSION = "0.5"

#: What OME-Zarr's RFC-4 calls the axes of a patient, x, y and z of LPS, and the same axes the other way.
_ORIENTATIONS = (
    ("right-to-left", "left-to-right"),
    ("anterior-to-posterior", "posterior-to-anterior"),
    ("inferior-to-superior", "superior-to-inferior"),
)


def multiscales(name: str, levels: list[dict[str, Any]], unit: str | None, patient: bool) -> dict[str, Any]:
    """The attribute "ome" of a store: its levels' samples along their own axes, which may be turned in the world."""
    orientations = _orientations(levels[0]["direction"]) if patient else None
    axes: list[dict[str, Any]] = [{"name": axis, "type": "space"} for axis in "zyx"]
    for number, axis in enumerate(reversed(axes)):
        if unit:
            axis["unit"] = unit
        if orientations:
            axis["orientation"] = {"type": "anatomical", "value": orientations[number]}
    datasets = []
    for number, level in enumerate(levels):
        translation = np.linalg.solve(np.array(level["direction"]), np.array(level["origin"]))
        datasets.append(
            {
                "path": str(number),
                "coordinateTransformations": [
                    {"type": "scale", "scale": level["spacing"][::-1]},
                    {"type": "translation", "translation": translation[::-1].tolist()},
                ],
            }
        )
    return {"version": VERSION, "multiscales": [{"name": name, "axes": axes, "datasets": datasets}]}


def _orientations(direction: ArrayLike) -> list[str] | None:
    """What the axes x, y and z run along in a patient; None where one is farther than 45 degrees from all of his."""
    turned = np.asarray(direction, float)
    nearest = np.abs(turned).argmax(axis=0)
    along = turned[nearest, range(3)]
    if sorted(nearest) != [0, 1, 2] or np.abs(along).min() < 2**-0.5:
        return None
    return [_ORIENTATIONS[axis][int(cosine < 0)] for axis, cosine in zip(nearest, along)]


def direction_of(axes: list[dict[str, Any]]) -> NDArray[np.float64] | None:
    """The directions in a patient, LPS, of the axes x, y and z of an image; None where it does not tell them all."""
    direction = np.zeros((3, 3))
    for number, axis in enumerate(axes):
        orientation = axis.get("orientation")
        value = orientation.get("value") if isinstance(orientation, dict) else None
        for patient_axis, values in enumerate(_ORIENTATIONS):
            if value in values:
                direction[patient_axis, number] = 1 - 2 * values.index(value)
    return direction if np.linalg.det(direction) else None
