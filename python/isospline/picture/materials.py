"""Materials as parameters of shadings."""

from __future__ import annotations

import numbers
from collections.abc import Mapping
from typing import Any

from .. import _core
from ..base.mistakes import sentence
from ..base.values import part
from ..looks import Material

#: A Phong shading that shows colours as they are, so that values can be read off a colour bar.
UNLIT: dict[str, Any] = {"lights": [], "ambient": 1, "diffuse": 0, "specular": 0}


def look_of(material: Material) -> dict[str, Any]:
    """The parameters of a shading that a material determines."""
    look: dict[str, Any] = {}
    for name in ("color", "cap_color", "silhouette_opacity"):
        value = part(material, name)
        if value is not None:
            look[name] = value
    if material.opacity < 1:
        look["opacity"] = material.opacity
    if "silhouette_opacity" in look:
        look["silhouette_exponent"] = material.silhouette_exponent
    return look


def check_materials(materials: Any) -> dict[Any, Material]:
    """Check a dict of objects or their geometry ids to materials, and copy it."""
    keys = (_core.Isosurface, _core.Mesh, numbers.Integral)
    is_fit = isinstance(materials, Mapping) and all(
        isinstance(key, keys) and isinstance(each, Material) for key, each in materials.items()
    )
    if not is_fit:
        raise TypeError(sentence("materials", "a dict of objects or geometry ids to Material", materials))
    return dict(materials)
