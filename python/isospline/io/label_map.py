"""Checks whether samples are labels, whose isosurfaces mean nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cautions import warn

# Rows of samples that are looked at.
ROWS = 2048
# The numbers of different labels in a label map; two are a mask, whose surface at 0.5 is right.
FEWEST, MOST = 3, 512
# The smallest fraction of labelled samples that have the label of their neighbour.
PLATEAU = 0.8


def warn_of_labels(data: NDArray[Any]) -> None:
    """Warn if whole numbers from 0 on, constant over large parts, look like labels of segments."""
    if data.dtype.kind not in "iu" or data.ndim != 3 or data.shape[-1] < 2:
        return
    row_count = data.shape[0] * data.shape[1]
    places = np.unique(np.linspace(0, row_count - 1, min(ROWS, row_count)).astype(np.int64))
    rows = data[places // data.shape[1], places % data.shape[1]]
    values, counts = np.unique(rows, return_counts=True)
    if values[0] != 0 or not FEWEST <= len(values) <= MOST:
        return
    here, next_ = rows[:, :-1], rows[:, 1:]
    is_labelled = (here != values[counts.argmax()]) & (here != 0)
    if is_labelled.any() and (here == next_)[is_labelled].mean() >= PLATEAU:
        label = int(values[-1])
        warn(
            f"data: looks like a label map, {len(values)} values that are constant over large parts; a level between "
            f"them mixes segments: model one of them as a mask, such as data == {label}, at level 0.5"
        )
