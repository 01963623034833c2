"""The metadata of a store. They are read and checked before anything else."""

from __future__ import annotations

import contextlib
import errno
import json
import math
import os
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from reprlib import repr as _shown
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.parameters import check_path, printable
from ..io.volume_data import affine_of
from .ome import UNITS

#: Version of the attribute "isospline"; readers refuse others. Version 1 had coefficients where version 2 has the
#: samples of the OME-Zarr image.
VERSION = 2

#: Largest size of a metadata file in bytes.
_LARGEST_FILE = 1 << 26

_LARGEST_NUMBER = np.finfo(float).max

# The system's errors for a path that the store does not have.
_ABSENT = (errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.ELOOP, errno.ENAMETOOLONG)

# Characters of a reason in an error's message; those of other packages may quote all that a file has.
_LONGEST_REASON = 600

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
        Coefficients along z, y and x of the scale, of one chunk and of one shard, a file of chunks.
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

    @property
    def affine(self) -> NDArray[np.float64]:
        """4 x 4 matrix from grid to world coordinates, as in a `Volume`."""
        return affine_of(self)


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
        Unit of world coordinates, as in a `Volume`; empty if unknown.
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
        If the folder is missing, or the system cannot read it.
    ValueError
        If it is not a store, incomplete, of another version, damaged in any way, or if a link or key leads out of it.
        The message names the store.
    """
    check_path(path)
    root = Path(os.path.realpath(path))
    with errors_name_store(path):
        attributes = group_attributes(root)
        if "time_steps" in attributes:
            steps = _field(attributes, "time_steps", list)
            raise ValueError(f"expected one volume, got a time series of {len(steps)}: open {path}/t/0")
        check_complete(attributes)
        levels = _field(attributes, "levels", list)
        if not levels:
            raise ValueError("levels: expected at least one, got none")
        check_links(root)
        degree = _one_of(attributes, "degree", range(6))
        return StoreMetadata(
            root,
            degree,
            _one_of(attributes, "boundary", ("mirror", "periodic")),
            _one_of(attributes, "filter", ("interpolate", "none", "smoothing")),
            _number(attributes, "smoothing"),
            _unit(attributes),
            "patient" in attributes and _field(attributes, "patient", bool),
            tuple(_level(root, degree, number, level) for number, level in enumerate(levels)),
        )


@contextlib.contextmanager
def errors_name_store(path: str | os.PathLike[str]) -> Iterator[None]:
    """Name the store in exceptions. All that its content raises becomes a ValueError; errors of the system stay."""
    try:
        yield
    except (OSError, MemoryError, ImportError):
        raise
    except Exception as error:
        reason = str(error).removeprefix(f"{printable(path)}: ") or type(error).__name__
        shown = reason if len(reason) <= _LONGEST_REASON else f"{reason[:_LONGEST_REASON]}..."
        raise ValueError(f"{printable(path)}: {shown}") from error


def cell_shape(shape: Any, degree: int) -> tuple[int, ...]:
    """Cells of a model along each axis. For odd degrees, an axis with a single sample has no cells."""
    return tuple(size if degree % 2 == 0 else size - 1 for size in shape)


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
            f"expected a store of version {VERSION}, got version {_shown(found.get('version'))}: convert its source "
            f"again"
        )
    return found


def check_complete(attributes: dict[str, Any]) -> None:
    """Check that the conversion into a store has ended."""
    if attributes.get("complete") is not True:
        raise ValueError("expected a complete store, got an incomplete one: run its conversion again to continue")


def check_links(root: Path) -> None:
    """Refuse symbolic links that lead out of a store: their targets do not belong to it."""
    for folder, folders, files in os.walk(root):
        for name in (*folders, *files):
            entry = os.path.join(folder, name)
            if os.path.islink(entry) and not Path(os.path.realpath(entry)).is_relative_to(root):
                raise ValueError(f"{printable(os.path.relpath(entry, root))}: expected no link that leaves the store")


def _level(root, degree, number, level):
    name = f"levels[{number}]"
    if not isinstance(level, dict):
        raise ValueError(f"{name}: expected an object, got {_shown(level)}")
    try:
        shape = _counts(level, "shape")
        path, ranges = _key(level, "path"), _key(level, "ranges")
        array = _array(root, path)
        if array.get("shape") != list(shape):
            raise ValueError(f"{path}: expected shape {shape}, got {_shown(array.get('shape'))}")
        chunk, shard = _sharding(path, array)
        _check_ranges(shape, degree, _array(root, ranges), ranges)
        rows = _field(level, "direction", list)
        if len(rows) != 3:
            raise ValueError(f"direction: expected 3 x 3 finite numbers, got {_shown(rows)}")
        direction = np.array([_numbers({"direction": row}, "direction") for row in rows])
        minimum, maximum, offset = (_number(level, field) for field in ("minimum", "maximum", "offset"))
        if minimum > maximum:
            raise ValueError(f"minimum: expected {maximum} at most, got {minimum}")
        spacing, origin = _numbers(level, "spacing"), _numbers(level, "origin")
        if min(spacing) <= 0:
            raise ValueError(f"spacing: expected numbers above 0, got {spacing}")
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error
    return ScaleMetadata(path, ranges, shape, chunk, shard, minimum, maximum, offset, spacing, origin, direction)


def _sharding(path, array):
    """Shapes of chunks and shards, after checking that the array is stored in this version's form."""
    outer, codecs = _storage(path, array, 3)
    if [codec.get("name") for codec in codecs] != ["sharding_indexed"]:
        raise ValueError(f"{path}: expected a regular grid of shards, got others")
    configuration = _field(codecs[0], "configuration", dict)
    for field in ("codecs", "index_codecs"):
        _check_codecs(path, _objects(configuration, field))
    if configuration.get("index_location", "end") != "end":
        raise ValueError(f"{path}: expected the index at a shard's end, got {_shown(configuration['index_location'])}")
    shard, chunk = _counts(outer, "chunk_shape"), _counts(configuration, "chunk_shape")
    if any(outer % inner for outer, inner in zip(shard, chunk)):
        raise ValueError(f"{path}: expected shards of whole chunks, got {shard} and {chunk}")
    return chunk, shard


