"""Merging of pictures of a scene's parts: the nearest hit of a ray in all parts counts (sort-last).

S. Molnar et al., "A sorting classification of parallel rendering", IEEE Computer Graphics and Applications 14(4), 1994.
Of several hits at the same t, the one with the smallest geometry id, then primitive id, counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..looks import Phong
from ..picture.image import Image
from ..scene import Scene
from .windows import image_of


@dataclass(frozen=True)
class Fragments:
    """Hits of some rays: the index of each ray in a list, its t and ids, and further bytes or numbers."""

    places: NDArray[np.int64]
    t: NDArray[np.float64]
    geometry_ids: NDArray[np.uint32]
    primitive_ids: NDArray[np.uint64]
    values: NDArray[Any]

    @property
    def nbytes(self) -> int:
        """Bytes that are sent between workers."""
        return sum(column.nbytes for column in vars(self).values())


@dataclass(frozen=True)
class PartOfPicture:
    """A window of a picture, rendered from a part of the scene."""

    colors: Fragments  #: (n, 3) numbers, for all samples with a weight
    layers: Fragments  #: bytes of all layers, for the rays through the centres

    def __sizeof__(self) -> int:
        return self.colors.nbytes + self.layers.nbytes


def render_part(scene: Scene, camera: Any, options: dict[str, Any]) -> PartOfPicture:
    """Render a part of a picture's scene; options are those of `_core.render_part`."""
    image, found = _core.render_part(scene, camera, progress=None, **options)
    weighted = np.asarray(found["weights"]) > 0
    columns = [found[name] for name in ("t", "geometry_ids", "primitive_ids")]
    colors = _compact([column[weighted] for column in columns], found["colors"][weighted])
    state = image.__getstate__()
    pixels = found["t"].shape[1]
    layers = [layer.reshape(pixels, -1) for name, layer in state["layers"].items() if name not in ("color", "srgb8")]
    of_centers = np.concatenate(layers, axis=1) if layers else np.zeros((pixels, 0), np.uint8)
    centers = slice(0, 1 if layers else 0)
    return PartOfPicture(colors, _compact([column[centers] for column in columns], of_centers))


def _compact(columns, values):
    """Select the rays that hit."""
    t, geometry_ids, primitive_ids = (column.ravel() for column in columns)
    places = np.flatnonzero(t < np.inf)
    values = values.reshape(math.prod(values.shape[:-1]), values.shape[-1])[places]
    return Fragments(places, t[places], geometry_ids[places], primitive_ids[places], values)


def merge(parts: list[PartOfPicture]) -> PartOfPicture:
    """The nearest hits of several parts."""
    return PartOfPicture(_nearest([part.colors for part in parts]), _nearest([part.layers for part in parts]))


def _nearest(parts):
    columns = {name: np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])}
    order = np.lexsort([columns[name] for name in ("primitive_ids", "geometry_ids", "t", "places")])
    places = columns["places"][order]
    is_first = np.ones(len(places), bool)
    is_first[1:] = places[1:] != places[:-1]
    return Fragments(**{name: column[order[is_first]] for name, column in columns.items()})


def compose(parts: list[PartOfPicture], camera: Any, options: dict[str, Any]) -> Image:
    """The image of a window from all parts of the scene, by the same operations as in the core, in the same order."""
    merged = merge(parts)
    blank_options = options | {"background": None, "shading": Phong(), "encoding": "linear"}
    blank, found = _core.render_part(Scene(), camera, progress=None, **blank_options)
    state = blank.__getstate__()
    pixels = found["t"].shape[1]

    sums = np.zeros((pixels, 4))
    weights = [weight for weight in found["weights"] if weight > 0]
    bounds = np.searchsorted(merged.colors.places, pixels * np.arange(len(weights) + 1))
    for sample, weight in enumerate(weights):
        rows = slice(*bounds[sample : sample + 2])
        at = merged.colors.places[rows] - sample * pixels
        sums[at, :3] += weight * merged.colors.values[rows]
        sums[at, 3] += weight
    red, green, blue, opacity = _core.background_color(options["background"])
    coverage = np.where(np.abs(sums[:, 3] - 1) < 1e-9, 1.0, sums[:, 3])
    behind = (1 - coverage) * opacity
    color = np.c_[sums[:, :3] + behind[:, None] * np.array([red, green, blue]), coverage + behind].astype(np.float32)

    layers, begin = {}, 0
    for name, layer in state["layers"].items():
        if name == "color":
            continue
        each = layer.reshape(pixels, -1).copy()
        each[merged.layers.places] = merged.layers.values[:, begin : begin + each.shape[1]]
        begin += each.shape[1]
        layers[name] = each.ravel()
    state["covered_count"] = int(np.count_nonzero(sums[:, 3] > 0))
    image = image_of(state, layers | {"color": color.view(np.uint8).ravel()})
    if options["encoding"] == "linear":
        return image
    return image_of(state, layers | {"srgb8": image.to_srgb().ravel()})
