"""Checks of mesh files before a library reads them, which would otherwise accept truncated files."""

from __future__ import annotations

import os
import re

# Bytes of a header or trailer that are checked.
HEADER_LIMIT = 1 << 16


def check_stl(path):
    """Check that a file is complete."""
    size = os.path.getsize(path)
    with open(path, "rb") as file:
        beginning = file.read(84)
        count = int.from_bytes(beginning[80:], "little")
        if size >= 84 and size == 84 + 50 * count:
            return
        if b"solid" not in beginning.lower():
            expected = f"{84 + 50 * count} bytes of {count} triangles" if size >= 84 else "at least 84 bytes"
            raise ValueError(f"expected {expected}, got {size}: the file is truncated or damaged")
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
