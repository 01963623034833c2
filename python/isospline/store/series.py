"""Time series: a store whose time steps are stores, in its group ``t``."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..base.parameters import check_path, printable
from ..io import VolumeData
from ..io.read import check_used
from . import layout
from .conversion import OR_OVERWRITE, check_options, write_attributes
from .metadata import check_complete, errors_name_store, group_attributes
from .sources import ome_zarr
from .sources.opening import open_source
from .sources.source import Source

#: Opens the samples of a time step.
Opening = Callable[[], Source]


def steps_of(given: Any, axes: str, reading: dict[str, Any]) -> list[Opening] | None:
    """Functions that open the time steps of a list of sources, an array [t, z, y, x] or an OME-Zarr image.

    None for a single volume.
    """
    if isinstance(given, (list, tuple)) and not hasattr(given, "dtype"):
        if not given:
            raise ValueError("source: expected at least one time step, got none")
        return [lambda each=each: open_source(each, axes, reading) for each in given]  # type: ignore[misc]
    if isinstance(given, (str, os.PathLike)):
        path = Path(given)
        if not ome_zarr.is_zarr(path):
            return None
        check_used(path, **reading, has_names=True)
        count = ome_zarr.open_zarr(path, reading["name"], axes)[1]
        if count is None:
            return None
        return [
            lambda step=step: ome_zarr.open_zarr(path, reading["name"], axes, step)[0]  # type: ignore[misc]
            for step in range(count)
        ]
    if isinstance(given, VolumeData) or len(getattr(given, "shape", ())) != 4:
        return None

    def opener(step):
        return lambda: open_source(_step(given, step), axes, reading)

    return [opener(step) for step in range(given.shape[0])]


def _step(array, step):
    return array[step] if isinstance(array, np.ndarray) else _Step(array, step)


class _Step:
    """One time step of an array [t, ...], read when it is sliced."""

    def __init__(self, array: Any, step: int) -> None:
        self._array, self._step = array, step
        self.shape, self.dtype = array.shape[1:], array.dtype

    def __getitem__(self, slices: Any) -> Any:
        return self._array[(self._step, *slices)]


def begin(root: Path, count: int, options: dict[str, Any]) -> list[Path]:
    """Create a series, or continue it with the same options; returns the folders of its time steps."""
    zarr = layout.zarr()
    if not (root / "zarr.json").exists():
        root.mkdir(exist_ok=True)
        group = zarr.open_group(str(root), mode="a")
        group.require_group("t")
        _describe(root, count, options, complete=False)
    attributes = group_attributes(root)
    if attributes.get("complete") or "time_steps" not in attributes:
        raise FileExistsError(f"{printable(root)}: expected no store, or an incomplete one; {OR_OVERWRITE}")
    check_options(root, attributes["conversion"]["options"], {"time_steps": count, **options})
    return [root / key for key in attributes["time_steps"]]


def finish(root: Path, count: int, options: dict[str, Any]) -> None:
    """Mark all time steps as complete."""
    _describe(root, count, options, complete=True)


def _describe(root, count, options, complete):
    keys = [f"t/{step}" for step in range(count)]
    state = {"conversion": {"options": {"time_steps": count, **options}}}
    write_attributes(root, {"complete": complete, "time_steps": keys, **state})


def time_steps(path: str | os.PathLike[str]) -> list[Path]:
    """The stores of the time steps of a complete series, in order; for a single volume, its own store.

    Raises
    ------
    OSError
        If the folder is missing, or the system cannot read it.
    ValueError
        If `path` is not a store, incomplete, damaged, or a key leads out of it. The message names the store.

    Examples
    --------
    >>> import tempfile, numpy as np, isospline
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = isospline.convert(np.zeros((2, 8, 8, 8)), f"{folder}/series.zarr")
    ...     [step.name for step in isospline.store.time_steps(path)]
    ['0', '1']
    """
    check_path(path)
    root = Path(os.path.realpath(path))
    with errors_name_store(path):
        attributes = group_attributes(root)
        check_complete(attributes)
        keys = attributes.get("time_steps")
        if keys is None:
            return [root]
        expected = [f"t/{step}" for step in range(len(keys))] if isinstance(keys, list) else None
        if keys != expected:
            raise ValueError(f"time_steps: expected t/0, t/1, ..., got {keys!r}")
        steps = [root / key for key in keys]
        for step in steps:
            if not Path(os.path.realpath(step)).is_relative_to(root):
                raise ValueError(f"{step.relative_to(root)}: expected a folder within the store, got a link out of it")
        return steps
