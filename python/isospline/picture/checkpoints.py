"""Checkpoints of pictures: files from which a renderer continues, and fingerprints of pictures."""

from __future__ import annotations

import hashlib
import json
import os
import struct
import zipfile
import zlib
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from .. import _core
from ..base.parameters import printable
from ..base.system import whole_file
from ..base.values import parts, value_types
from ..scene import Isosurface, Mesh, Scene, Volume

#: The beginning of `format` in a checkpoint.
_FORMAT = "isospline checkpoint 1"
_HEAD = ("format", "version", "prints")


def fingerprint(scene: Scene, **options: Any) -> dict[str, str]:
    """Digests of all parts that determine a picture, by the part's name; causes come before their effects.

    Parameters
    ----------
    scene : Scene
    **options
        Camera, path tracer and so on: values, or objects of numbers, texts and arrays.
    """
    objects = scene._placed_objects()
    found = {"objects": _digest([geometry_id for geometry_id, *_ in objects])}
    volumes: dict[Volume, str] = {}  # several surfaces may share one
    for geometry_id, item, transform, visibility in objects:
        if isinstance(item, Isosurface):
            made_of: Any = item.__getstate__()
            volume = made_of.pop("volume")
            if volume not in volumes:
                volumes[volume] = _digest(volume)
            each = {"volume": volumes[volume], **{name: _digest(value) for name, value in made_of.items()}}
        else:
            each = {"mesh": _digest(item)}
        each["transform"] = _digest(transform)
        each["visibility"] = _digest(visibility)
        found.update({f"{name} of object {geometry_id}": digest for name, digest in each.items()})
    for name, value in options.items():
        if isinstance(value, _core.PathTracer):
            found.update({f"path tracer's {part}": _digest(each) for part, each in parts(value).items()})
        else:
            found[name] = _digest(value)
    return found


def save(path: str | os.PathLike[str], state: Mapping[str, Any], prints: dict[str, str]) -> None:
    """Write a checkpoint, which appears whole or not at all."""
    arrays: dict[str, Any] = {name: np.asarray(array) for name, array in state.items()}
    with whole_file(path) as temporary, open(temporary, "wb") as file:
        np.savez(
            file,
            format=np.array(_FORMAT),
            version=np.array(_core.__version__),
            prints=np.array(json.dumps(prints)),
            **arrays,
        )


def load(path: str | os.PathLike[str], prints: dict[str, str], names: Iterable[str]) -> dict[str, Any]:
    """Read the arrays of a checkpoint, which has these at least; refuses, by name, what is of another picture.

    Raises
    ------
    ValueError
        For a file that is not a checkpoint or is damaged, and for a checkpoint of another picture or version.
    OSError
        If it cannot be read.
    """
    found = _read(path)
    if str(found["version"]) != _core.__version__:
        raise ValueError(_other(path, f"isospline {_core.__version__}", f"isospline {found['version']}"))
    stored = json.loads(str(found["prints"]))
    for name in [*prints, *stored]:
        if stored.get(name) != prints.get(name):
            raise ValueError(_other(path, f"the same {name}", "another one"))
    for name in names:
        if name not in found:
            raise ValueError(damaged(path, f"it has no {name}"))
    return {name: array for name, array in found.items() if name not in _HEAD}


def damaged(path: str | os.PathLike[str], reason: str) -> str:
    """The message about a file that is no checkpoint."""
    return f"{printable(path)}: cannot be read as a checkpoint: {reason}"


def _other(path, expected, got):
    return f"checkpoint: expected one of {expected}, got {got} in {printable(path)}"


def _read(path):
    try:
        with open(path, "rb") as file, zipfile.ZipFile(file) as archive:
            broken = archive.testzip()
            if broken is not None:
                raise ValueError(f"{broken} is damaged")
            with np.load(path, allow_pickle=False) as arrays:
                found = {name: arrays[name] for name in (*_HEAD, *arrays.files)}
        if str(found["format"]) != _FORMAT or not isinstance(json.loads(str(found["prints"])), dict):
            raise ValueError("it has another format")
        return found
    except OSError:
        raise
    except (
        ValueError,
        KeyError,
        EOFError,
        RuntimeError,
        NotImplementedError,
        MemoryError,
        struct.error,
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(damaged(path, reason)) from None


def _digest(value: Any) -> str:
    digest = hashlib.sha256()
    _feed(digest, value)
    return digest.hexdigest()


def _feed(digest, value):
    """Add the parts of a value; equal values add the same bytes, different values different bytes."""
    if isinstance(value, value_types()):
        _feed(digest, (type(value).__name__, parts(value)))
    elif isinstance(value, Volume):
        _feed(digest, ("Volume", value.__getstate__()))
    elif isinstance(value, Mesh):
        _feed(digest, ("Mesh", value.vertices, value.faces, value.normals, value.colors, value.material))
        if value.values is not None:
            _feed(digest, value.values)
    elif isinstance(value, Isosurface):
        _feed(digest, ("Isosurface", value.__getstate__()))
    elif isinstance(value, Scene):
        _feed(digest, ("Scene", value._placed_objects()))
    elif isinstance(value, dict):
        _feed(digest, [(str(name), value[name]) for name in sorted(value, key=str)])
    elif isinstance(value, (list, tuple)):
        digest.update(f"list {len(value)};".encode())
        for each in value:
            _feed(digest, each)
    elif isinstance(value, np.ndarray):
        digest.update(f"array {value.dtype.str} {value.shape};".encode())
        digest.update(np.ascontiguousarray(value).data)
    elif value is None or isinstance(value, (bool, int, float, str)):
        digest.update(f"{type(value).__name__} {value!r};".encode())
    else:
        raise TypeError(f"expected a part of a picture, got {type(value).__name__}")
