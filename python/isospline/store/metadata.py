"""The metadata of a store. They are read and checked before anything else."""

from __future__ import annotations

import json
import math
import os
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.parameters import check_path, printable
from .ome import UNITS

#: Version of the attribute "isospline"; readers refuse others. Version 1 had coefficients where version 2 has the
#: samples of the OME-Zarr image.
VERSION = 2

#: Largest size of a metadata file in bytes.
_LARGEST_FILE = 1 << 26

#: Cells along each edge of an octet of bricks. An array of ranges has one item per octet.
OCTET_SIZE = 16


@dataclass(frozen=True, eq=False)
class ScaleMetadata:
    """One scale of a store's pyramid.

    Attributes
    ----------
    path, ranges : str
        Keys of the arrays of coefficients and of ranges in the store.
    shape, chunk, shard : (int, int, int)
        Coefficients along z, y and x of the level, of one chunk and of one file.
    minimum, maximum : float
        The smallest and the largest sample.
    offset : float
        The number that is subtracted from the coefficients, as in a `Volume`.
    spacing, origin : (float, float, float), world units
        Along x, y and z, as in a `Volume`.
    direction : (3, 3) float64 array
        Its columns are the directions of the axes x, y and z.
    """

    path: str
    ranges: str
    shape: tuple[int, int, int]
    chunk: tuple[int, int, int]
    shard: tuple[int, int, int]
    minimum: float
    maximum: float
    offset: float
    spacing: tuple[float, float, float]
    origin: tuple[float, float, float]
    direction: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StoreMetadata:
    """The description of a store.

    Attributes
    ----------
    path : Path
        The store's folder, without symbolic links.
    degree, boundary, filter, smoothing
        The parameters of the model, as in a `Volume`.
    unit : str
        Of world coordinates, as in a `Volume`; empty if unknown.
    patient : bool
        Whether the world is a patient's, as in a `Volume`.
    scales : tuple of ScaleMetadata
        The finest first.
    """

    path: Path
    degree: int
    boundary: str
    filter: str
    smoothing: float
    unit: str
    patient: bool
    scales: tuple[ScaleMetadata, ...]


def read_metadata(path: str | os.PathLike[str]) -> StoreMetadata:
    """Read and check the metadata of a complete store.

    Raises
    ------
    OSError
        If the folder or one of its files of metadata is missing or cannot be read.
    ValueError
        If it is not a store, incomplete, of another version, damaged, or if a link or key leads out of it. The message
        names the store.
    """
    check_path(path)
    root = Path(os.path.realpath(path))
    try:
        attributes = group_attributes(root)
        if "time_steps" in attributes:
            steps = attributes["time_steps"]
            raise ValueError(f"expected one volume, got a time series of {len(steps)}: open {path}/{steps[0]}")
        if attributes.get("complete") is not True:
            raise ValueError("expected a complete store, got an incomplete one: run its conversion again to continue")
        levels = _field(attributes, "levels", list)
        if not levels:
            raise ValueError("levels: expected at least one, got none")
        check_links(root)
        return StoreMetadata(
            root,
            _one_of(attributes, "degree", range(6)),
            _one_of(attributes, "boundary", ("mirror", "periodic")),
            _one_of(attributes, "filter", ("interpolate", "none", "smoothing")),
            _number(attributes, "smoothing"),
            _unit(attributes),
            "patient" in attributes and _field(attributes, "patient", bool),
            tuple(_level(root, number, level) for number, level in enumerate(levels)),
        )
    except ValueError as error:
        raise ValueError(f"{printable(path)}: {error}") from error


def group_attributes(root: Path) -> dict[str, Any]:
    """The attributes "isospline" of a store's group."""
    if not stat.S_ISDIR(os.stat(root).st_mode):
        raise ValueError("expected the folder of a store, got a file")
    group = _read_json(root, "")
    if group.get("zarr_format") != 3 or group.get("node_type") != "group":
        raise ValueError("expected a Zarr 3 group, got none")
    attributes = group.get("attributes")
    found = attributes.get("isospline") if isinstance(attributes, dict) else None
    if not isinstance(found, dict):
        raise ValueError("expected a store that isospline.convert has written, got another Zarr group")
    if found.get("version") != VERSION:
        raise ValueError(
            f"expected a store of version {VERSION}, got version {found.get('version')!r}: convert its source again"
        )
    return found


def check_links(root: Path) -> None:
    """Refuse symbolic links that lead out of a store: their targets do not belong to it."""
    for folder, folders, files in os.walk(root):
        for name in (*folders, *files):
            entry = os.path.join(folder, name)
            if os.path.islink(entry) and not Path(os.path.realpath(entry)).is_relative_to(root):
                raise ValueError(f"{printable(os.path.relpath(entry, root))}: expected no link that leaves the store")


