"""Conversion of samples to a store of coefficients, in blocks, within a memory limit."""

from __future__ import annotations

import contextlib
import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from ..base.parameters import check_path, printable
from ..base.progress import tell
from . import layout, ome, tasks
from .budget import Budget, default_threads
from .metadata import VERSION, cell_shape, group_attributes
from .model import LookAtBlock, Model, PrefilterShard, SamplesOfBlock, offset_of, together
from .pyramid import ReduceShard, SampleShard, level_shapes, origin_shift
from .ranges import WriteRanges
from .sources.source import Source

#: The fraction of the progress for staging the samples, and the relative costs of the other steps per sample.
_STAGING_PART = 0.2
_RANGE_COST, _PREFILTER_COST, _RANGES_COST, _REDUCE_COST, _SAMPLE_COST = 1.0, 4.0, 2.0, 3.0, 1.0

#: What errors offer where a store is in the way.
OR_OVERWRITE = "or overwrite=True, --overwrite on the command line"


class Conversion:
    """One run of a conversion into a store. It may continue an earlier, interrupted run."""

    def __init__(
        self, source: Source, root: Path, model: Model, options: dict[str, Any], image: bool, progress: Any
    ) -> None:
        self._source, self._root, self._model = source, root, model
        self._state: dict[str, Any] = {}
        self._options, self._image = options | {"image": image}, image
        self._progress = progress
        self._shapes = level_shapes(source.shape, model.degree, model.boundary)
        self._begin, self._spent, self._total = 0.0, 0.0, 1.0

    def run(
        self,
        chunk: int,
        shard_chunks: int,
        memory_limit: int,
        workers: int | None,
        client: Any,
        *,
        overwrite: bool = False,
        is_step: bool = False,
    ) -> None:
        """Do all steps that are not done yet.

        What `overwrite` replaces stays until all samples have been looked at. A complete store is an error, but for the
        step of a series, whose samples must then be the same.
        """
        threads = workers or default_threads()
        if client is not None:
            threads = max(client.nthreads().values(), default=1)
        budget = Budget(memory_limit, threads, self._source, self._model, chunk, shard_chunks, client is not None)
        budget.shard()  # raises if the limit is too small, before anything is written
        options = self._options | {"chunk": chunk, "source": self._source.identity}
        staged = self._root / "staged"
        with _locked(self._root):
            is_done = is_step and is_complete(self._root)
            self._state = {"options": options} if overwrite else _begin(self._root, options, is_step)
            if is_done and "path" in self._source.identity:
                return
            self._report(0.0)
            with _without(staged) if overwrite else contextlib.nullcontext():
                source = self._source.stage(staged, lambda part: self._report(_STAGING_PART * part))
                self._begin = 0.0 if source is self._source else _STAGING_PART
                first = tuple(self._state.get("shard") or budget.shard())
                shards = self._plan(first, chunk)
                run = dict(workers=budget.workers(shards[0]), client=client)
                about = self._look_at_samples(source, shards[0], run)
            if is_done:
                return
            if overwrite:
                clear(self._root, "staged")
                self._state = _begin(self._root, options)
            self._create(chunk, first)
            self._save(**about)
            self._prefilter(source, run)
            for number in range(len(shards)):
                self._make_ranges(number, run)
                if number + 1 < len(shards):
                    self._reduce(number, run)
            self._finish()

    def _create(self, chunk, first):
        """Create the arrays of all levels, unless an earlier run did; `first` is what `_plan` got."""
        if "shard" not in self._state:
            clear(self._root, "zarr.json", "staged")
            for number, (shape, edges) in enumerate(zip(self._shapes, self._shards)):
                layout.create_coefficients(self._root, f"coefficients/{number}", shape, chunk, edges)
                if self._image:
                    layout.create_samples(self._root, str(number), shape, chunk, edges, _stored(self._source.dtype))
                cells = cell_shape(shape, self._model.degree)
                layout.create_ranges(self._root, f"ranges/{number}", cells, edges)
            self._save(shard=first)
        for partial in self._root.rglob("*.partial"):
            partial.unlink()

    def _plan(self, first, chunk):
        """Compute the edges of all levels' shards, from those that the finest one may have, and the total work."""
        sizes = [float(np.prod(shape)) for shape in self._shapes]
        self._sizes = sizes
        self._total = sizes[0] * (_RANGE_COST + _PREFILTER_COST) + sum(sizes) * _RANGES_COST
        self._total += sum(sizes[:-1]) * _REDUCE_COST + self._image * sum(sizes[1:]) * _SAMPLE_COST
        self._shards = [
            tuple(min(edge, layout.shard_edge(size, chunk)) for edge, size in zip(first, shape))
            for shape in self._shapes
        ]
        return self._shards

    def _look_at_samples(self, source, edge, run):
        """One pass over the samples: their range and their digest. Files of an earlier run are not read again."""
        names = ("minimum", "maximum", "digest")
        if "path" in source.identity and "minimum" in self._state:
            self._advance(self._sizes[0] * _RANGE_COST)
            return {name: self._state[name] for name in names if name in self._state}
        found: list[SamplesOfBlock] = []
        self._run(LookAtBlock(source, edge), layout.blocks_of(source.shape, edge), _RANGE_COST, 0, run, found)
        about: dict[str, Any] = dict(zip(names, together(found)))
        offset_of(about["minimum"], about["maximum"], source.dtype)
        for name, value in about.items():
            if self._state.get(name, value) != value:
                raise ValueError(
                    "source: expected the samples of the conversion that was begun, got others: their "
                    f"{name} is {value}, not {self._state[name]}; {OR_OVERWRITE}"
                )
        return about

    def _offset(self):
        return offset_of(self._state["minimum"], self._state["maximum"], self._source.dtype)

    def _prefilter(self, source, run):
        samples_key = "0" if self._image else None
        task = PrefilterShard(self._root, "coefficients/0", source, self._model, self._offset(), samples_key)
        self._run(task, layout.blocks_of(source.shape, self._shards[0]), _PREFILTER_COST, 0, run)

    def _make_ranges(self, number, run):
        task = WriteRanges(
            self._root, f"coefficients/{number}", f"ranges/{number}", self._model.degree, self._model.boundary
        )
        array = layout.open_array(self._root, f"ranges/{number}")
        self._run(task, layout.blocks_of(array.shape, array.chunks), _RANGES_COST, number, run)

    def _reduce(self, number, run):
        fine, coarse = f"coefficients/{number}", f"coefficients/{number + 1}"
        blocks = layout.blocks_of(self._shapes[number + 1], self._shards[number + 1])
        model = (self._model.degree, self._model.boundary)
        self._run(ReduceShard(self._root, fine, coarse, *model), blocks, _REDUCE_COST, number, run)
        if self._image:
            numbers = (self._offset(), self._state["minimum"], self._state["maximum"])
            task = SampleShard(self._root, coarse, str(number + 1), *model, *numbers)
            self._run(task, blocks, _SAMPLE_COST, number + 1, run)

    def _run(self, task, blocks, cost, number, run, results=None):
        each = self._sizes[number] * cost / max(len(blocks), 1)

        def done(result):
            if results is not None:
                results.append(result)
            self._advance(each)

        tasks.run(task, blocks, done=done, **run)

    def _advance(self, spent):
        self._spent += spent
        self._report(self._begin + (1 - self._begin) * self._spent / self._total)

    def _report(self, fraction):
        tell(self._progress, min(fraction, 1.0))

    def _finish(self):
        """Write the description of the store, and then mark it as complete."""
        source, degree = self._source, self._model.degree
        spacing, origin = np.array(source.spacing, float), np.array(source.origin, float)
        direction = np.array(source.direction, float)
        levels = []
        for number, shape in enumerate(self._shapes):
            levels.append(
                {
                    "path": f"coefficients/{number}",
                    "ranges": f"ranges/{number}",
                    "shape": list(shape),
                    "minimum": self._state["minimum"],
                    "maximum": self._state["maximum"],
                    "offset": self._offset(),
                    "spacing": spacing.tolist(),
                    "origin": origin.tolist(),
                    "direction": direction.tolist(),
                }
            )
            halved = np.array([size > 1 for size in reversed(shape)])
            origin = origin + direction @ (spacing * origin_shift(degree) * halved)
            spacing = np.where(halved, 2 * spacing, spacing)
        (self._root / "staged").unlink(missing_ok=True)
        attributes = layout.zarr().open_group(str(self._root), mode="r+")
        if self._image:
            shown = ome.multiscales(self._root.stem, levels, source.unit, source.patient)
            with layout.writing(self._root / "zarr.json"):
                attributes.update_attributes({"ome": shown})
        model = {name: getattr(self._model, name) for name in ("degree", "boundary", "filter", "smoothing")}
        held = {**model, "axes": "zyx", "unit": source.unit or "", "patient": source.patient}
        held["levels"] = levels
        write_attributes(self._root, {"complete": True, **held, "conversion": self._state})

    def _save(self, **state):
        self._state.update(state)
        write_attributes(self._root, {"complete": False, "conversion": self._state})


