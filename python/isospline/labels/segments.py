"""The segments of a label map: numbers, names and colours."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..base.foreign import close_name
from ..base.mistakes import refuse_images, sentence
from ..base.parameters import check_plain
from ..base.system import warn
from ..colors import linear_to_srgb
from ..io import VolumeData
from ..looks import Material

# Lightness and chroma of the categorical colours in Oklab, in turn.
_SHADES = ((0.74, 0.13), (0.60, 0.15), (0.84, 0.11))
_GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))


class Segment(NamedTuple):
    """A label: its number, its name, its colour in sRGB, and the voxels: those with a value in a layer of the map."""

    number: int
    name: str
    color: NDArray[np.float64]
    value: int
    layer: int = 0


class Given(NamedTuple):
    """What a file tells of a label; None is unknown."""

    name: str | None = None
    color: NDArray[np.float64] | None = None


def categorical_color(place: int) -> NDArray[np.float64]:
    """A colour that is unlike its neighbours in the sequence: hues a golden angle apart, in Oklab."""
    lightness, chroma = _SHADES[place % len(_SHADES)]
    hue = 0.5 + place * _GOLDEN_ANGLE
    a, b = chroma * np.cos(hue), chroma * np.sin(hue)
    cone = np.array(
        [[1, 0.3963377774, 0.2158037573], [1, -0.1055613458, -0.0638541728], [1, -0.0894841775, -1.291485548]]
    )
    to_rgb = np.array(
        [
            [4.0767416621, -3.3077115913, 0.2309699292],
            [-1.2684380046, 2.6097574011, -0.3413193965],
            [-0.0041960863, -0.7034186147, 1.707614701],
        ]
    )
    return linear_to_srgb(to_rgb @ (cone @ (lightness, a, b)) ** 3)


def segments_of(values: list[int], told: dict[int, Given]) -> list[Segment]:
    """The segments of values, with what a file tells of them."""
    segments = []
    for place, value in enumerate(values):
        name, color = told.get(value, Given())
        color = categorical_color(place) if color is None else color
        segments.append(Segment(value, name or f"label {value}", color, value))
    return segments


def with_voxels(segments: list[Segment], counts: list[dict[int, int]], background: int) -> list[Segment]:
    """The segments of a file that have voxels, without the background; warns of numbers that no segment has.

    `counts` has the voxels of each number by layer.
    """
    known = {(each.layer, each.value) for each in segments}
    left_out = [
        (value, count)
        for layer, values in enumerate(counts)
        for value, count in values.items()
        if value not in (0, background) and (layer, value) not in known
    ]
    if left_out:
        numbers = ", ".join(str(value) for value, _ in left_out[:12]) + (", ..." if len(left_out) > 12 else "")
        voxels = sum(count for _, count in left_out)
        warn(f"the file describes no segment with the number {numbers}: {voxels} voxels are left out")
    present = [each for each in segments if each.layer < len(counts) and each.value in counts[each.layer]]
    return [each for each in present if each.number != background]


def renamed(segments: list[Segment], names: Any, colors: Any) -> tuple[Segment, ...]:
    """The segments with names and colours that replace theirs."""
    new_names = _names_by_number(names)
    named = [each._replace(name=new_names.get(each.number, each.name)) for each in segments]
    new_colors = _colors_by_number(colors, {**new_names, **{each.number: each.name for each in named}})
    return tuple(each._replace(color=new_colors.get(each.number, each.color)) for each in named)


def _names_by_number(names: Any) -> dict[int, str]:
    """Names by number, of a dict in either direction: nnU-Net's dataset.json has the numbers of names."""
    if names is None:
        return {}
    if not isinstance(names, Mapping):
        raise TypeError(sentence("names", "a dict of numbers to names, or of names to numbers", names))
    pairs = [(key, item) if isinstance(key, (int, np.integer)) else (item, key) for key, item in names.items()]
    for number, name in pairs:
        if isinstance(number, bool) or not isinstance(number, (int, np.integer)) or not isinstance(name, str):
            raise TypeError(f"names: expected numbers and names of labels, got {number!r} and {name!r}")
    named: dict[int, str] = {}
    for number, name in pairs:
        if named.setdefault(int(number), name) != name:
            both = f"{named[int(number)]!r} and {name!r}"
            raise ValueError(f"names: expected one name of a label, got {both} of {number}")
    return named


