"""What to open of files that were dropped together: series of slices as folders, and others on their own."""

from __future__ import annotations

import os
import re
from pathlib import Path

from ..io import dicom
from ..io.read import _OF_NIBABEL, FORMATS
from ..scene.mesh_files import MESH_SUFFIXES

# Header files that name the file with the samples.
_HEADERS = (".mhd", ".nhdr")
# Meshes, and suffixes of the files that they name.
_COMPANIONS = {".gltf": (".bin", ".png", ".jpg", ".jpeg"), ".obj": (".mtl", ".png", ".jpg", ".jpeg")}
_TIFF = (".tif", ".tiff")
_OTHERS = tuple(suffix for suffix in (*FORMATS, *MESH_SUFFIXES, ".raw") if suffix != ".dcm")
# The most bytes of a header, and the most characters of the name of a series' folder that are those of its first file.
_HEADER_SIZE, _NAME_SIZE = 1 << 20, 60


def paths_to_open(folder, paths):
    """Of the files of a folder, the paths to open, without files that others name.

    The slices of a series move to a folder of their own, which has the name of the first one.
    """
    companions = tuple(
        suffix
        for mesh, suffixes in _COMPANIONS.items()
        if any(path.lower().endswith(mesh) for path in paths)
        for suffix in suffixes
    )
    headers = [path for path in paths if path.lower().endswith(_HEADERS)]
    named = _names_in(headers)
    paths = [path for path in paths if not (path.lower().endswith(companions) or named(os.path.basename(path)))]
    if headers:  # beside them, others than images and meshes are notes
        paths = [path for path in paths if path.lower().endswith((".dcm", *_OTHERS, *_OF_NIBABEL))]
    stacks = _series(folder, paths)
    tiffs = [path for path in paths if path.lower().endswith(_TIFF)]
    if len(tiffs) > 3:
        stacks.append(tiffs)
    gone = {path for stack in stacks for path in stack}
    others = [path for path in paths if path not in gone]
    if len(others) > 3 and not stacks and not any("." in os.path.basename(path) for path in others):
        return [folder]  # its error tells what a folder of slices must have
    return [*(_moved(folder, stack) for stack in stacks), *others]


def _series(folder, paths):
    """Lists of the DICOM files of each series that has several."""
    found = {path for path in map(str, dicom.slices_of(Path(folder))) if not path.lower().endswith(_OTHERS)}
    slices = sorted(found.intersection(paths))
    if len(slices) < 2:
        return []
    try:
        series = [[os.path.join(folder, name) for name in names] for names in dicom.find_series(Path(folder))]
    except (ValueError, OSError, ImportError, RuntimeError):  # opening tells it
        return [slices]
    return [sorted(set(files) & set(slices)) for files in series if len(set(files) & set(slices)) > 1]


def _moved(folder, stack):
    """Move the slices of a stack to a folder of their own."""
    first = os.path.basename(stack[0])
    inner = os.path.join(folder, f"{first[:_NAME_SIZE]} and {len(stack) - 1} more")
    os.mkdir(inner, 0o700)
    for path in stack:
        os.rename(path, os.path.join(inner, os.path.basename(path)))
    return inner


def _names_in(headers):
    """A function that tells whether a name is in one of some headers, also by a pattern such as "slice%03d.raw"."""
    texts = []
    for path in headers:
        with open(path, "rb") as file:
            texts.append(file.read(_HEADER_SIZE).decode("utf-8", "surrogateescape"))
    text = "\n".join(texts)
    names = {re.split(r"[/\\]", line.split("=")[-1].split(": ")[-1].strip())[-1] for line in text.splitlines()}
    patterns = [(begin, end) for begin, end in re.findall(r"([^\s/\\=]*)%\d*d(\S*)", text)]
    own = set(map(os.path.basename, headers))

    def named(name):
        known = name in names or any(name.startswith(begin) and name.endswith(end) for begin, end in patterns)
        return known and name not in own

    return named