def _stored(dtype):
    """The type of the samples in a store: that of the source in the machine's byte order; Zarr has no long doubles."""
    return dtype.newbyteorder("=") if dtype.kind != "f" or dtype.itemsize <= 8 else np.dtype(np.float64)


def _begin(root, options, may_be_complete=False):
    """The state of the conversion in a store: from an earlier run with the same options, or a new one.

    A run that ended before it had looked at all samples, such as one that found a NaN, has converted nothing: the next
    one may have other options.
    """
    if not (root / "zarr.json").exists():
        with layout.writing(root / "zarr.json"):
            layout.zarr().open_group(str(root), mode="a")
        return _new_state(root, options)
    attributes = group_attributes(root)
    if attributes.get("complete") and not may_be_complete:
        raise FileExistsError(f"{printable(root)}: expected no store, or an incomplete one; {OR_OVERWRITE}")
    state = attributes["conversion"]
    if "shard" not in state and state["options"] != options:
        if state["options"].get("source") != options["source"]:
            (root / "staged").unlink(missing_ok=True)
        return _new_state(root, options)
    check_options(root, state["options"], options)
    return state


def _new_state(root, options):
    state = {"options": options}
    write_attributes(root, {"complete": False, "conversion": state})
    return state


def check_options(root: Path, begun: dict[str, Any], options: dict[str, Any]) -> None:
    """Check that a continued conversion has the same options as at its beginning."""
    for name, value in options.items():
        if begun.get(name) != value:
            raise ValueError(
                f"{printable(root)}: expected {name} as in the conversion that was begun, {begun.get(name)}, got "
                f"{value}; {OR_OVERWRITE}"
            )


