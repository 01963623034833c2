"""Measures of surfaces at several levels, as a table."""

from __future__ import annotations

import numbers
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .base.mistakes import sentence
from .base.parameters import check_plain
from .base.progress import as_callable, part_of, tell
from .base.results import LevelMeasures
from .base.signatures import explained
from .scene import Isosurface

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .io import VolumeData
    from .scene import Volume


@explained
def measure(
    volume: Volume | VolumeData | NDArray[Any] | Isosurface,
    levels: Sequence[float] | NDArray[Any],
    *,
    tolerance: float | None = None,
    order: int | None = None,
    progress: Any = None,
) -> LevelMeasures:
    """Measure the volume and the area at several levels, such as those of a porosity curve.

    Both come from the same lines or nodes, and take the time of the area. `Isosurface.enclosed_volume` and
    `Isosurface.area` give the same numbers within the stated errors: a volume alone needs fewer lines for a tolerance.

    Parameters
    ----------
    volume : Volume, VolumeData, array or Isosurface
        Of an isosurface, the mask, the cuts, the pieces and the side of the solid count as well; its level does not.
    levels : sequence of N floats
        In any order.
    tolerance, order, progress
        As in `Isosurface.enclosed_volume`.

    Returns
    -------
    LevelMeasures
        A row for each level, in their order. Where there is no surface, the area is 0, and the volume that of the
        whole solid or 0.

    Raises
    ------
    ValueError
        For no levels, levels that are not finite or not in one sequence, and as in `Isosurface.enclosed_volume`.
    TypeError
        For a volume of another type.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.sphere(0.7)
    >>> table = isospline.measure(field.volume(32), [-0.1, 0.0, 0.1])
    >>> bool((table.areas[:-1] > table.areas[1:]).all())
    True
    >>> table.to_csv().splitlines()[0]
    'levels,enclosed_volumes,volume_errors,areas,area_errors'
    """
    check_plain(levels, "levels")
    wanted = np.asarray(levels, dtype=object)  # rows of different lengths stay objects
    is_real = wanted.ndim == 1 and all(isinstance(each, numbers.Real) and not isinstance(each, bool) for each in wanted)
    if not (wanted.size and is_real and np.isfinite(wanted.astype(np.float64)).all()):
        raise ValueError(sentence("levels", "one or more finite numbers in a sequence", levels))
    report = as_callable(progress)
    each_level = wanted.astype(np.float64).tolist()
    surface = volume if isinstance(volume, Isosurface) else Isosurface(volume, each_level[0])
    rows = []
    for number, level in enumerate(each_level):
        at_level = surface if level == surface.level else surface.with_level(level)
        of_level = part_of(report, number, len(each_level))
        rows.append({"levels": level, **at_level._volume_and_area(tolerance, order, of_level)})
    tell(report, 1.0)
    return LevelMeasures._of_rows(rows)
