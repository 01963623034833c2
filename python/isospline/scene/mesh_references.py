"""The files that a mesh file refers to, such as buffers, materials and includes, and their confinement to a folder."""

from __future__ import annotations

import locale
import os
import re
import zipfile
from pathlib import Path
from typing import Any
from xml.parsers import expat

from ..base.parameters import printable
from ..io.confinement import check_within
from ..io.read import errors_name
from .gltf_parts import buffer_names

# Formats of meshio that are complete in one file. Others are several files, or HDF5, whose links may lead anywhere.
_SELF_CONTAINED = (
    ".avs",
    ".bdf",
    ".dat",
    ".dato",
    ".dato.gz",
    ".f3grid",
    ".fem",
    ".mdpa",
    ".mesh",
    ".meshb",
    ".msh",
    ".nas",
    ".post",
    ".post.gz",
    ".su2",
    ".tec",
    ".ugrid",
    ".vol",
    ".vol.gz",
    ".wkt",
)
_BLOCK = 1 << 16


def referenced_files(path: str | os.PathLike[str]) -> list[str]:
    """The files with parts of a mesh that its file refers to, with links resolved.

    These are buffers of glTF, includes of Abaqus, the numbers of XDMF, and the other file of a pair of TetGen.
    """
    path, found = Path(path), []
    with errors_name(path, "a mesh"):
        if path.suffix.lower() in (".glb", ".gltf"):
            names = map(str.strip, buffer_names(path.read_bytes()))
            found = [path.parent / part for name in names for part in (name, name.lstrip("/"), os.path.basename(name))]
        elif path.suffix.lower() == ".inp":
            found = _all_includes(path, set())
        elif path.suffix.lower() in (".xdmf", ".xmf"):
            found = _files_of_xdmf(path)
        elif path.suffix in (".ele", ".node"):
            found = [path.with_suffix({".ele": ".node", ".node": ".ele"}[path.suffix])]
    return list(dict.fromkeys(os.path.realpath(file) for file in found if file.is_file()))


def check_references(path: Path, within: Any) -> None:
    """Check the files that a file of a format of meshio includes, if it is confined to a folder."""
    name = path.name.lower()
    if within is None or name.endswith(_SELF_CONTAINED):
        return
    if not name.endswith(".inp"):
        raise ValueError(f"expected a format that cannot refer to files outside of {printable(within)}")
    _check_includes(path, within, set())


def _check_includes(path, within, checked):
    """Check `*INCLUDE, INPUT=name` in a file of Abaqus and in included files, with the rules of meshio."""
    check_within(path, within, "included files")
    if path in checked:
        raise ValueError(f"expected a file that does not include itself, got {printable(path)}")
    for included in _includes(path):
        _check_includes(included, within, {*checked, path})


def _all_includes(path, found):
    for included in _includes(path):
        if included not in found and included.is_file():
            found.add(included)
            _all_includes(included, found)
    return sorted(found)


def _files_of_xdmf(path):
    """The files with numbers that a file of XDMF names, as meshio finds them: of HDF5 beside it, and binary ones."""
    texts: list[tuple[str, list[str]]] = []

    def begin(name, attributes):
        texts.append((attributes.get("Format", "") if name == "DataItem" else "", []))

    def add(text):
        if texts and texts[-1][0] in ("HDF", "Binary"):
            texts[-1][1].append(text)

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.CharacterDataHandler = begin, add
    with open(path, "rb") as file:
        parser.ParseFile(file)
    named = [(kind, "".join(parts).strip()) for kind, parts in texts if parts]
    folder = Path(os.path.realpath(path)).parent
    return [folder / text.partition(":")[0] if kind == "HDF" else Path(text) for kind, text in named]


def _includes(path):
    """The files that a file of Abaqus names, as meshio finds them."""
    with open(path, encoding=locale.getpreferredencoding(False)) as file:  # as in meshio
        for line in file:
            if line.partition(",")[0].strip().replace("*", "").upper() == "INCLUDE":
                name = Path(line.split("=")[-1].strip())
                yield name if name.exists() else path.parent / name


def check_entities(path: Path, within: Any) -> None:
    """Refuse declarations in COLLADA and 3MF, if confined: entities in them may refer to any file."""
    suffix = path.suffix.lower()
    if within is None or suffix not in (".dae", ".3mf"):
        return
    if suffix == ".dae":
        with open(path, "rb") as file:
            _refuse_doctype(file)
        return
    with zipfile.ZipFile(path) as archive:
        for entry in archive.namelist():
            if entry.lower().endswith((".model", ".xml", ".rels")):
                with archive.open(entry) as file:
                    _refuse_doctype(file)


class _Begun(Exception):
    """The first element has begun; declarations can only be before it."""


def _refuse_doctype(file):
    def refuse(*_):
        raise ValueError("expected XML without a document type declaration")

    def begin(*_):
        raise _Begun

    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler, parser.StartElementHandler = refuse, begin
    try:
        while block := file.read(_BLOCK):
            parser.Parse(block, False)
    except _Begun:
        pass


def resolver_within(path: Path, within: Any) -> Any:
    """What trimesh opens files with that a mesh file names. The one it refused first is its `refused`."""
    from trimesh.resolvers import Resolver

    class ConfinedResolver(Resolver):
        def __init__(self, folder: Path) -> None:
            self.folder = folder
            self.refused: ValueError | None = None

        def get(self, name: str) -> bytes:
            target = self.folder / str(name).strip()
            try:
                if re.match(r"[A-Za-z][A-Za-z0-9+.-]+:", str(name).strip()):
                    raise ValueError(f"expected the name of a file, got {name}")
                check_within(target, within, "files of a mesh")
            except ValueError as error:
                # trimesh does without files that cannot be read, such as materials.
                self.refused = self.refused or error
                raise
            return target.read_bytes()

        def keys(self) -> Any:
            return [file.name for file in self.folder.iterdir()]

        def namespaced(self, namespace: str) -> Any:
            del namespace
            return self

        def write(self, name: str, data: Any) -> None:
            raise ValueError(f"expected to read files, got {name} to write")

    return ConfinedResolver(path.parent)
