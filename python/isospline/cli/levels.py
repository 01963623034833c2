"""The level and the pieces of a file's surface if no option names them: the same in pictures, meshes and measures."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import isospline

from ..levels import body_mask, default_levels
from .picture import ALL, kept_pieces, largest_of
from .store import Store, least_sample


class Chosen(NamedTuple):
    """Levels, the level of the patient's body to which the surface is confined, and whether specks are left out."""

    levels: list[float]
    body_level: float | None
    without_specks: bool


def choose_levels(data: Any, arguments: Any, say: Any) -> Chosen:
    """The levels that the options give, or the one that suits the volume; `say` tells which."""
    if arguments.level is not None:
        return Chosen(arguments.level, None, False)
    suggested = isospline.suggest_levels(data.data)
    if not suggested:
        raise ValueError(f"{arguments.file}: expected samples that differ, all of them are {data.data.flat[0]}")
    level, body_level = default_levels(suggested, least_sample(data), data.patient)
    which = "the first one" if level == suggested[0] else "the first one above water, for bones,"
    say(f"level {level:g}, {which} of the suggested levels: {', '.join(f'{each:g}' for each in suggested)}")
    # Finding components would read all of a store.
    is_partial = arguments.largest == ALL or isinstance(data, Store)
    return Chosen([level], None if is_partial else body_level, arguments.largest is None and not is_partial)


def make_surfaces(volume: Any, chosen: Chosen, arguments: Any, options: dict[str, Any], say: Any) -> list[Any]:
    """The isosurfaces at the chosen levels, without specks and what is not the body; `say` tells what is left out."""
    if chosen.body_level is not None:
        options = {**options, "mask": body_mask(volume, chosen.body_level)}
        say(f"only the body is kept: the largest piece at level {chosen.body_level:g}")
    first = isospline.Isosurface(volume, chosen.levels[0], largest=largest_of(arguments), **options)
    if chosen.without_specks and (kept := kept_pieces(first, say)):
        first = isospline.Isosurface(volume, chosen.levels[0], largest=kept, **options)
    return [first, *(first.with_level(level) for level in chosen.levels[1:])]


def tell_of_open_borders(surfaces: list[Any], say: Any) -> None:
    """Say that solids are left open at the border of the volume if one of them is."""
    if any(not surface.closed and meets_border(surface) for surface in surfaces):
        say("the solid is left open where it meets the border of the volume; --closed closes it there")


def meets_border(surface: Any) -> bool:
    """Whether a corner of a cell at the border of the volume is inside the solid."""
    volume = surface.volume
    shift = 0.5 if volume.degree % 2 == 0 else 0.0
    inset = 1e-6  # cells, much more than rounding
    ends = [(inset - shift, count - 1 + shift - inset) for count in volume.shape[::-1]]
    corners = [np.clip(np.arange(count + 1) - shift, *between) for count, between in zip(volume.shape[::-1], ends)]
    to_world = volume.direction * volume.spacing
    for axis in range(3):
        for end in ends[axis]:
            of_face = [np.array([end]) if each == axis else corners[each] for each in range(3)]
            index = np.stack(np.meshgrid(*of_face), axis=-1).reshape(-1, 3)
            if surface.contains(index @ to_world.T + volume.origin).any():
                return True
    return False
