"""Colours of glTF in the precision of the file: trimesh makes 8 bits of floats, and takes the last 8 of 16 bits."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

# An attribute of an application, which trimesh leaves as it is.
_NAME = "_LINEAR_COLORS"
_HEADER_SIZE = 20  # of a binary file: magic number, version, length, and length and type of the chunk of JSON


def with_renamed_colors(content: bytes) -> bytes:
    """The content of a glTF file, with another name of its colours. `take_colors` then finds them."""
    is_binary = content[:4] == b"glTF"
    begin = _HEADER_SIZE if is_binary else 0
    end = begin + int.from_bytes(content[12:16], "little") if is_binary else len(content)
    tree = json.loads(content[begin:end])
    parts = [part for mesh in tree.get("meshes", ()) for part in mesh["primitives"]]
    # Draco, which compresses the arrays of a part, has their names once more.
    compressed = [part.get("extensions", {}).get("KHR_draco_mesh_compression", {}) for part in parts]
    colored = [each["attributes"] for each in [*parts, *compressed] if "COLOR_0" in each.get("attributes", ())]
    if not colored:
        return content
    for attributes in colored:
        attributes[_NAME] = attributes.pop("COLOR_0")
    text = json.dumps(tree).encode()
    if not is_binary:
        return text
    text += b" " * (-len(text) % 4)
    length = int.from_bytes(content[8:12], "little") - (end - begin) + len(text)
    numbers = (number.to_bytes(4, "little") for number in (length, len(text)))
    return content[:8] + b"".join(numbers) + content[16:begin] + text + content[end:]


def take_colors(scene: Any) -> None:
    """Make colours of the renamed attributes, for `Mesh.from_trimesh`: linear, as in the file."""
    from trimesh.visual import TextureVisuals

    for shape in scene.geometry.values():
        stored = getattr(shape, "vertex_attributes", {}).pop(_NAME, None)
        if stored is None:
            continue
        largest = np.iinfo(stored.dtype).max if stored.dtype.kind == "u" else 1
        if shape.visual.kind != "texture":
            shape.visual = TextureVisuals()  # other visuals have 8 bits
        shape.visual.vertex_attributes["color"] = np.clip(stored.astype(float) / largest, 0, 1)
