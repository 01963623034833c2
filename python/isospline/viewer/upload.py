"""Files that a page uploads."""

from __future__ import annotations

import os
import shutil

from .document import MESH_SUFFIXES

# Header files that name the file with the samples.
_HEADERS = (".mhd", ".nhdr")


class Upload:
    """Writes the files of an upload, which arrive as a stream of bytes, into a folder.

    Parameters
    ----------
    folder : str
    files : list of dict
        The name and the size of each file.

    Raises
    ------
    ValueError
        For files without a name or a size, and for files larger than the free space of the disk.
    """

    def __init__(self, folder, files):
        if not isinstance(files, list) or not files:
            raise ValueError("files: expected a list of names and sizes")
        self._folder = folder
        self._left = []
        for each in files:
            name, size = os.path.basename(str(each.get("name", "")).replace("\\", "/")), each.get("size")
            if name in ("", ".", "..") or "\0" in name or not isinstance(size, int) or size < 0:
                raise ValueError(f"files: expected a name and a size for each file, got {each!r}")
            self._left.append((os.path.join(folder, name), size))
        self._paths = [path for path, _ in self._left]
        self._total = sum(size for _, size in self._left)
        if self._total > shutil.disk_usage(folder).free:
            raise ValueError(f"files: expected at most the free space of the disk in bytes, got {self._total}")
        self._written = 0
        for path in self._paths:
            open(path, "wb").close()

    @property
    def fraction(self):
        return self._written / self._total if self._total else 1.0

    @property
    def complete(self):
        return self._written == self._total

    def write(self, content):
        """Write the next bytes."""
        self._written += len(content)
        if self._written > self._total:
            raise ValueError(f"files: expected {self._total} bytes, got more")
        while content:
            path, size = self._left[0]
            part = content[:size]
            with open(path, "ab") as file:
                file.write(part)
            content = content[size:]
            if size > len(part):
                self._left[0] = (path, size - len(part))
            else:
                self._left.pop(0)

    def paths(self):
        """The paths to open: header files, which name their samples; a folder of slices; or each file on its own."""
        headers = [path for path in self._paths if path.lower().endswith(_HEADERS)]
        if headers:
            return headers
        slices = [path for path in self._paths if not path.lower().endswith(MESH_SUFFIXES)]
        if len(slices) > 3 and all(
            path.lower().endswith((".dcm", ".tif", ".tiff")) or "." not in os.path.basename(path) for path in slices
        ):
            return [self._folder, *(path for path in self._paths if path not in slices)]
        return self._paths
