"""What trimesh misreads in glTF: colours, sparse and normalized numbers, fans, and extensions that it does not know.

It makes 8 bits of colours that are floats, and takes the last 8 of 16 bits. So attributes get further names, with which
it hands out their arrays as they are in the file.
"""

from __future__ import annotations

import json
import re
from importlib import import_module
from typing import Any

import numpy as np

# trimesh leaves attributes of applications, which begin with a line, as they are.
_PREFIX = "_ISOSPLINE_"
_HEADER_SIZE = 20  # of a binary file: magic number, version, length, and length and type of the chunk of JSON
_DRACO = "KHR_draco_mesh_compression"
# Extensions that may be required: trimesh reads those of arrays, others are of what a mesh does not have.
_ARRAYS, _LOOK = ("KHR_mesh_quantization", _DRACO), r"[A-Z]+_(materials|texture|lights)_\w+"
_STRIP, _FAN = 5, 6


def with_marked_parts(content: bytes) -> bytes:
    """The content of a glTF file, with further names of arrays. `take_marked_parts` then finds them."""
    begin, end = _place_of_tree(content)
    tree = json.loads(content[begin:end])
    _check_extensions(tree.get("extensionsRequired", ()))
    for part in (part for mesh in tree.get("meshes", ()) for part in mesh["primitives"]):
        _mark(part, tree.get("accessors", []))
    text = json.dumps(tree).encode()
    if not begin:
        return text
    text += b" " * (-len(text) % 4)
    length = int.from_bytes(content[8:12], "little") - (end - begin) + len(text)
    numbers = (number.to_bytes(4, "little") for number in (length, len(text)))
    return content[:8] + b"".join(numbers) + content[16:begin] + text + content[end:]


def buffer_names(content: bytes) -> list[str]:
    """The names of files with the numbers of a glTF file."""
    tree = json.loads(content[slice(*_place_of_tree(content))])
    names = (buffer.get("uri") for buffer in tree.get("buffers", ()))
    return [name for name in names if name and "base64," not in name]


def _place_of_tree(content):
    """Where the JSON of a glTF file begins and ends."""
    if content[:4] != b"glTF":
        return 0, len(content)
    return _HEADER_SIZE, _HEADER_SIZE + int.from_bytes(content[12:16], "little")


def _check_extensions(required):
    for name in required:
        if name not in _ARRAYS and not re.fullmatch(_LOOK, name):
            raise ValueError(f"expected {' or '.join(_ARRAYS)} as required extensions, got {name}")


def _mark(part, accessors):
    """Name the arrays of a part with faces, and what trimesh does not do with them."""
    mode, attributes = part.get("mode", 4), part["attributes"]
    if mode not in range(_FAN + 1):
        raise ValueError(f"expected a mode of primitives from 0 to {_FAN}, got {mode}")
    if mode < 4:
        return  # points and lines
    compressed = part.get("extensions", {}).get(_DRACO, {}).get("attributes", {})
    if compressed and "bufferView" not in accessors[attributes["POSITION"]]:
        import_module("DracoPy")  # without which trimesh makes all positions 0
    if mode == _FAN:
        part["mode"], attributes[f"{_PREFIX}FAN"] = _STRIP, attributes["POSITION"]
    if "indices" in part and "sparse" in accessors[part["indices"]]:
        raise ValueError("expected indices of faces that are not sparse")
    for name in ("POSITION", "NORMAL", "COLOR_0"):
        if name not in attributes:
            continue
        index, marked = attributes[name], f"{_PREFIX}{name}"
        accessor, is_color = accessors[index], name == "COLOR_0"
        sparse, is_unit = accessor.get("sparse"), is_color or accessor.get("normalized")
        attributes[marked] = index
        if is_unit:
            attributes[f"{marked}_UNIT"] = index
        if sparse:
            attributes[f"{marked}_PLACES"], attributes[f"{marked}_VALUES"] = len(accessors), len(accessors) + 1
            kind = {"componentType": accessor["componentType"], "type": accessor["type"], "count": sparse["count"]}
            accessors += [{**kind, "type": "SCALAR", **sparse["indices"]}, {**kind, **sparse["values"]}]
        if is_color:
            del attributes[name]
            compressed |= {marked: compressed.pop(name)} if name in compressed else {}


def take_marked_parts(scene: Any) -> None:
    """Give meshes their marked arrays, for `Mesh.from_trimesh`; colours are linear, as in the file."""
    from trimesh.visual import TextureVisuals

    for shape in scene.geometry.values():
        attributes = getattr(shape, "vertex_attributes", {})
        names = [name for name in attributes if name.startswith(_PREFIX)]
        marked = {name.removeprefix(_PREFIX): attributes.pop(name) for name in names}
        positions, normals, colors = (_decoded(marked, name) for name in ("POSITION", "NORMAL", "COLOR_0"))
        if positions is not None:
            shape.vertices = positions
        if "FAN" in marked:
            shape.faces = _fan_of(shape.faces)
        if normals is not None:
            shape.vertex_normals = normals  # which trimesh forgets with other vertices
        if colors is not None:
            if shape.visual.kind != "texture":
                shape.visual = TextureVisuals()  # other visuals have 8 bits
            shape.visual.vertex_attributes["color"] = np.clip(colors.astype(float), 0, 1)


def _decoded(marked, name):
    """The numbers of an attribute, or None."""
    values = marked.get(name)
    if f"{name}_PLACES" in marked:
        values = values.copy()
        values[marked[f"{name}_PLACES"].ravel()] = marked[f"{name}_VALUES"]
    if f"{name}_UNIT" in marked and values.dtype.kind in "iu":
        values = np.maximum(values / np.iinfo(values.dtype).max, -1)
    return values


def _fan_of(strip):
    """The faces of a fan, from those of the strip with the same vertices."""
    faces = np.array(strip)
    faces[1::2] = faces[1::2, ::-1]
    faces[:, 0] = faces[:1, 0]
    return faces
