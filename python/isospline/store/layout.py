"""The arrays of a store: creating, writing and reading them. Errors name the broken chunk."""

from __future__ import annotations

import contextlib
import itertools
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.parameters import printable
from .metadata import OCTET_SIZE, ScaleMetadata, StoreMetadata

#: Coefficients along each edge of a chunk, and chunks along each edge of a shard. A shard is one file.
CHUNK, SHARD_CHUNKS = 32, 8

#: Octets along each edge of the largest chunk of an array of ranges.
_MOST_OCTETS = 64

#: A box within a volume, as fractions of its octets: from and to along z, y and x.
Part = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]

#: The entry in a shard's index for a missing chunk.
_NO_CHUNK = 2**64 - 1

_CHECKSUM_BYTES = 4


def zarr() -> Any:
    """The package that reads and writes stores."""
    try:
        import zarr
    except ImportError as error:
        raise ModuleNotFoundError(
            f"stores need the package {error.name}, version 3 of Zarr: pip install isospline[store], on Python 3.11 or "
            "later",
            name=error.name,
        ) from error
    return zarr


def create_coefficients(root: Path, key: str, shape: Any, chunk: int, shard: Any) -> None:
    """Create the empty array of a level's coefficients."""
    zarr().open_group(str(root), mode="r+").require_group("coefficients")
    _create_sharded(root, key, shape, chunk, shard, "float32", [])


def create_samples(root: Path, key: str, shape: Any, chunk: int, shard: Any, dtype: Any) -> None:
    """Create the empty array of a level's samples, for other programs."""
    _create_sharded(root, key, shape, chunk, shard, dtype, [zarr().codecs.ZstdCodec(level=1)])


def _create_sharded(root, key, shape, chunk, shard, dtype, compressors):
    sharding: Any = dict(chunks=(chunk,) * 3, shards=tuple(shard), dimension_names=("z", "y", "x"))
    _create(root, key, tuple(shape), dtype, compressors, **sharding)


def _create(root, key, shape, dtype, compressors, **options):
    codecs = zarr().codecs
    with writing(root / key / "zarr.json"):
        zarr().create_array(
            str(root),
            name=key,
            shape=shape,
            dtype=dtype,
            serializer=codecs.BytesCodec(endian="little"),
            compressors=[*compressors, codecs.Crc32cCodec()],
            filters=None,
            fill_value=0,
            overwrite=True,
            **options,
        )


