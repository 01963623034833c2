"""3MF files. trimesh repeats or loses objects of several files, and those with equal names or part numbers."""

from __future__ import annotations

import zipfile
from array import array
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from ..interop.checks import to_mesh
from ..interop.three_mf import main_model
from ..interop.trimesh import joined, moved
from ..interop.vtk import check_indices
from .mesh import Mesh


class _Reference(NamedTuple):
    """An object by its file in the archive and its identifier, and the (4, 4) matrix that places it."""

    key: tuple[str, str]
    place: Any


class _Object(NamedTuple):
    """The arrays of an object's own mesh, and the other objects that it has."""

    arrays: dict[str, Any]
    components: list[_Reference]


def read_3mf(path):
    """The mesh of all objects that a file builds, one after the other."""
    with zipfile.ZipFile(path) as archive:
        main = main_model(archive).lower()
        objects, items = _model(archive, main)
        read = {main}
        # Objects of other files are those that components of the first one, or its items, name.
        while missing := {each.key[0] for each in _references(objects, items)} - read:
            for name in sorted(missing):
                objects |= _model(archive, name)[0]
            read |= missing
    parts = [part for item in items for part in _parts(objects, item, np.eye(4), ())]
    return to_mesh(Mesh, joined(parts), "mesh", {})


def _references(objects, items):
    return [*items, *(each for found in objects.values() for each in found.components)]


def _parts(objects, reference, place, above):
    """The arrays of the meshes of an object and of its components, in their places."""
    name, identifier = reference.key
    if reference.key not in objects:
        raise ValueError(f"expected an object {identifier} in {name}, got none")
    if reference.key in above:
        raise ValueError(f"expected objects that are no parts of themselves, got object {identifier} in {name}")
    found, place = objects[reference.key], place @ reference.place
    if len(found.arrays["faces"]):
        yield moved(found.arrays, place)
    for component in found.components:
        yield from _parts(objects, component, place, (*above, reference.key))


def _model(archive, name):
    """The objects of a file in the archive, by its name in lower case, and what it builds."""
    names = {each.lower(): each for each in archive.namelist()}  # upper and lower case are the same in names of parts
    if name not in names:
        raise ValueError(f"expected a file {name} in the archive, got none")
    objects, items, space = {}, list[_Reference](), None
    vertices, corners, components = array("d"), array("q"), list[_Reference]()
    with archive.open(names[name]) as file:
        for event, element in ElementTree.iterparse(file, ("start", "end")):
            if space is None:
                space = element.tag.rpartition("}")[0]  # extensions have elements with the same names
            own_space, _, tag = element.tag.rpartition("}")
            if event == "start":
                continue
            if own_space != space:
                pass
            elif tag == "vertex":
                vertices.extend(_numbers(element, ("x", "y", "z"), float))
            elif tag == "triangle":
                corners.extend(_numbers(element, ("v1", "v2", "v3"), int))
            elif tag == "component":
                components.append(_reference(element, name))
            elif tag == "item":
                items.append(_reference(element, name))
            elif tag == "object":
                points, faces = np.reshape(vertices, (-1, 3)), np.reshape(np.asarray(corners, np.int64), (-1, 3))
                check_indices(faces, len(points))
                objects[name, element.get("id")] = _Object({"vertices": points, "faces": faces}, components)
                vertices, corners, components = array("d"), array("q"), []
            element.clear()
    return objects, items


def _reference(element, name):
    """The object that a component or an item names: in its own file, unless it has a path."""
    paths = (value for key, value in element.items() if key.rpartition("}")[2] == "path")
    place, words = np.eye(4), element.get("transform", "").split()
    if words:
        try:
            place[:3] = np.reshape([float(word) for word in words], (4, 3)).T
        except ValueError:
            raise ValueError(f"expected 12 numbers of a transform, got {' '.join(words)}") from None
    return _Reference((next(paths, name).lstrip("/").lower(), element.get("objectid")), place)


def _numbers(element, names, kind):
    """The numbers of attributes."""
    try:
        return array("d" if kind is float else "q", [kind(element.attrib[name]) for name in names])
    except (KeyError, ValueError, OverflowError):
        tag = element.tag.rpartition("}")[2]
        raise ValueError(f"expected numbers {', '.join(names)} of a {tag}, got {element.attrib}") from None
