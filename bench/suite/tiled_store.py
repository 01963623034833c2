"""Stores of a volume that repeats, as large as wanted, made without filtering the whole."""

import json
import shutil
from pathlib import Path

import numpy as np

import isospline
from isospline import store

#: Samples along each edge of the tile, of a shard at level 0, and of the smallest tile of a level that has a chunk.
EDGE, LEAST = 256, 32


def tile_of(data):
    """256^3 samples of a volume: its middle, repeated where it is smaller."""
    repeated = np.pad(data, [(0, max(0, EDGE - count)) for count in data.shape], mode="wrap")
    begin = [(count - EDGE) // 2 for count in repeated.shape]
    return np.ascontiguousarray(repeated[tuple(slice(first, first + EDGE) for first in begin)])


def write_tiled_store(tile_store, folder, count):
    """Copy the store of a tile, whose boundary is periodic, `count` times along each axis.

    The coefficients of a volume that repeats repeat too, and so do the ranges of its bricks and the levels of its
    pyramid. Each shard is a file of its own, as if all had been filtered.
    """
    tile_store, folder = Path(tile_store), Path(folder)
    group = json.loads((tile_store / "zarr.json").read_text(encoding="utf-8"))
    levels = [level for level in group["attributes"]["isospline"]["levels"] if min(level["shape"]) >= LEAST]
    for level in levels:
        _repeat_array(tile_store / level["path"], folder / level["path"], count)
        _repeat_ranges(tile_store, level["ranges"], folder, count)
        level["shape"] = [count * size for size in level["shape"]]
    group["attributes"]["isospline"]["levels"] = levels
    for multiscale in group["attributes"]["ome"]["multiscales"]:
        multiscale["datasets"] = multiscale["datasets"][: len(levels)]
    (folder / "zarr.json").write_text(json.dumps(group), encoding="utf-8")


def make_tile_store(data, folder):
    """The store of a tile."""
    isospline.convert(tile_of(data), folder, boundary="periodic", overwrite=True)


def _repeat_array(tile, folder, count):
    about = json.loads((tile / "zarr.json").read_text(encoding="utf-8"))
    edges = about["chunk_grid"]["configuration"]["chunk_shape"]
    assert list(edges) == list(about["shape"]), "expected a tile of one shard"
    about["shape"] = [count * size for size in about["shape"]]
    folder.mkdir(parents=True)
    (folder / "zarr.json").write_text(json.dumps(about), encoding="utf-8")
    for place in np.ndindex(count, count, count):
        target = folder.joinpath("c", *map(str, place))
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(tile / "c" / "0" / "0" / "0", target)


def _repeat_ranges(tile_store, key, folder, count):
    import zarr

    metadata = store.read_metadata(tile_store)
    level = next(level for level in metadata.scales if level.ranges == key)
    ranges = np.tile(store.read_ranges(metadata, level), (count, count, count, 1, 1))
    array = zarr.open_array(tile_store / key, mode="r")
    chunks = tuple(min(64, size) for size in ranges.shape[:3]) + ranges.shape[3:]
    zarr.create_array(
        folder / key,
        shape=ranges.shape,
        chunks=chunks,
        dtype=ranges.dtype,
        compressors=array.compressors,
        fill_value=0,
        config={"write_empty_chunks": True},
    )[:] = ranges