def create_ranges(root: Path, key: str, cell_shape: Any, shard: Any) -> None:
    """Create the empty array of a level's ranges. If possible, each chunk is for one shard of coefficients."""
    with writing(root / key / "zarr.json"):
        zarr().open_group(str(root), mode="r+").require_group("ranges")
    shape = (*(math.ceil(cells / OCTET_SIZE) for cells in cell_shape), 2, 8)
    chunks = (*(min(edge // OCTET_SIZE, _MOST_OCTETS) for edge in shard), 2, 8)
    _create(root, key, shape, "float32", [], chunks=chunks)


def shard_edge(size: int, chunk: int, chunks: int = SHARD_CHUNKS) -> int:
    """Coefficients along one edge of a shard: whole chunks and whole octets, not more than the array needs."""
    step = math.lcm(chunk, OCTET_SIZE)
    most = max(chunk * chunks // step, 1) * step
    return min(most, math.ceil(size / step) * step)


def open_array(root: Path, key: str, mode: str = "r") -> Any:
    """Open an array of a store. Chunks of zeros are written too."""
    return zarr().open_array(str(root), path=key, mode=mode).with_config({"write_empty_chunks": True})


def chunk_path(root: Path, key: str, index: Any) -> Path:
    """The file of a chunk, or of a shard."""
    return root.joinpath(key, "c", *map(str, index))


def blocks_of(shape: Any, edge: Any) -> list[tuple[int, ...]]:
    """Indices of the blocks of these edges that cover an array, the last axis fastest."""
    return list(itertools.product(*(range(math.ceil(size / step)) for size, step in zip(shape, edge))))


def box_of(index: Any, edge: Any, shape: Any) -> tuple[tuple[int, int], ...]:
    """The first item of a block, and the one after its last item, along each axis."""
    return tuple((at * step, min((at + 1) * step, size)) for at, step, size in zip(index, edge, shape))


def slices_of(box: Any) -> tuple[slice, ...]:
    """The slices of a box, for indexing."""
    return tuple(slice(first, last) for first, last in box)


@contextlib.contextmanager
def writing(path: Path) -> Iterator[None]:
    """Name the file that could not be written, for example because the disk is full."""
    try:
        yield
    except OSError as error:
        reason = f"{error.strerror or error}; the store is incomplete; run the same conversion again to continue"
        raise OSError(error.errno, reason, str(path)) from error


def check_shard(path: Path, chunks: Any, needed: Any, chunk_bytes: int | None) -> str | None:
    """The defect of a shard's file, by its size and its index; None if there is none.

    `chunks` is the number of chunks along each axis; only those in `needed` must exist. Each has `chunk_bytes`, or any
    number if it is compressed. Checksums are checked when
    chunks are read.
    """
    try:
        size = os.path.getsize(path)
        index_bytes = 16 * math.prod(chunks) + _CHECKSUM_BYTES
        if size < index_bytes:
            return "the file is truncated"
        with open(path, "rb") as file:
            file.seek(size - index_bytes)
            index = np.frombuffer(file.read(index_bytes - _CHECKSUM_BYTES), "<u8").reshape(*chunks, 2)
    except FileNotFoundError:
        return "the file is missing"
    for place in itertools.product(*(range(first, last) for first, last in needed)):
        offset, length = map(int, index[place])
        is_short = chunk_bytes is not None and length != chunk_bytes
        if offset == _NO_CHUNK or is_short or offset + length > size - index_bytes:
            return f"chunk {'/'.join(map(str, place))} of the shard is missing or truncated"
    return None


def is_whole_shard(root: Path, key: str, array: Any, index: Any) -> bool:
    """Whether a shard has been written with all of its chunks."""
    per_shard = tuple(outer // inner for outer, inner in zip(array.shards, array.chunks))
    needed = tuple(
        (0, min(count, math.ceil((size - at * outer) / inner)))
        for count, size, at, outer, inner in zip(per_shard, array.shape, index, array.shards, array.chunks)
    )
    path = chunk_path(root, key, index)
    return check_shard(path, per_shard, needed, _chunk_bytes(array)) is None


def is_whole_chunk(root: Path, key: str, array: Any, index: Any) -> bool:
    """Whether a chunk of an array without shards has been written."""
    path = chunk_path(root, key, index)
    return path.exists() and os.path.getsize(path) == _chunk_bytes(array)


def read_box(root: Path, key: str, box: Any) -> NDArray[np.float32]:
    """Items of an array of a store. An error names the chunk that cannot be read."""
    array = open_array(root, key)
    grid = array.shards or array.chunks
    covered = [range(first // edge, math.ceil(last / edge)) for (first, last), edge in zip(box, grid)]
    for index in itertools.product(*covered):
        whole = is_whole_shard if array.shards else is_whole_chunk
        if not whole(root, key, array, index):
            raise _broken(root, key, index, "it is missing or truncated")
    try:
        return array[slices_of(box)]
    except Exception:
        for index in itertools.product(*covered):
            part = tuple(
                (max(first, low), min(last, high))
                for (first, last), (low, high) in zip(box_of(index, grid, array.shape), box)
            )
            try:
                array[slices_of(part)]
            except Exception as error:
                reason = " ".join(str(error).split()) or type(error).__name__
                raise _broken(root, key, index, reason) from error
        raise


def read_ranges(store: StoreMetadata, level: ScaleMetadata, part: Part | None = None) -> NDArray[np.float32]:
    """The ranges of a level: (octets z, octets y, octets x, 2, 8) float32 array.

    With a part, all bricks outside of it get empty ranges, so that rays pass through them.
    """
    shape = open_array(store.path, level.ranges).shape
    if part is None:
        return read_box(store.path, level.ranges, tuple((0, size) for size in shape))
    ranges = np.empty(shape, np.float32)
    ranges[..., 0, :], ranges[..., 1, :] = np.inf, -np.inf
    box = tuple((round(lower * size), round(upper * size)) for (lower, upper), size in zip(part, shape))
    if all(first < last for first, last in box):
        box += ((0, 2), (0, 8))
        ranges[slices_of(box)] = read_box(store.path, level.ranges, box)
    return ranges


def _broken(root, key, index, reason):
    name = "/".join([key, "c", *map(str, index)])
    return ValueError(f"{printable(root)}: chunk {name} cannot be read: {reason}")


def _chunk_bytes(array):
    """The bytes of each chunk with its checksum; None if they are compressed."""
    if len(array.compressors) > 1:
        return None
    return math.prod(array.chunks) * array.dtype.itemsize + _CHECKSUM_BYTES