def _colors_by_number(colors: Any, names: dict[int, str]) -> dict[int, NDArray[np.float64]]:
    """Colours in sRGB by number, of a dict of numbers or names to colours."""
    if colors is None:
        return {}
    if not isinstance(colors, Mapping):
        raise TypeError(sentence("colors", "a dict of numbers or names to colours", colors))
    found = {}
    for key, color in colors.items():
        numbers = [key] if isinstance(key, (int, np.integer)) else [each for each in names if names[each] == key]
        if not numbers:
            raise ValueError(f"colors: expected numbers or names of labels, got {key!r}")
        for number in numbers:
            found[int(number)] = np.broadcast_to(np.asarray(Material(color=color).color, dtype=float), 3)
    return found


def find(segments: tuple[Segment, ...], label: Any) -> Segment:
    """The segment with a number or a name."""
    if isinstance(label, (int, np.integer)) and not isinstance(label, bool):
        found = [each for each in segments if each.number == label]
        if not found:
            numbers = ", ".join(str(each.number) for each in segments[:12]) + (", ..." if len(segments) > 12 else "")
            raise ValueError(f"label: expected one of the numbers {numbers or 'of no label'}, got {label}")
        return found[0]
    if not isinstance(label, str):
        raise TypeError(sentence("label", "the name or the number of a label", label))
    found = [each for each in segments if each.name == label]
    if len(found) > 1:
        numbers = " and ".join(str(each.number) for each in found)
        raise ValueError(f"label: expected a name that one label has, got {label!r} of {numbers}: use the number")
    if not found:
        close = close_name(label, [each.name for each in segments])
        meant = f"; did you mean {close!r}?" if close else ""
        raise ValueError(f"label: expected the name of a label, got {label!r}{meant}")
    return found[0]


def find_all(segments: tuple[Segment, ...], labels: Any) -> list[Segment]:
    """The segments with names and numbers, at least one; None is all of them."""
    try:
        wanted = list(segments if labels is None or isinstance(labels, str) else labels)
    except TypeError:
        wanted = None
    if wanted is None or isinstance(labels, str):
        raise TypeError(sentence("labels", "a sequence of names and numbers", labels))
    if not wanted:
        raise ValueError("labels: expected at least one label, got none")
    return wanted if labels is None else [find(segments, each) for each in wanted]


def srgb(numbers: Any) -> NDArray[np.float64]:
    """The colour of three numbers in a file."""
    color = np.clip(np.asarray(numbers, dtype=float), 0, 1)
    if color.shape != (3,) or not np.isfinite(color).all():
        raise ValueError(f"expected three numbers of a colour, got {numbers}")
    return color


def as_labels(data: ArrayLike | VolumeData) -> VolumeData:
    """The labels that a caller gives, as integers; a copy if the caller could change them."""
    check_plain(data, "data")
    if not isinstance(data, VolumeData):
        refuse_images(data, "an array of labels")
        data = VolumeData(np.asarray(data))
    samples = whole_numbers(data.data)
    if _may_change(samples) and np.may_share_memory(samples, data.data):
        samples = samples.copy()
    return data.replace(data=samples)


def _may_change(array):
    """Whether an array, or one that it is a view of, can be written to."""
    while isinstance(array, np.ndarray):
        if array.flags.writeable:
            return True
        array = array.base
    return False


def whole_numbers(data: NDArray[Any], dimensions: tuple[int, ...] = (3,)) -> NDArray[np.integer]:
    """The labels as integers; an array of several layers has four dimensions."""
    if data.ndim not in dimensions or 0 in data.shape:
        raise ValueError(f"data: expected a three-dimensional array of labels, got shape {data.shape}")
    if data.dtype.kind == "b":
        return _core._as_array(data, "data").view(np.uint8)  # whose bytes are 0 or 1
    if data.dtype.kind in "iu":
        if data.dtype == np.uint64 and data.max() > np.iinfo(np.int64).max:
            raise ValueError(f"data: expected labels below 2**63, got {data.max()}")
        return data
    if data.dtype.kind != "f":
        raise TypeError(f"data: expected whole numbers, got {data.dtype}")
    with np.errstate(invalid="ignore"):
        whole = data.astype(np.int32)
    if not np.array_equal(whole, data):
        wrong = data[whole != data].flat[0]
        large = f"labels of 32 bits in an array of {data.dtype}"
        expected = large if float(wrong).is_integer() else "whole numbers, the labels of voxels"
        raise ValueError(f"data: expected {expected}, got {wrong}")
    return whole