def write_attributes(root: Path, attributes: dict[str, Any]) -> None:
    """Replace the attributes "isospline" of a store's group."""
    with layout.writing(root / "zarr.json"):
        group = layout.zarr().open_group(str(root), mode="r+")
        group.update_attributes({"isospline": {"version": VERSION, **attributes}})


def clear(root, *kept):
    """Remove the contents of a store's folder."""
    for path in root.iterdir():
        if path.name in kept:
            continue
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink()


def is_complete(root: Path) -> bool:
    """Whether a store has been written."""
    return (root / "zarr.json").exists() and group_attributes(root).get("complete") is True


@contextlib.contextmanager
def _without(file):
    """Begin without a file, which may be of another source, and remove it if what follows fails."""
    file.unlink(missing_ok=True)
    try:
        yield
    except BaseException:
        file.unlink(missing_ok=True)
        raise


@contextlib.contextmanager
def _locked(root):
    """Lock the store's folder for this process."""
    root.mkdir(exist_ok=True)
    descriptor = os.open(root, os.O_RDONLY | os.O_DIRECTORY)
    try:
        try:
            import fcntl  # of POSIX alone

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ValueError(f"{printable(root)}: expected a store that no other process is writing") from None
        yield
    finally:
        os.close(descriptor)


def check_apart(root: Path, source: Source) -> None:
    """Check that the store in a folder would not replace the samples from which it is made."""
    if source.path is not None and Path(os.path.realpath(source.path)).is_relative_to(root):
        raise ValueError(f"out: expected another folder than that of the source, got {printable(root)}")


def check_out(out: Any) -> Path:
    """The folder for writing a store: a new or empty one, or one with a store."""
    check_path(out)
    root = Path(os.path.realpath(out))
    if not root.parent.is_dir():
        raise FileNotFoundError(f"{printable(out)}: expected a folder that exists, got {printable(root.parent)}")
    if root.exists() and not root.is_dir():
        raise FileExistsError(f"{printable(out)}: expected the folder of a store, got a file")
    if root.is_dir() and any(root.iterdir()):
        try:
            group_attributes(root)
        except (OSError, ValueError) as error:
            message = f"{printable(out)}: expected a new folder, or the folder of a store: {error}"
            raise FileExistsError(message) from error
    return root