def _level(root, number, level):
    name = f"levels[{number}]"
    if not isinstance(level, dict):
        raise ValueError(f"{name}: expected an object, got {level!r}")
    try:
        shape = _counts(level, "shape")
        path, ranges = _key(level, "path"), _key(level, "ranges")
        array = _array(root, path)
        if tuple(array.get("shape", ())) != shape:
            raise ValueError(f"{path}: expected shape {shape}, got {array.get('shape')!r}")
        chunk, shard = _sharding(path, array)
        _check_ranges(shape, path, _array(root, ranges), ranges)
        direction = np.array(_field(level, "direction", list), dtype=float)
        if direction.shape != (3, 3) or not np.isfinite(direction).all():
            raise ValueError(f"direction: expected 3 x 3 finite numbers, got {level['direction']!r}")
        minimum, maximum, offset = (_number(level, field) for field in ("minimum", "maximum", "offset"))
        if minimum > maximum:
            raise ValueError(f"minimum: expected {maximum} at most, got {minimum}")
        spacing, origin = _numbers(level, "spacing"), _numbers(level, "origin")
        if min(spacing) <= 0:
            raise ValueError(f"spacing: expected numbers above 0, got {spacing}")
    except (TypeError, KeyError) as error:
        raise ValueError(f"{name}: expected the metadata of a level, got {error}") from error
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error
    return ScaleMetadata(path, ranges, shape, chunk, shard, minimum, maximum, offset, spacing, origin, direction)


def _sharding(path, array):
    """Shapes of chunks and shards, after checking that the array is stored in this version's form."""
    grid = array.get("chunk_grid", {})
    codecs = array.get("codecs", [])
    key = array.get("chunk_key_encoding", {})
    if array.get("data_type") != "float32":
        raise ValueError(f"{path}: expected float32, got {array.get('data_type')!r}")
    if grid.get("name") != "regular" or [codec.get("name") for codec in codecs] != ["sharding_indexed"]:
        raise ValueError(f"{path}: expected a regular grid of shards, got others")
    separator = key.get("configuration", {}).get("separator", "/")
    if key.get("name") != "default" or separator != "/":
        raise ValueError(f"{path}: expected chunks named as c/0/0/0, got others")
    configuration = codecs[0]["configuration"]
    for field in ("codecs", "index_codecs"):
        names = [codec.get("name") for codec in configuration[field]]
        endian = configuration[field][0].get("configuration", {}).get("endian", "little")
        if names != ["bytes", "crc32c"] or endian != "little":
            raise ValueError(f"{path}: expected codecs bytes (little) and crc32c, got {names}")
    if configuration.get("index_location", "end") != "end":
        raise ValueError(f"{path}: expected the index at a shard's end, got {configuration['index_location']!r}")
    shard = _counts(grid["configuration"], "chunk_shape")
    chunk = _counts(configuration, "chunk_shape")
    if any(outer % inner for outer, inner in zip(shard, chunk)):
        raise ValueError(f"{path}: expected shards of whole chunks, got {shard} and {chunk}")
    return chunk, shard


def _check_ranges(shape, path, array, ranges):
    got = tuple(array.get("shape", ()))
    if array.get("data_type") != "float32" or len(got) != 5 or got[3:] != (2, 8):
        raise ValueError(f"{ranges}: expected float32 of shape (octets z, octets y, octets x, 2, 8), got {got}")
    if any(abs(count - math.ceil(size / OCTET_SIZE)) > 1 for count, size in zip(got, shape)):
        raise ValueError(f"{ranges}: expected octets that cover {path} of shape {shape}, got {got}")


def _array(root, key):
    array = _read_json(root, key)
    if array.get("zarr_format") != 3 or array.get("node_type") != "array":
        raise ValueError(f"{key}: expected a Zarr 3 array, got none")
    return array


def _read_json(root, key):
    """The zarr.json of a node, which must be a file within the store."""
    path = Path(os.path.realpath(root / key / "zarr.json"))
    name = f"{key}/zarr.json".lstrip("/")
    if not path.is_relative_to(root):
        raise ValueError(f"{name}: expected a file within the store, got a link that leaves it")
    status = os.stat(path)
    if not stat.S_ISREG(status.st_mode) or status.st_size > _LARGEST_FILE:
        raise ValueError(f"{name}: expected a file of JSON")
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f"{name}: expected JSON, got text that cannot be parsed: {error}") from error
    if not isinstance(content, dict):
        raise ValueError(f"{name}: expected an object, got {type(content).__name__}")
    return content


def _key(level, field):
    """The key of an array, which must not lead out of the store."""
    key = _field(level, field, str)
    parts = key.split("/")
    if any(part in ("", ".", "..") for part in parts) or "\0" in key or "\\" in key:
        raise ValueError(f"{field}: expected a key within the store, got {key!r}")
    return key


def _field(container, field, kind):
    value = container.get(field)
    if not isinstance(value, kind):
        raise ValueError(f"{field}: expected a {kind.__name__}, got {value!r}")
    return value


def _one_of(container, field, values):
    value = container.get(field)
    if isinstance(value, bool) or value not in values:
        raise ValueError(f"{field}: expected one of {', '.join(map(str, values))}, got {value!r}")
    return value


def _unit(attributes):
    """The symbol of the unit, as in a `Volume`; stores have the name that OME-Zarr gives it."""
    name = _field(attributes, "unit", str) if "unit" in attributes else ""
    return "mm" if attributes.get("patient") is True and not name else UNITS.get(name, name)


def _number(container, field):
    value = container.get(field)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ValueError(f"{field}: expected a finite number, got {value!r}")
    return float(value)


def _numbers(container, field):
    values = container.get(field)
    if not isinstance(values, list) or len(values) != 3:
        raise ValueError(f"{field}: expected three numbers, got {values!r}")
    return tuple(_number({field: value}, field) for value in values)


def _counts(container, field):
    values = container.get(field)
    is_count = isinstance(values, list) and all(type(value) is int and 0 < value < 2**31 for value in values)
    if not is_count or len(values) != 3:
        raise ValueError(f"{field}: expected three whole numbers above 0, got {values!r}")
    return tuple(values)
