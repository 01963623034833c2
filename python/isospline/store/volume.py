"""Volumes whose coefficients stay in a store. Chunks are read when rays enter them."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from .. import _core
from ..base.handed import handed
from ..base.parameters import check_path, printable
from ..base.signatures import explained
from ..io.confinement import check_within
from ..scene import Volume
from .budget import parse_memory
from .layout import Part, read_ranges
from .metadata import ScaleMetadata, StoreMetadata, errors_name_store, read_metadata

#: In the order of the C++ enumeration.
_BOUNDARIES, _FILTERS = ("mirror", "periodic"), ("interpolate", "none", "smoothing")


@explained
def open_volume(
    path: str | os.PathLike[str],
    *,
    memory_limit: int | str = "4GB",
    scale: int = 0,
    within: str | os.PathLike[str] | None = None,
) -> Volume:
    """Open a volume of a store, written by `convert` or ``isospline convert``, without reading its coefficients.

    `Isosurface`, `Scene`, `render`, rays and `Volume.sample` use it like a volume in memory, and hits are the same.
    Chunks of coefficients are read and checked when rays or points enter them. If memory exceeds the limit, the least
    recently used bricks are dropped; they are made again when they are needed.

    Parameters
    ----------
    path : str or path-like
        Folder of the store.
    memory_limit : int or str, bytes
        An approximate limit on the memory of chunks, bricks and their ranges: a number of bytes, or a text such as
        ``"4GB"`` or ``"512MiB"``. It does not include pictures and Embree's index, which has about 100 bytes for each
        16 x 16 x 16 cells that the surface crosses.
    scale : int
        Scale of the store's spline pyramid: 0 has the resolution of the data, and each further scale has half the
        resolution of the previous one. See `scale_for`.
    within : str or path-like, optional
        A folder in which the store must be after symbolic links are resolved. Links and keys that lead out of the store
        are always refused.

    Returns
    -------
    Volume
        `Volume.paging` has the bytes read and the memory used. Pickling stores the path and not the coefficients.

    Raises
    ------
    OSError
        If the folder is missing, or the system cannot read a file.
    ValueError
        If `path` is not a store of one volume, the store is incomplete or damaged in any way, it has no such scale, or
        `memory_limit` is too small for it. Also if it is not `within` the folder. Later calls raise an exception that
        is both a ValueError and an OSError if they need a chunk that is missing, truncated or fails its checksum; its
        message names the chunk and the file.
    """
    check_path(path)
    check_within(path, within, "a path")
    metadata = read_metadata(path)
    last = len(metadata.scales) - 1
    if not isinstance(scale, (int, np.integer)) or scale not in range(last + 1):
        raise ValueError(f"scale: expected 0 to {last}, got {scale!r}")
    return open_level(metadata, metadata.scales[scale], memory_limit)


@handed
def reopen(folder: str, array: str, memory_limit: int, part: Part | None = None) -> Volume:
    """Open the volume of an array of a store again, in another process, or a part of it for rays."""
    metadata = read_metadata(folder)
    for level in metadata.scales:
        if level.path == array:
            return open_level(metadata, level, memory_limit, part)
    raise ValueError(f"{printable(folder)}: expected a store with the array {array}, got one without")


def open_level(
    metadata: StoreMetadata, level: ScaleMetadata, memory_limit: int | str, part: Part | None = None
) -> Volume:
    """The volume of a level of a store, or a part of it."""
    state = dict(
        spacing=np.array(level.spacing),
        origin=np.array(level.origin),
        direction=level.direction,
        degree=metadata.degree,
        boundary=_BOUNDARIES.index(metadata.boundary),
        filter=_FILTERS.index(metadata.filter),
        smoothing=metadata.smoothing,
        axes=0,
        unit=metadata.unit,
        patient=metadata.patient,
        shape=level.shape[::-1],
        minimum=level.minimum,
        maximum=level.maximum,
        offset=level.offset,
    )
    limit = parse_memory(memory_limit)
    with errors_name_store(metadata.path):
        ranges = np.ascontiguousarray(read_ranges(metadata, level, part), np.float32)
        folder = Path(metadata.path) / level.path
        return _core.open_sharded_volume(folder, state, level.shard[::-1], level.chunk[::-1], ranges, limit)
