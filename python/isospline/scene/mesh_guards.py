"""Checks of mesh files before a library reads them, which would otherwise accept truncated files."""

from __future__ import annotations

import os
import re

# Bytes of a header or trailer that are checked.
HEADER_LIMIT = 1 << 16


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
