"""The level and the pieces of a file's surface if no option names them: the same in pictures, meshes and measures."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import isospline

from ..base.views import DEFAULT_VIEW
from ..scene.cells import cell_shift
from ..suggest.presentation import Presentation, has_directions
from ..suggest.view import SuggestedView
from .given import keywords
from .picture import ALL, kept_pieces, largest_of
from .store import Store, presented


class Chosen(NamedTuple):
    """Levels, to what the surface is confined or None, whether specks are left out, and the view of the whole."""

    levels: list[float]
    confined: Presentation | None = None
    without_specks: bool = False
    view: SuggestedView = SuggestedView()


def choose_levels(data: Any, arguments: Any, say: Any) -> Chosen:
    """The levels that the options give, or the one that suits the volume; `say` tells which."""
    needs_view = getattr(arguments, "view", None) == DEFAULT_VIEW and arguments.up is None
    needs_view = needs_view and not has_directions(data.patient, data.direction)
    if arguments.level is not None and not needs_view:
        return Chosen(arguments.level)
    suggested = isospline.suggest_levels(data.data)
    if not suggested:
        if arguments.level is not None:
            return Chosen(arguments.level)
        raise ValueError(f"{arguments.file}: expected samples that differ, all of them are {data.data.flat[0]}")
    shown = presented(data, suggested, **keywords(arguments, ["inside"]))
    if needs_view and shown.view.reason:
        wrong = "the directions of the file seem wrong: " if data.patient else ""
        say(f"{wrong}{shown.view.reason}; --view three-quarter is the view by the directions of the file")
    view = shown.view if needs_view else SuggestedView()
    if arguments.level is not None:
        return Chosen(arguments.level, view=view)
    which = "the first one"
    if shown.level != suggested[0]:
        which += " above water, for bones," if data.patient else " that shows more than a plate,"
    say(f"level {shown.level:g}, {which} of the suggested levels: {', '.join(f'{each:g}' for each in suggested)}")
    if shown.cut_sides > 1 and getattr(arguments, "closed", False):
        say(f"the border of the volume cuts the solid at {shown.cut_sides} sides, where it has flat faces")
    # Finding components would read all of a store.
    is_partial = arguments.largest == ALL or isinstance(data, Store)
    is_confined = shown.confined_at is not None and not is_partial
    without_specks = arguments.largest is None and not is_partial
    return Chosen([shown.level], shown if is_confined else None, without_specks, view)


def make_surfaces(volume: Any, chosen: Chosen, arguments: Any, options: dict[str, Any], say: Any) -> list[Any]:
    """The isosurfaces at the chosen levels, without what a picture does not show; `say` tells what is left out."""
    options = {**options, **keywords(arguments, ["inside"])}
    if chosen.confined is not None:
        options = {**options, "mask": chosen.confined.mask(volume)}
        if chosen.confined.body_level is not None:
            say(f"only the body is kept: the largest piece at level {chosen.confined.body_level:g}")
        if chosen.confined.left_out is not None:
            say("the plate on which it lies is left out; --largest all shows it")
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
    shift = cell_shift(volume)
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
