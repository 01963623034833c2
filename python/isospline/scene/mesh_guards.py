"""Checks of mesh files before a library reads them, which would otherwise accept truncated files."""

from __future__ import annotations

import os
import re
from typing import Any

# Bytes of a header or trailer that are checked.
HEADER_LIMIT = 1 << 16


def check_ply(path):
    """Check that an ASCII file has all elements: trimesh ignores missing ones."""
    with open(path, "rb") as file:
        header: list[bytes] = []
        while not header or header[-1] != b"end_header":
            line = file.readline(HEADER_LIMIT)
            if not line or len(header) > 10_000:
                raise ValueError("expected a header that ends with end_header")
            header.append(line.strip())
        words = [line.decode("latin-1").split() for line in header]
        elements = _elements(words)
        size = os.path.getsize(path) - file.tell()
        if ["format", "ascii", "1.0"] not in words:
            for name, count, properties in elements:
                if count * max(len(properties), 1) > size:
                    raise ValueError(f"expected {count} elements {name} within the file: the file is truncated")
            return
        for name, count, properties in elements:
            for row in range(count):
                line = file.readline()
                while line and not line.strip():
                    line = file.readline()
                if not line or not _is_complete(line.split(), properties):
                    raise ValueError(f"expected {count} elements {name}, got {row}: the file is truncated or damaged")


def _elements(words):
    """Name, number and properties of each element; a property is True if it is a list."""
    elements: list[Any] = []
    for line in words:
        if line[:1] == ["element"]:
            if len(line) != 3 or not re.fullmatch(r"\d{1,18}", line[2]):
                raise ValueError(f"expected a name and a number of elements, got {' '.join(line)}")
            elements.append((line[1], int(line[2]), []))
        elif line[:1] == ["property"]:
            if not elements:
                raise ValueError("expected an element before its properties")
            elements[-1][2].append(line[1:2] == ["list"])
    return elements


def _is_complete(numbers, properties):
    """Whether a line has all numbers of an element."""
    at = 0
    for is_list in properties:
        if is_list:
            if at >= len(numbers) or not numbers[at].isdigit():
                return False
            at += int(numbers[at])
        at += 1
    return at <= len(numbers)


def check_stl(path):
    """Check that an ASCII file is complete; trimesh checks the size of a binary one."""
    size = os.path.getsize(path)
    with open(path, "rb") as file:
        beginning = file.read(84)
        if size >= 84 and size == 84 + 50 * int.from_bytes(beginning[80:], "little"):
            return
        if not beginning.lstrip().lower().startswith(b"solid"):
            return
        file.seek(-min(size, HEADER_LIMIT), os.SEEK_END)
        last = file.read().strip().rpartition(b"\n")[2].strip().lower()
    if not last.startswith(b"endsolid"):
        raise ValueError("expected endsolid in the last line: the file is truncated")


def check_off(path):
    """Check that a file has all lines of vertices and faces, and that the last line is complete."""
    with open(path, "rb") as file:
        lines = [line for line in (line.partition(b"#")[0].split() for line in file) if line]
    words = [word for line in lines[:2] for word in line if not word.upper().endswith(b"OFF")][:2]
    if len(words) < 2 or not all(word.isdigit() for word in words):
        raise ValueError("expected the numbers of vertices and faces")
    vertices, faces = (int(word) for word in words)
    begin = len(lines) if len(lines) < 2 else 1 if len(lines[0]) > 1 else 2
    got = lines[begin : begin + vertices + faces]
    last = got[-1] if got else [b"0"]
    whole = len(last) >= 3 if faces == 0 else last[0].isdigit() and len(last) > int(last[0])
    if len(got) < vertices + faces or not whole:
        raise ValueError(f"expected {vertices} vertices and {faces} faces, got {len(got)} lines: the file is truncated")


def check_gmsh(path):
    """Check that each section of a file has its end."""
    with open(path, "rb") as file:
        begun = None
        for line in iter(lambda: file.readline(HEADER_LIMIT), b""):
            match = re.fullmatch(rb"\$([A-Za-z]+)\s*", line)
            if match and match[1].startswith(b"End"):
                begun = None
            elif match and begun is None:
                begun = match[1]
    if begun is not None:
        raise ValueError(f"expected $End{begun.decode()}: the file is truncated")


_GUARDS = {
    ".off": check_off,
    ".ply": check_ply,
    ".stl": check_stl,
}


def check_before(path):
    """Do the checks that the reader of a format does not do."""
    guard = _GUARDS.get(path.suffix.lower())
    if guard is not None:
        guard(path)
