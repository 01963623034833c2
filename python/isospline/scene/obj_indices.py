"""Negative indices of OBJ, which trimesh counts from the end of the file in place of from the face that has them."""

from __future__ import annotations

import re

_KINDS = (b"v", b"vt", b"vn")  # in the order of the indices of a corner
_CORNER = re.compile(rb"-?\d*(?:/-?\d*){0,2}")


def absolute_indices(text: bytes) -> bytes:
    """The text of an OBJ file whose faces have no negative indices: -1 is the last element before the face."""
    joined = text.strip().replace(b"\r\n", b"\n").replace(b"\\\n", b"")  # as trimesh does
    if not re.search(rb"^f[^\n]*[\s/]-\d", joined, re.MULTILINE):
        return text
    lines, counts = joined.split(b"\n"), dict.fromkeys(_KINDS, 0)
    for at, line in enumerate(lines):
        kind, space, _ = line[:3].partition(b" ")
        if space and kind in counts:
            counts[kind] += 1
        elif line.startswith(b"f") and b"-" in line:
            lines[at] = b" ".join(_absolute(word, counts) for word in line.split())
    return b"\n".join(lines)


def _absolute(corner, counts):
    """A corner of a face, such as -3/-3/-1, if these numbers of elements are before it; other words as they are."""
    if not _CORNER.fullmatch(corner):
        return corner
    return b"/".join(
        _from_begin(int(index), kind, counts[kind]) if index.startswith(b"-") else index
        for index, kind in zip(corner.split(b"/"), _KINDS)
    )


def _from_begin(index, kind, count):
    if not -count <= index <= -1:
        raise ValueError(f"expected an index of one of the {count} {kind.decode()} before the face, got {index}")
    return b"%d" % (count + 1 + index)
