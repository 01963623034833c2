"""The spline model of a store, and the computation of its coefficients in blocks."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..base.parameters import check_type
from .blocks import cut, read_box_folded, with_halo
from .layout import box_of, chunk_path, is_whole_shard, open_array, slices_of, writing
from .sources.source import Source

#: Limits of half the range of samples. Beyond them, float32 could not hold all digits of the coefficients.
_SMALLEST_RANGE, _LARGEST_RANGE = 1e-30, 1e34

_LARGEST_SMOOTHING = 1e9


@dataclass(frozen=True)
class Model:
    """The parameters of the spline, as in a `Volume`."""

    degree: int = 2
    boundary: str = "mirror"
    filter: str = "interpolate"
    smoothing: float = 0.0

    def __post_init__(self) -> None:
        check_type(self.degree, "degree", (int, np.integer), "a whole number")
        if not 0 <= self.degree <= 5:
            raise ValueError(f"degree: expected 0 to 5, got {self.degree}")
        for name, words in (("boundary", ("mirror", "periodic")), ("filter", ("interpolate", "none", "smoothing"))):
            check_type(getattr(self, name), name, str, "a str")
            if getattr(self, name) not in words:
                expected = " or ".join(f'"{word}"' for word in words)
                raise ValueError(f"{name}: expected {expected}, got {getattr(self, name)!r}")
        check_type(self.smoothing, "smoothing", (int, float, np.number), "a number")
        if not 0 <= self.smoothing <= _LARGEST_SMOOTHING:
            raise ValueError(f"smoothing: expected a number from 0 to 1e9, got {self.smoothing}")
        if self.smoothing > 0 and self.filter != "smoothing":
            raise ValueError(f"smoothing: expected 0 for this filter, got {self.smoothing}")

    @property
    def reach(self) -> int:
        """The number of samples beyond a block on which its coefficients depend."""
        return _core._prefilter_reach(self.degree, self.filter, self.smoothing)


class SamplesOfBlock(NamedTuple):
    """The range of a block's samples, and a digest of the samples and their place; empty for those of a file."""

    minimum: float
    maximum: float
    digest: str


@dataclass(frozen=True)
class LookAtBlock:
    """The range and the digest of a block of samples."""

    source: Source
    edge: tuple[int, ...]

    def __call__(self, index: Any) -> SamplesOfBlock:
        box = box_of(index, self.edge, self.source.shape)
        samples = self.source.read(box)
        least, greatest = float(samples.min()), float(samples.max())
        if not (math.isfinite(least) and math.isfinite(greatest)):
            place = np.argwhere(~np.isfinite(samples))[0]
            at = ", ".join(str(first + int(offset)) for (first, _), offset in zip(box, place))
            got = samples[tuple(place)]
            hint = "; nan=VALUE, --nan on the command line, replaces NaN" if np.isnan(got) else ""
            raise ValueError(f"source: expected finite numbers, got {got} at [{at}]{hint}")
        if "path" in self.source.identity:
            return SamplesOfBlock(least, greatest, "")
        digest = hashlib.sha256(np.asarray(box, np.int64).tobytes())
        digest.update(np.ascontiguousarray(samples).data)
        return SamplesOfBlock(least, greatest, digest.hexdigest())


def together(blocks: list[SamplesOfBlock]) -> SamplesOfBlock:
    """The range and the digest of all samples, from those of their blocks in any order."""
    digests = "".join(sorted(block.digest for block in blocks))
    return SamplesOfBlock(
        min(block.minimum for block in blocks),
        max(block.maximum for block in blocks),
        hashlib.sha256(digests.encode()).hexdigest()[:16],
    )


def offset_of(least: float, greatest: float, dtype: np.dtype[Any]) -> float:
    """The number that is subtracted from coefficients: the middle of the range, a float32 if the samples are."""
    spread = greatest - least
    if not (spread == 0 or _SMALLEST_RANGE <= spread <= _LARGEST_RANGE):
        raise ValueError(f"source: expected a range of 1e-30 to 1e34, or one value only, got {spread}")
    middle = 0.5 * least + 0.5 * greatest
    return float(np.float32(middle)) if dtype == np.float32 else middle


@dataclass(frozen=True)
class PrefilterShard:
    """Compute and write one shard of the finest level's coefficients, from its samples and those around it.

    With `samples_key`, the samples are written, too.
    """

    root: Path
    key: str
    source: Source
    model: Model
    offset: float
    samples_key: str | None = None

    def __call__(self, index: Any) -> None:
        keys = [self.key, *([self.samples_key] if self.samples_key else [])]
        missing = [key for key in keys if not is_whole_shard(self.root, key, open_array(self.root, key), index)]
        if not missing:
            return
        target = open_array(self.root, self.key)
        box = box_of(index, target.shards, target.shape)
        grown, samples = self.samples(box)
        if self.key in missing:
            write_shard(self.root, self.key, index, self.coefficients(box, grown, samples))
        if self.samples_key in missing:
            write_shard(self.root, self.samples_key, index, cut(samples, box, grown))

    def samples(self, box: Any) -> tuple[Any, NDArray[Any]]:
        """A box with the samples around it on which its coefficients depend, and its samples."""
        grown = with_halo(box, self.model.reach, self.source.shape, self.model.boundary)
        return grown, read_box_folded(self.source.read, grown, self.source.shape, self.model.boundary)

    def coefficients(self, box: Any, grown: Any, samples: NDArray[Any]) -> NDArray[np.float32]:
        """The coefficients of a box."""
        model = self.model
        arguments = (self.offset, model.degree, model.boundary, model.filter, model.smoothing)
        return cut(_core._prefilter_block(samples, *arguments), box, grown)


def write_shard(root: Path, key: str, index: Any, items: NDArray[Any]) -> None:
    """Write a whole shard. Remnants of an earlier run are removed first, because Zarr would read and keep them."""
    target, path = open_array(root, key, "r+"), chunk_path(root, key, index)
    with writing(path):
        path.unlink(missing_ok=True)
        target[slices_of(box_of(index, target.shards, target.shape))] = items
