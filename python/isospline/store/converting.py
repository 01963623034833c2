"""The function that writes stores."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from ..base.mistakes import sentence
from ..base.parameters import check_count, check_type
from ..base.progress import as_callable, part_of
from ..base.signatures import explained
from ..io.read import check_frame, check_nan
from ..io.told import spacing_given
from . import series
from .budget import parse_memory
from .conversion import Conversion, check_apart, check_out, clear
from .layout import CHUNK, SHARD_CHUNKS, zarr
from .model import Model
from .sources.opening import open_source
from .sources.source import WithoutNan


@explained
def convert(
    source: Any,
    out: str | os.PathLike[str],
    *,
    degree: int = 2,
    boundary: str = "mirror",
    filter: str = "interpolate",
    smoothing: float = 0.0,
    spacing: ArrayLike | None = None,
    origin: ArrayLike | None = None,
    direction: ArrayLike | None = None,
    axes: str = "zyx",
    shape: Any = None,
    dtype: DTypeLike | None = None,
    offset: int = 0,
    name: str | None = None,
    nan: float | None = None,
    chunk: int = CHUNK,
    shard: int | None = None,
    image: bool = True,
    memory_limit: int | str = "2GB",
    workers: int | None = None,
    client: Any = None,
    overwrite: bool = False,
    progress: Any = None,
) -> Path:
    """Compute the coefficients of a volume of any size, block by block, into a store on disk.

    The store is a Zarr 3 group. It has the coefficients, those of a pyramid of coarser models, each with half the
    resolution of the previous one, and the ranges of their bricks, with which rays skip bricks that they cannot hit.
    For other programs it is also an OME-Zarr image: the samples as they were given, and those of the coarser models.
    The coefficients equal those of ``Volume``, to the precision of float32: each block is filtered with enough samples
    around it.

    If an interrupted conversion is called again with the same source and options, it continues where it stopped.

    Parameters
    ----------
    source : path, VolumeData or array-like
        Any file that `read_volume` reads; folders of Zarr 2 and 3, OME-Zarr (the finest level of a multiscale image,
        with its place and unit) and N5; a dataset of HDF5, as ``"file.h5:/dataset"``; samples in memory; or any object
        with ``shape``, ``dtype`` and slicing. A list of sources, an array [t, z, y, x] and an OME-Zarr image with time
        steps give a time series, in which each step is a store: see `isospline.store.time_steps`.
    out : str or path-like
        The folder of the store, which is created.
    degree, boundary, filter, smoothing
        Parameters of the model, as in `Volume`; the degree is 0 to 5.
    spacing, origin, direction : optional
        Replace those of the source.
    axes : {"zyx", "xyz"}
        Order of the axes of an array.
    shape, dtype, offset, name : optional
        For a path, as in `read_volume`.
    nan : float, optional
        Finite number in place of samples that are NaN; by default they are refused.
    chunk : int
        Coefficients along each edge of a chunk, the smallest unit that is read: a multiple of 8, at most 128.
    shard : int, optional
        The largest number of coefficients along each edge of a shard, a file of chunks: a multiple of `chunk`, at most
        and by default 8 chunks, if the memory limit allows it. Each block of the work is a shard.
    image : bool
        Whether to write the samples for other programs. Without them, the store is smaller, and not an OME-Zarr image.
    memory_limit : int or str
        Bytes that this process may use, including those that it already uses, or a text such as ``"2GB"``; with a
        client, bytes of each worker.
    workers : int, optional
        Largest number of blocks at a time; by default one for each processor, if the memory is sufficient. Not with a
        client, which has its own.
    client : dask.distributed.Client, optional
        The cluster that computes the blocks. Its workers must find the source and the store at the same paths.
    overwrite : bool
        Whether to replace an existing store.
    progress : callable or bool, optional
        Called with the finished fraction; cancels if it returns a false value other than None. True shows a bar.

    Returns
    -------
    pathlib.Path
        The store's folder.

    Raises
    ------
    OSError
        If the source cannot be read or the store cannot be written, for example because the disk is full. A
        FileExistsError if `out` is a complete store, unless `overwrite` is True, or something else than a store.
    ValueError
        For samples that are not finite (the message names the first index of a block), for a memory limit that is too
        small for a single block, for a conversion that was begun with other options or samples, for an `out` that holds
        the source, and for any other parameter out of range.
    TypeError
        For another type of source or parameter.
    ImportError
        If Zarr is not installed: ``pip install isospline[store]``.

    Examples
    --------
    >>> import tempfile, numpy as np, isospline
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     samples = isospline.volumes.torus().values(96)
    ...     path = isospline.convert(samples, f"{folder}/torus.zarr", spacing=0.5)
    ...     sorted(entry.name for entry in path.iterdir())
    ['0', '1', 'coefficients', 'ranges', 'zarr.json']
    """
    model = Model(degree, boundary, filter, float(smoothing))
    if axes not in ("zyx", "xyz"):
        raise ValueError(f'axes: expected "zyx" or "xyz", got {axes!r}')
    check_type(chunk, "chunk", (int, np.integer), "a whole number")
    if not 8 <= chunk <= 128 or chunk % 8:
        raise ValueError(f"chunk: expected a multiple of 8 from 8 to 128, got {chunk}")
    if shard is not None:
        check_type(shard, "shard", (int, np.integer), "a whole number or None")
        if not chunk <= shard <= SHARD_CHUNKS * chunk or shard % chunk:
            raise ValueError(f"shard: expected a multiple of the chunk, {chunk} to {SHARD_CHUNKS * chunk}, got {shard}")
    if workers is not None:
        check_count(workers, "workers")
    if client is not None and not (hasattr(client, "nthreads") and hasattr(client, "map")):
        raise TypeError(sentence("client", "a dask.distributed.Client or None", client))
    if client is not None and workers is not None:
        raise ValueError("workers: cannot be combined with a client, which has its own")
    check_type(overwrite, "overwrite", (bool, np.bool_), "True or False")
    check_type(image, "image", (bool, np.bool_), "True or False")
    limit = parse_memory(memory_limit)
    report = as_callable(progress)
    frame = check_frame(spacing, origin, direction)
    check_nan(nan)
    zarr()  # fail early if missing
    reading = dict(shape=shape, dtype=dtype, offset=offset, name=name)

    given = {field: value for field, value in frame.items() if value is not None}
    modelled = {field: getattr(model, field) for field in ("degree", "boundary", "filter", "smoothing")}

    def convert(opened, root, report, **options):
        opened = opened if nan is None else WithoutNan(opened, nan)
        place = {field: np.asarray(value, float).tolist() for field, value in opened.move(**given).frame.items()}
        Conversion(opened, root, model, modelled | place, bool(image), report).run(
            int(chunk), SHARD_CHUNKS if shard is None else int(shard // chunk), limit, workers, client, **options
        )

    steps = series.steps_of(source, axes, reading)
    if steps is None:
        with spacing_given(spacing):
            opened = open_source(source, axes, reading)
        root = check_out(out)
        check_apart(root, opened)
        convert(opened, root, report, overwrite=bool(overwrite))
        return root
    root = check_out(out)
    if overwrite and root.exists():
        for open_step in steps:  # an error must come before the old store is lost
            with spacing_given(spacing):
                check_apart(root, open_step())
        clear(root)
    options = modelled | {"chunk": int(chunk), "image": bool(image)}
    options |= {field: np.asarray(value, float).tolist() for field, value in given.items()}
    for number, (step, open_step) in enumerate(zip(series.begin(root, len(steps), options), steps)):
        with spacing_given(spacing):
            opened = open_step()
        convert(opened, step, part_of(report, number, len(steps)), is_step=True)
    series.finish(root, len(steps), options)
    return root
