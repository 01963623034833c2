"""What is shown of a volume if nothing is said: the level, the pieces, and the view."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.handed import known
from ..base.parameters import check_type
from ..base.signatures import explained
from ..levels import count_pieces, default_levels, histogram, levels_of_histogram, some_values
from ..scene import Isosurface, Scene, Volume
from ..scene.cells import index_shape
from .grid import Grid, Inside, Samples, samples_of, some_samples
from .holders import grown, holders
from .plates import Plate, find_plate, is_only_plate
from .posture import Posture, head_posture, standing_posture, trunk_posture
from .view import SuggestedView, as_tuple, view_of

#: The least Hounsfield units of bones.
_BONE = 200


@dataclass(frozen=True, eq=False)
class Presentation:
    """What is shown of a volume if nothing is said.

    Attributes
    ----------
    level : float
        The level of the surface.
    body_level : float or None
        Only what is in the largest piece at this level is shown.
    left_out : tuple of slice or None
        Samples of a plate that is not shown, as an index of the array.
    holder : bool array or None
        Points of a coarse grid that are not shown, each for `steps` samples along the axes.
    steps : (3,) tuple of int
        Samples between the points of that grid along the axes of the array.
    view : SuggestedView
    cut_sides : int
        The number of sides of the volume at which its border cuts the solid; 0 for what is recognised.
    inside : {"above", "below"}
        The side of the level on which the solid is.
    """

    level: float
    body_level: float | None = None
    left_out: tuple[slice, ...] | None = None
    holder: NDArray[np.bool_] | None = None
    steps: tuple[int, ...] = (1, 1, 1)
    view: SuggestedView = SuggestedView()
    cut_sides: int = 0
    inside: Inside = "above"

    @property
    def confined_at(self) -> float | None:
        """The level at which it is decided what is shown: that of the body, or of a surface without its plate."""
        return self.level if self.body_level is None and self.left_out else self.body_level

    def mask(self, volume: Volume) -> NDArray[np.bool_] | None:
        """The samples of a volume to which the surface is confined, of the shape of its data, or None."""
        if self.confined_at is None:
            return None
        mask = np.ones(index_shape(volume)[::-1], bool)
        if self.left_out is not None:
            mask[self.left_out] = False
        if self.holder is not None:
            holder = self.holder
            for axis, step in enumerate(self.steps):
                holder = holder.repeat(step, axis=axis)
            missing = [(0, max(0, count - held)) for count, held in zip(mask.shape, holder.shape)]
            mask &= ~np.pad(holder, missing, mode="edge")[tuple(slice(count) for count in mask.shape)]
        given = mask if volume.axes == "zyx" else mask.T
        return given if self.body_level is None else given & body_mask(volume, self.body_level, given, self.inside)


def body_mask(volume: Volume, level: float, within: Any = None, inside: Inside = "above") -> NDArray[np.bool_]:
    """The samples of the largest piece at the level of the body: the patient without the table, which is apart."""
    return Isosurface(volume, level, mask=within, largest=1, inside=inside).to_mask(whole_cells=True)


@explained
def suggest_mask(volume: Volume, *, inside: Inside = "above") -> NDArray[np.bool_] | None:
    """Suggest the samples of a volume to which an isosurface is confined, for ``Isosurface(..., mask=)``.

    Left out are what is not the body in a patient's CT, what is not the head around a head, and the plate on which an
    object lies, if it is a piece of its own or if the border of the volume cuts it. `suggest_view` has the rules for
    heads and plates. Pictures are confined to these samples if no level is given.

    Parameters
    ----------
    volume : Volume
        Of degree 1, 2 or 3, as for an isosurface.
    inside : {"above", "below"}
        The side of the level on which the solid is, as of `Isosurface`.

    Returns
    -------
    bool array of the shape of the volume's data, or None
        None if nothing is left out.

    Raises
    ------
    ValueError
        For another degree or another side.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.torus()
    >>> print(isospline.suggest_mask(field.volume(32)))
    None
    """
    check_type(volume, "volume", Volume, "a Volume")
    if volume.degree not in (1, 2, 3):
        raise ValueError(f"volume: expected a degree of 1, 2 or 3, got {volume.degree}")
    return present(volume, inside=_checked(inside)).mask(volume)


def suggested_surface(volume: Volume, inside: Inside = "above") -> Isosurface:
    """The isosurface of a picture for which nothing is said: without specks of noise, closed at the border."""
    shown = present(volume, inside=inside)
    options: dict[str, Any] = {"inside": inside, "closed": True}
    if volume.paging is not None:  # its components would need all of it
        return Isosurface(volume, shown.level, **options)
    options["mask"] = shown.mask(volume)
    surface = Isosurface(volume, shown.level, **options)
    kept, found = count_pieces(surface)
    return surface if kept == found else Isosurface(volume, shown.level, largest=kept, **options)


@explained
def suggest_view(volume: Volume, *, inside: Inside = "above") -> SuggestedView:
    """Suggest a view of a volume: from the front, with the top above, as a person would hold it.

    It is the view of pictures for which none is given. If the directions of a volume are not known, these rules apply
    to its solid at the suggested level, the first one that does:

    - a head, cut at the neck, whose left is like its right, and whose face has more relief than its back, is seen
      from the face, with the neck below;
    - what lies on a plate is seen with the plate below;
    - what has a single flat end, within the volume and about as wide as its widest section, stands on it.

    The directions of a patient are used as they are, unless they are those of an array without directions and the
    volume contradicts them: by a head, by a plate or, in a CT, by a spine at the front.

    Parameters
    ----------
    volume : Volume
    inside : {"above", "below"}
        The side of the level on which the solid is, as of `Isosurface`. The rules for a patient's CT are for "above".

    Returns
    -------
    SuggestedView
        Its `view` and `up` are those of `camera_for`. If no rule applies, it is the view "three-quarter".

    Raises
    ------
    ValueError
        For another side.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.torus()
    >>> isospline.suggest_view(field.volume(32))
    SuggestedView(view=(-0.45, -1.0, 0.3), up=(0.0, 0.0, 1.0), reason='')
    """
    check_type(volume, "volume", Volume, "a Volume")
    return _view(volume, _checked(inside))


def _view(volume: Volume, inside: Inside) -> SuggestedView:
    """The view of a volume; of all scales of a store that of the overview, which needs few of its chunks."""
    if volume.paging is not None:
        volume = known("overview_of")(volume)
    return present(volume, inside=inside).view


def _checked(inside: Any) -> Inside:
    """The side of a level, if it is one."""
    if inside not in ("above", "below"):
        raise ValueError(f'inside: expected "above" or "below", got {inside!r}')
    return "below" if inside == "below" else "above"


def suggested_view(shown: Any) -> SuggestedView | None:
    """The view suggested for a scene, an isosurface or a list of objects; None unless it is the same for all surfaces.

    Of an isosurface in a scene, the view is turned with it.
    """
    if isinstance(shown, Scene):
        placed = [(item, transform) for _, item, transform, *_ in shown._placed_objects()]
    else:
        items = shown if isinstance(shown, (list, tuple)) else [shown]
        placed = [(item, np.eye(4)) for item in items]
    surfaces = [(item, np.asarray(each)) for item, each in placed if isinstance(item, Isosurface)]
    if not surfaces:
        return None
    first: SuggestedView | None = None
    for surface, transform in surfaces:
        suggested = _view(surface.volume, _checked(surface.inside))
        view, up = (as_tuple(_turned(transform, vector)) for vector in (suggested.view, suggested.up))
        if not suggested.reason or (first and not np.allclose((view, up), (first.view, first.up))):
            return None
        first = first or SuggestedView(view, up, suggested.reason)
    return first


def _turned(transform: NDArray[np.float64], vector: Any) -> NDArray[np.float64]:
    """A vector turned by a (4, 4) transform, of the same length: transforms to another unit change lengths alone."""
    turned = transform[:3, :3] @ vector
    return turned * (np.linalg.norm(vector) / np.linalg.norm(turned))


# Presentations by their volumes and the side of the solid, of which the last ones are kept.
_KNOWN: dict[tuple[Any, Inside], Presentation] = {}
_MOST_KNOWN = 32


def present(
    volume: Volume,
    suggested: list[float] | None = None,
    minimum: float | None = None,
    inside: Inside = "above",
) -> Presentation:
    """The presentation of a volume, found once; by default for levels that some of its values suggest."""
    key = _identity(volume), inside
    if key not in _KNOWN:
        if suggested is None or minimum is None:
            values, counts = histogram(some_values(volume))
            minimum = float(values[0])
            suggested = levels_of_histogram(values, counts) or [minimum]
        direction = np.asarray(volume.direction)
        shown = _present(lambda: samples_of(volume), direction, volume.patient, minimum, suggested, inside)
        while len(_KNOWN) >= _MOST_KNOWN:
            _KNOWN.pop(next(iter(_KNOWN)), None)
        _KNOWN[key] = shown
        return shown
    return _KNOWN[key]


def _identity(volume: Volume) -> Any:
    """What tells volumes apart; that of a store which is opened again is the same until the store is written again."""
    if volume.paging is None:
        return volume._identity
    folder, array, _ = volume.__getstate__()["store"]
    return folder, array, os.stat(os.path.join(folder, "zarr.json")).st_mtime_ns


def present_data(data: Any, suggested: list[float], minimum: float, inside: Inside = "above") -> Presentation:
    """The presentation of a `VolumeData`, or of what has the same attributes, for its suggested levels."""
    spacing = np.asarray(data.spacing, float)[::-1]
    return _present(
        lambda: some_samples(data.data, spacing), np.asarray(data.direction), data.patient, minimum, suggested, inside
    )


def _present(sample, direction, patient, minimum, suggested, inside) -> Presentation:
    level, body_level = default_levels(suggested, minimum, patient)
    if inside == "below":  # a patient's body is above its levels
        body_level = None
    if has_directions(patient, direction):
        return Presentation(level, body_level, inside=inside)
    samples = sample()
    if body_level is None:
        level, plate = _level_of_object(samples, level, suggested, inside)
        solid = samples.solid(level, inside)
    else:
        solid = samples.solid(body_level, inside)
        plate = find_plate(solid)
    if not solid.inside.any():
        return Presentation(level, body_level, inside=inside)
    left_out = None
    if plate is not None and plate.is_left_out:
        solid.inside[_layers(plate, plate.layers)] = False
        left_out = _samples_of(plate, samples)
    cut_sides = solid.cut_sides()
    solid = solid.largest_piece()
    holder = holders(solid)
    body = Grid(solid.inside & ~holder, solid.spacing)
    posture = head_posture(body)
    if posture is None and body_level is not None:
        posture = trunk_posture(solid, samples.values > _BONE)
    if posture is not None:
        around = grown(grown(holder)) & ~body.inside if holder.any() and posture.is_head else None
        body_level = level if body_level is None else body_level
        view = view_of(posture, body, direction)
        steps = tuple(samples.steps.tolist())
        return Presentation(level, body_level, left_out, around, steps, view, inside=inside)
    if body_level is not None:
        return Presentation(level, body_level, left_out)
    if plate is not None:
        posture = Posture(plate.side.opposite, None, "it lies on a plate")
    elif not patient:
        posture = standing_posture(solid)
    view = view_of(posture, solid, direction)
    return Presentation(level, None, left_out, view=view, cut_sides=0 if posture else cut_sides, inside=inside)


def _level_of_object(
    samples: Samples, level: float, suggested: list[float], inside: Inside
) -> tuple[float, Plate | None]:
    """The first level that shows more than a plate, and the plate on which the object lies, if there is one."""
    for each in [level, *(other for other in suggested if other != level)]:
        solid = samples.solid(each, inside)
        plate = find_plate(solid)
        if plate is not None or not is_only_plate(solid):
            return each, plate
    return level, None


def _layers(plate: Plate, count: int) -> tuple[slice, ...]:
    """The layers at the side of a plate, as an index of an array."""
    return _across(plate, slice(-count, None) if plate.side.end else slice(None, count))


def _samples_of(plate: Plate, samples: Samples) -> tuple[slice, ...]:
    """The samples from the side of a plate to the first point behind it, as its surface is before that point."""
    axis, end = plate.side
    behind = samples.place(axis, samples.values.shape[axis] - 1 - plate.layers if end else plate.layers)
    return _across(plate, slice(behind, None) if end else slice(None, behind + 1))


def _across(plate: Plate, part: slice) -> tuple[slice, ...]:
    """A part of the axis of a plate, as an index of an array."""
    return tuple(part if axis == plate.side.axis else slice(None) for axis in range(3))


def has_directions(patient: bool, direction: Any) -> bool:
    """Whether a volume has a patient's directions, and not those of an array without, as ITK or NIfTI write them."""
    defaults = ((1, 1, 1), (-1, -1, 1))
    return patient and not any(np.allclose(direction, np.diag(signs)) for signs in defaults)