def _check_ranges(shape, degree, array, ranges):
    """Check that an array is stored in this version's form, and has a range for each octet of a level."""
    outer, codecs = _storage(ranges, array, 5)
    _check_codecs(ranges, codecs)
    _counts(outer, "chunk_shape", 5)
    octets = [math.ceil(cells / OCTET_SIZE) for cells in cell_shape(shape, degree)]
    if array.get("shape") != [*octets, 2, 8]:
        raise ValueError(f"{ranges}: expected shape {(*octets, 2, 8)}, got {_shown(array.get('shape'))}")


def _storage(path, array, dimension):
    """The configuration of an array's regular grid, and its codecs."""
    if array.get("data_type") != "float32":
        raise ValueError(f"{path}: expected float32, got {_shown(array.get('data_type'))}")
    if array.get("storage_transformers"):
        raise ValueError(f"{path}: expected no storage transformers, got {_shown(array['storage_transformers'])}")
    grid, key = (_field(array, field, dict) for field in ("chunk_grid", "chunk_key_encoding"))
    if grid.get("name") != "regular":
        raise ValueError(f"{path}: expected a regular grid, got {_shown(grid.get('name'))}")
    options = key.get("configuration", {})
    if key.get("name") != "default" or not isinstance(options, dict) or options.get("separator", "/") != "/":
        raise ValueError(f"{path}: expected chunks named as c{'/0' * dimension}, got others")
    return _field(grid, "configuration", dict), _objects(array, "codecs")


def _check_codecs(path, codecs):
    """Check that items are stored as they are in memory, with a checksum."""
    names = [codec.get("name") for codec in codecs]
    options = codecs[0].get("configuration", {}) if codecs else {}
    if names != ["bytes", "crc32c"] or not isinstance(options, dict) or options.get("endian", "little") != "little":
        raise ValueError(f"{path}: expected codecs bytes (little) and crc32c, got {_shown(names)}")


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
    try:
        status = os.stat(path)
    except OSError as error:
        if error.errno not in _ABSENT:
            raise
        raise ValueError(f"{name}: expected a file of JSON, got none") from error
    if not stat.S_ISREG(status.st_mode) or status.st_size > _LARGEST_FILE:
        raise ValueError(f"{name}: expected a file of JSON")
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{name}: expected JSON, got text that cannot be parsed: {error}") from error
    if not isinstance(content, dict):
        raise ValueError(f"{name}: expected an object, got {type(content).__name__}")
    return content


def _key(level, field):
    """The key of an array, which must not lead out of the store."""
    key = _field(level, field, str)
    parts = key.split("/")
    if any(part in ("", ".", "..") for part in parts) or "\0" in key or "\\" in key or len(key) > 255:
        raise ValueError(f"{field}: expected a key within the store, got {_shown(key)}")
    return key


def _field(container, field, kind):
    value = container.get(field)
    if not isinstance(value, kind):
        raise ValueError(f"{field}: expected a {kind.__name__}, got {_shown(value)}")
    return value


def _objects(container, field):
    values = _field(container, field, list)
    if not all(isinstance(value, dict) for value in values):
        raise ValueError(f"{field}: expected a list of objects, got {_shown(values)}")
    return values


def _one_of(container, field, values):
    value = container.get(field)
    if isinstance(value, bool) or value not in values:
        raise ValueError(f"{field}: expected one of {', '.join(map(str, values))}, got {_shown(value)}")
    return value


def _unit(attributes):
    """The symbol of the unit, as in a `Volume`; stores have the name that OME-Zarr gives it."""
    name = _field(attributes, "unit", str) if "unit" in attributes else ""
    return "mm" if attributes.get("patient") is True and not name else UNITS.get(name, name)


def _number(container, field):
    value = container.get(field)
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not (is_number and -_LARGEST_NUMBER <= value <= _LARGEST_NUMBER):
        raise ValueError(f"{field}: expected a finite number, got {_shown(value)}")
    return float(value)


def _numbers(container, field):
    values = container.get(field)
    if not isinstance(values, list) or len(values) != 3:
        raise ValueError(f"{field}: expected three numbers, got {_shown(values)}")
    return tuple(_number({field: value}, field) for value in values)


def _counts(container, field, dimension=3):
    values = container.get(field)
    is_count = isinstance(values, list) and all(type(value) is int and 0 < value < 2**31 for value in values)
    if not is_count or len(values) != dimension:
        raise ValueError(f"{field}: expected {dimension} whole numbers above 0, got {_shown(values)}")
    return tuple(values)
