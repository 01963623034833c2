"""Files of 3MF, with the unit of the mesh."""

from __future__ import annotations

import importlib
import io
import os
import re
import zipfile
from xml.etree import ElementTree

from ..base.mistakes import sentence
from ..base.parameters import printable
from ..base.system import warn
from ..base.units import PICOMETRES

# The units of 3MF, by their symbols and names in volumes.
_NAMES = {
    PICOMETRES[symbol]: name
    for symbol, name in (
        ("µm", "micron"),
        ("mm", "millimeter"),
        ("cm", "centimeter"),
        ("m", "meter"),
        ("inch", "inch"),
        ("ft", "foot"),
    )
}
_UNITS = {unit: _NAMES[size] for unit, size in PICOMETRES.items() if size in _NAMES}

# For messages.
_SYMBOLS = "µm, mm, cm, m, inch or ft"


def check_unit(unit):
    """Raise an error for a unit that 3MF does not have."""
    if unit is None:
        return
    if not isinstance(unit, str):
        raise TypeError(sentence("unit", f"a str, one of {_SYMBOLS}", unit))
    if unit not in _UNITS:
        raise ValueError(f"unit: expected one of {_SYMBOLS}, got {unit!r}")


def unit_for(path, volume):
    """The unit of a volume for the file of a mesh of it, or None; warns if 3MF does not have it."""
    if volume.unit in _UNITS:
        return volume.unit
    if volume.unit and os.fspath(path).lower().endswith(".3mf"):
        warn(
            f"{printable(path)}: 3MF does not have the unit {volume.unit!r}, only {_SYMBOLS}; programs take the "
            f"numbers for millimetres"
        )
    return None


def import_packages():
    """Import what trimesh needs for 3MF: its own error for a missing package does not have the package's name."""
    for name in ("networkx", "lxml", "lxml.etree"):
        importlib.import_module(name)


def write(mesh, path, unit):
    """Write a mesh of trimesh, in a unit or, by default, in millimetres."""
    import_packages()
    content = mesh.export(file_type="3mf")
    name_of_unit = _UNITS[unit or "mm"].encode()
    if name_of_unit == b"millimeter":  # which trimesh writes for every mesh
        with open(path, "wb") as file:
            file.write(content)
        return
    with zipfile.ZipFile(io.BytesIO(content)) as made, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in made.namelist():
            part = made.read(name)
            if name.endswith(".model"):
                part = re.sub(rb'\bunit="\w+"', b'unit="' + name_of_unit + b'"', part, count=1)
            archive.writestr(name, part)


def main_model(archive):
    """The name of the file in an archive that has what is built: the relationships of the archive name it."""
    names = {name.lower(): name for name in archive.namelist()}  # upper and lower case are the same in names of parts
    relationships = archive.read(names["_rels/.rels"]) if "_rels/.rels" in names else b"<none/>"
    for element in ElementTree.fromstring(relationships):
        target = element.get("Target", "").lstrip("/").lower()
        if element.get("Type", "").endswith("/3dmodel") and target in names:
            return names[target]
    models = [name for lower, name in names.items() if lower.endswith(".model")]
    if not models:
        raise ValueError("expected a file with the relationship 3dmodel in the archive, got none")
    return names.get("3d/3dmodel.model", models[0])


def unit_in_file(path):
    """The unit that a file tells; millimetres by default. It runs in a process of its own."""
    with zipfile.ZipFile(path) as archive, archive.open(main_model(archive)) as file:
        head = file.read(1 << 16)
    found = re.search(rb"""<(?:\w+:)?model\b[^>]*?\bunit=["'](\w+)["']""", head)
    return "millimeter" if found is None else found[1].decode()
