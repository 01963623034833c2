"""The layers of images by name: those of the compiled module, and the mask, which is made of the geometry ids."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from .. import _core

MASK, IDS = "mask", "geometry_ids"
#: The names of all layers.
LAYERS = (*_core.LAYERS, MASK)


def names_of(layers: Any) -> tuple[str, ...] | Any:
    """Names of layers as a tuple; anything but a sequence of names as it is, for the compiled module's error."""
    if isinstance(layers, str) or not isinstance(layers, Iterable):
        return layers
    names = tuple(layers)
    for name in names:
        if isinstance(name, str) and name not in LAYERS:
            known = ", ".join(f'"{each}"' for each in LAYERS)
            raise ValueError(f'layers: expected names among {known}, got "{name}"')
    return names


def compiled(names: Any) -> Any:
    """The layers that the compiled module has to make for the names of `names_of`: ids in place of the mask."""
    if isinstance(names, tuple) and MASK in names:
        return (*(name for name in names if name not in (MASK, IDS)), IDS)
    return names
