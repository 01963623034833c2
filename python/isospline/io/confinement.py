"""Confines the files that a file refers to, such as the samples of a MetaImage header, to a folder.

The name of a file may be absolute, may contain `..`, and may be a symbolic link. All are resolved first.
"""

from __future__ import annotations

import os
from pathlib import Path

from ..base.parameters import printable


def check_within(path: str | os.PathLike[str], within: str | os.PathLike[str] | None, what: str = "files") -> None:
    """Check that a path, after its symbolic links are resolved, is in a folder; without a folder, every path is."""
    if within is not None and not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(within)):
        raise ValueError(f"expected {what} within {printable(within)}, got {printable(path)}")


def check_folder_within(folder: str | os.PathLike[str], within: str | os.PathLike[str] | None) -> None:
    """Check the same for each entry of a folder, because libraries open those that they find."""
    if within is not None:
        for entry in sorted(os.listdir(folder)):
            check_within(os.path.join(folder, entry), within)
