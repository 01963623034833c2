"""PLY files. trimesh refuses or reorders faces of several sizes, meshio knows few headers, VTK has single precision."""

from __future__ import annotations

import re
from array import array
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from ..interop.checks import names_of_values
from .polygon_meshes import numbers_of, polygon_mesh

# Bytes of a line, and lines, of a header.
_LINE_LIMIT, _LINES_LIMIT = 1 << 16, 10_000
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_WHOLE = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    "int64": "i8",
    "uint64": "u8",
}
_TYPES = {
    **_WHOLE,
    "float16": "f2",
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}


class _Property(NamedTuple):
    """The name and type of a property, and of a list the type of its length."""

    name: str
    dtype: Any
    length_dtype: Any

    @property
    def byte_order(self):
        """That of its lengths."""
        return "big" if self.length_dtype.str[0] == ">" else "little"


class _Element(NamedTuple):
    """The name and number of elements, and their properties."""

    name: str
    number: int
    properties: list[_Property]


def read_ply(path):
    """The mesh of a file, with normals, colours and values of vertices."""
    with open(path, "rb") as file:
        is_text, elements = _header(file)
        content = file.read()
    found = (_read_text if is_text else _read_binary)(content, elements)
    points = {name: values for name, (sizes, values) in found.get("vertex", {}).items() if sizes is None}
    vertices = _columns(points, "xyz")
    if vertices is None:
        raise ValueError("expected elements vertex with the properties x, y and z")
    sizes, corners = _indices(found.get("face", {}))
    strips = _triangles_of_strips(*_indices(found.get("tristrips", {})))
    return polygon_mesh(
        vertices.astype(float),
        np.concatenate([sizes, np.full(len(strips), 3)]),
        np.concatenate([corners, strips.ravel()]),
        _columns(points, ("nx", "ny", "nz")),
        _columns(points, ("red", "green", "blue")),
        [(name, points[name]) for name in names_of_values(points)],
    )


def _indices(properties):
    """The lengths and the numbers of an element's lists of vertices; empty ones if it has none."""
    lists = {name: part for name, part in properties.items() if part[0] is not None}
    names = [name for name in lists if name in ("vertex_indices", "vertex_index")] or list(lists)
    sizes, corners = lists[names[0]] if names else (np.zeros(0, np.int64), np.zeros(0, np.int64))
    return sizes, corners.astype(np.int64)


def _triangles_of_strips(sizes, corners):
    """The triangles of strips, (N, 3), all with one orientation. A list may have several strips, with -1 between them.

    Triangles with a vertex twice, which join strips, are left out.
    """
    first = np.arange(max(len(corners) - 2, 0))
    is_begin = np.zeros(len(corners) + 1, bool)
    is_begin[np.cumsum(sizes) - sizes] = True
    is_begin[1:] |= corners == -1
    begins = np.maximum.accumulate(np.where(is_begin, np.arange(len(is_begin)), 0))[first + 2]
    first = first[(begins <= first) & (corners[first + 2] != -1)]
    is_odd = (first - begins[first]) % 2
    triangles = np.stack([corners[first + is_odd], corners[first + 1 - is_odd], corners[first + 2]], axis=1)
    return triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]


def _columns(points, names):
    """The columns of some properties, or None."""
    return np.stack([points[name] for name in names], axis=1) if all(name in points for name in names) else None


def _header(file):
    """Whether the content is text, and the elements."""
    lines: list[list[str]] = []
    while not lines or lines[-1] != ["end_header"]:
        line = file.readline(_LINE_LIMIT)
        if not line or len(lines) > _LINES_LIMIT:
            raise ValueError("expected a header that ends with end_header")
        # Latin-1 would take parts of letters in UTF-8 for blanks, so that the words are parted first.
        lines.append([_decoded(word) for word in line.split()])
    kinds = [line[1] for line in lines if line[:1] == ["format"] and line[2:] == ["1.0"]]
    if lines[0] != ["ply"] or len(kinds) != 1 or kinds[0] not in _ORDERS:
        raise ValueError(f"expected a header with ply and a format of {', '.join(_ORDERS)} 1.0")
    elements: list[_Element] = []
    for line in lines:
        if line[:1] == ["element"]:
            if len(line) != 3 or not re.fullmatch(r"\d{1,18}", line[2]):
                raise ValueError(f"expected a name and a number of elements, got {' '.join(line)}")
            elements.append(_Element(line[1], int(line[2]), []))
        elif line[:1] == ["property"]:
            if not elements:
                raise ValueError("expected an element before its properties")
            elements[-1].properties.append(_property(line, _ORDERS[kinds[0]]))
    return kinds[0] == "ascii", elements


def _decoded(word):
    """A word in UTF-8, as today's programs write it, or else in Latin-1."""
    try:
        return word.decode()
    except UnicodeDecodeError:
        return word.decode("latin-1")


