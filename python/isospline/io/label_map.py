"""Checks whether samples are labels, whose isosurfaces mean nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.system import warn

# Rows of samples that are looked at.
ROWS = 2048
# The numbers of different labels in a label map; two are a mask, whose surface at 0.5 is right.
FEWEST, MOST = 3, 512
# The smallest fraction of labelled samples that have the label of their neighbour.
PLATEAU = 0.8


def warn_of_labels(data: NDArray[Any]) -> None:
    """Warn if whole numbers from 0 on, constant over large parts, look like labels of segments."""
    count = count_of_labels(data)
    if count is not None:
        warn(
            f"data: looks like a label map, {count} values that are constant over large parts; a level between them "
            "mixes segments: Labels(data).surface(number), or Labels.read(path), makes a smooth surface of a segment"
        )


def count_of_labels(data: NDArray[Any]) -> int | None:
    """The number of different values, with that of the background, if samples look like labels; otherwise None."""
    if data.dtype.kind not in "iuf" or data.ndim != 3 or data.shape[-1] < 2 or data.size == 0:
        return None
    row_count = data.shape[0] * data.shape[1]
    places = np.unique(np.linspace(0, row_count - 1, min(ROWS, row_count)).astype(np.int64))
    rows = data[places // data.shape[1], places % data.shape[1]]
    values, counts = np.unique(rows, return_counts=True)
    if values[0] != 0 or not FEWEST <= len(values) <= MOST or (values != np.round(values)).any():
        return None
    here, next_ = rows[:, :-1], rows[:, 1:]
    is_labelled = (here != values[counts.argmax()]) & (here != 0)
    if is_labelled.any() and (here == next_)[is_labelled].mean() >= PLATEAU:
        return len(values)
    return None
