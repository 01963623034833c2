"""Materials as parameters of shadings."""

from __future__ import annotations

import numbers
from collections.abc import Mapping
from typing import Any

from ..base.mistakes import sentence
from ..looks import Material
from ..scene import Isosurface, Mesh

#: A Phong shading that shows colours as they are, so that values can be read off a colour bar.
UNLIT: dict[str, Any] = {"lights": [], "ambient": 1, "diffuse": 0, "specular": 0}


def names_in_shadings(material: Material) -> list[str]:
    """The parameters of a shading that a material determines."""
    names = [name for name in ("color", "cap_color", "silhouette_opacity") if getattr(material, name) is not None]
    if material.opacity < 1:
        names.append("opacity")
    if material.silhouette_opacity is not None:
        names.append("silhouette_exponent")
    return names


def is_translucent(look: Any) -> bool:
    """Whether a material or a shading shows what is behind it."""
    return bool(look.opacity < 1 or look.silhouette_opacity is not None)


def check_materials(materials: Any) -> dict[Any, Material]:
    """Check a dict of objects or their geometry ids to materials, and copy it."""
    keys = (Isosurface, Mesh, numbers.Integral)
    is_fit = isinstance(materials, Mapping) and all(
        isinstance(key, keys) and isinstance(each, Material) for key, each in materials.items()
    )
    if not is_fit:
        raise TypeError(sentence("materials", "a dict of objects or geometry ids to Material", materials))
    return dict(materials)