def _property(line, order):
    """A property of a line: property TYPE NAME, or property list TYPE TYPE NAME."""
    is_list = line[1:2] == ["list"]
    if len(line) != (5 if is_list else 3) or line[-2] not in _TYPES or (is_list and line[2] not in _WHOLE):
        raise ValueError(f"expected a property with known types and a name, got {' '.join(line)}")
    return _Property(
        line[-1], np.dtype(order + _TYPES[line[-2]]), np.dtype(order + _WHOLE[line[2]]) if is_list else None
    )


def _read_text(content, elements):
    """The properties of each element: the lengths of lists, or None, and numbers. Each element has a line."""
    lines, found = filter(None, map(bytes.split, content.splitlines())), {}
    for element in elements:
        lengths, values = [array("q") for _ in element.properties], [array("d") for _ in element.properties]
        count = 0
        for line in islice(lines, element.number):
            numbers, at = numbers_of(line, float, f"elements {element.name}"), 0
            for each, own_lengths, own_values in zip(element.properties, lengths, values):
                length = 1
                if each.length_dtype is not None:
                    length = numbers_of(line[at : at + 1], int, f"elements {element.name}")[0]
                    own_lengths.append(length)
                    at += 1
                own_values.extend(numbers[at : at + length])
                at += length
                _check(element, count, length >= 0 and at <= len(line))
            count += 1
            if at < len(line):
                raise ValueError(f"expected {at} numbers in a line of elements {element.name}, got {len(line)}")
        _check(element, count, count == element.number)
        found[element.name] = {
            each.name: (_lengths(each, own_lengths), _as_declared(np.asarray(own_values, float), each))
            for each, own_lengths, own_values in zip(element.properties, lengths, values)
        }
    for line in lines:
        raise ValueError(f"expected no more lines than elements, got {b' '.join(line)[:80].decode('latin-1')!r}")
    return found


def _check(element, count, is_whole):
    if not is_whole:
        raise ValueError(
            f"expected {element.number} elements {element.name}, got {count}: the file is truncated or damaged"
        )


def _lengths(each, lengths):
    return None if each.length_dtype is None else np.asarray(lengths, np.int64)


def _as_declared(numbers, each):
    """Numbers of text in the type of a property that has whole numbers; others keep their digits."""
    if each.dtype.kind == "f":
        return numbers
    with np.errstate(invalid="ignore"):
        whole = numbers.astype(each.dtype)
    if not np.array_equal(whole, numbers):
        wrong = numbers[whole != numbers][0]
        raise ValueError(f"expected whole numbers of {8 * each.dtype.itemsize} bits for {each.name}, got {wrong:g}")
    return whole


def _read_binary(content, elements):
    """The properties of each element: the lengths of lists, or None, and numbers."""
    at, found = 0, {}
    for element in elements:
        properties, end = _read_rows(content, at, element, min(element.number, 1))
        if element.number > 1 and properties:
            properties, end = _read_equal_rows(content, at, element, properties) or _read_rows(content, at, element)
        found[element.name], at = properties, end
    if at < len(content):
        raise ValueError(f"expected {at} bytes after the header, got {len(content)}")
    return found


def _read_equal_rows(content, at, element, first):
    """The properties of elements whose lists have the lengths of the first one's, and where they end; or None."""
    fields: list[Any] = []
    for each in element.properties:
        if each.length_dtype is not None:
            fields.append((f"length of {each.name}", each.length_dtype))
        fields.append((each.name, each.dtype, len(first[each.name][1])))
    dtype = np.dtype(fields)
    end = at + element.number * dtype.itemsize
    if end > len(content):
        return None
    rows, found = np.frombuffer(content, dtype, element.number, at), {}
    for each in element.properties:
        lengths = _lengths(each, rows[f"length of {each.name}"]) if each.length_dtype is not None else None
        if lengths is not None and (lengths != lengths[0]).any():
            return None
        found[each.name] = lengths, rows[each.name].reshape(-1)
    return found, end


def _read_rows(content, at, element, count=None):
    """The properties of elements, and where they end."""
    lengths, parts = [array("q") for _ in element.properties], [list[bytes]() for _ in element.properties]
    for row in range(element.number if count is None else count):
        for each, own_lengths, own_parts in zip(element.properties, lengths, parts):
            length = 1
            if each.length_dtype is not None:
                length_end = at + each.length_dtype.itemsize
                length = int.from_bytes(content[at:length_end], each.byte_order, signed=each.length_dtype.kind == "i")
                own_lengths.append(length)
                at = length_end
            own_parts.append(content[at : at + length * each.dtype.itemsize])
            at += length * each.dtype.itemsize
            _check(element, row, length >= 0 and at <= len(content))
    found = {
        each.name: (_lengths(each, own_lengths), np.frombuffer(b"".join(own_parts), each.dtype))
        for each, own_lengths, own_parts in zip(element.properties, lengths, parts)
    }
    return found, at
