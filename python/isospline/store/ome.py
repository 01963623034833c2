"""OME-Zarr metadata of the samples in a store."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

VERSION = "0.5"

#: Symbols of units by their names in OME-Zarr.
UNITS = {
    "angstrom": "Å",
    "nanometer": "nm",
    "micrometer": "µm",
    "millimeter": "mm",
    "centimeter": "cm",
    "meter": "m",
}
_NAMES = {**{symbol: name for name, symbol in UNITS.items()}, "um": "micrometer"}

#: The names that OME-Zarr's RFC-4 has for the directions x, y and z of LPS, each with that of the opposite direction.
_ORIENTATIONS = (
    ("right-to-left", "left-to-right"),
    ("anterior-to-posterior", "posterior-to-anterior"),
    ("inferior-to-superior", "superior-to-inferior"),
)


def name_of_unit(symbol: str | None) -> str | None:
    """The name of a unit in OME-Zarr; the symbol itself if OME-Zarr has none, and None if it is empty."""
    return _NAMES.get(symbol, symbol) if symbol else None


def multiscales(name: str, levels: list[dict[str, Any]], unit: str | None, patient: bool) -> dict[str, Any]:
    """The attribute "ome" of a store, about the samples of its levels.

    OME-Zarr 0.5 has no rotations, so the coordinates are lengths along the axes of the samples, which may be rotated in
    the world.
    """
    direction = np.array(levels[0]["direction"])
    lengths = np.linalg.norm(direction, axis=0)
    lengths[np.abs(lengths - 1) < 1e-6] = 1  # directions of files are rounded
    orientations = _orientations(direction / lengths) if patient else None
    axes: list[dict[str, Any]] = [{"name": axis, "type": "space"} for axis in "zyx"]
    for number, axis in enumerate(reversed(axes)):
        if unit:
            axis["unit"] = unit
        if orientations:
            axis["orientation"] = {"type": "anatomical", "value": orientations[number]}
    datasets = []
    for number, level in enumerate(levels):
        scale, translation = level["spacing"] * lengths, np.linalg.solve(direction / lengths, level["origin"])
        datasets.append(
            {
                "path": str(number),
                "coordinateTransformations": [
                    {"type": "scale", "scale": scale[::-1].tolist()},
                    {"type": "translation", "translation": translation[::-1].tolist()},
                ],
            }
        )
    return {"version": VERSION, "multiscales": [{"name": name, "axes": axes, "datasets": datasets}]}


def _orientations(direction: ArrayLike) -> list[str] | None:
    """The patient's directions that are nearest to the axes x, y and z; None if one is not within 45 degrees."""
    columns = np.asarray(direction, float)
    nearest = np.abs(columns).argmax(axis=0)
    cosines = columns[nearest, range(3)]
    if sorted(nearest) != [0, 1, 2] or np.abs(cosines).min() < 2**-0.5:
        return None
    return [_ORIENTATIONS[axis][int(cosine < 0)] for axis, cosine in zip(nearest, cosines)]


def direction_of(axes: list[dict[str, Any]]) -> NDArray[np.float64] | None:
    """The directions of an image's axes x, y and z in LPS, as columns; None if the image does not have all three."""
    direction = np.zeros((3, 3))
    for number, axis in enumerate(axes):
        orientation = axis.get("orientation")
        value = orientation.get("value") if isinstance(orientation, dict) else None
        for patient_axis, values in enumerate(_ORIENTATIONS):
            if value in values:
                direction[patient_axis, number] = 1 - 2 * values.index(value)
    return direction if np.linalg.det(direction) else None
