"""Label maps in ``isospline render`` and ``measure``."""

from __future__ import annotations

import json
import re

import isospline

from ..colors import color_of
from ..io.label_map import count_of_labels
from ..labels.files import has_segments
from ..labels.segments import find
from ..labels.surfaces import SMOOTHING
from .given import MODEL, given, refuse_with, refuse_without
from .store import OF_STORES, opened
from .summary import unit_power
from .write import writing

# Options of isosurfaces and stores, and those of isosurfaces that only pictures of labels have, too.
_OF_VOLUMES = ("level", *MODEL, "inside", "largest", "frames", "tolerance", "order", *OF_STORES)
_NOT_MEASURED = ("clip", "clip_box", "capped", "closed")
# Digits of numbers in a table.
_DIGITS = 6


def add_labels(command):
    """The options of label maps; returns their group."""
    group = command.add_argument_group("label maps")
    group.add_argument(
        "--labels",
        action="store_true",
        help="FILE is a label map: each label has a smooth surface; by default if it looks like one and no --level is "
        "given",
    )
    group.add_argument(
        "--label", action="append", metavar="NAME", help="this label alone, by its name or number; may be repeated"
    )
    group.add_argument(
        "--label-smoothing",
        type=float,
        metavar="VOXELS",
        help="standard deviation of the smoothing, 0.5 to 4 (default 1.5)",
    )
    return group


def given_labels(arguments, reading):
    """The label map that the options name, or a segmentation of Slicer; None for other files."""
    is_named = arguments.labels or arguments.label
    is_segmentation = str(arguments.file).lower().endswith((".seg.nrrd", ".seg.nhdr")) and arguments.level is None
    if not (is_named or is_segmentation):
        return None
    refuse_with(arguments, _OF_VOLUMES, "a label map")
    return isospline.Labels.read(arguments.file, **reading)


def opened_or_labels(arguments, read, reading):
    """What `opened` gives, and None; of a file that describes segments its first layer, and its label map."""
    refused = None
    try:
        if not given(arguments, ("shape", *OF_STORES)) and has_segments(arguments.file):
            labels = isospline.Labels.read(arguments.file, **reading(arguments))
            return labels.source, labels
    except (ValueError, TypeError) as error:  # such as of fractional segments, which are read as a volume
        refused = error
    try:
        return opened(arguments, read), None
    except (ValueError, TypeError) as error:
        raise refused or error from None


def recognized_labels(data, arguments, reading, say):
    """The label map that was read as a volume, if it looks like one and no level was given; otherwise None."""
    if arguments.level is not None:
        refuse_with(arguments, ["label_smoothing"], "--level")
    may_be = arguments.level is None and isinstance(data, isospline.VolumeData)
    count = count_of_labels(data.data) if may_be else None
    if count is None:
        refuse_without(arguments, ["label_smoothing"], "a label map", arguments.file)
        return None
    say(f"a label map, as its {count} values are constant over large parts; --level makes an isosurface of the numbers")
    refuse_with(arguments, _OF_VOLUMES, "a label map")
    return isospline.Labels.read(arguments.file, **reading)


def _smoothing(arguments):
    return SMOOTHING if arguments.label_smoothing is None else arguments.label_smoothing


def wanted_labels(labels, arguments):
    """The numbers of the labels that the options choose."""
    if not arguments.label:
        return list(labels.numbers)
    return [find(labels.segments, _name_or_number(labels, word)).number for word in arguments.label]


def _name_or_number(labels, word):
    """A number, unless a label has these digits as its name and none has this number."""
    if not re.fullmatch("-?[0-9]+", word):
        return word
    number = int(word)
    return word if word in labels.names and number not in labels.numbers else number


def set_colors(labels, arguments):
    """Give each label its colour and each mesh one of the others, unless the options say otherwise."""
    numbers = wanted_labels(labels, arguments)
    if not (arguments.color or arguments.color_by):
        of_labels = [tuple(labels.colors[labels.numbers.index(number)].tolist()) for number in numbers]
        arguments.color = [*of_labels, *(color_of(place) for place in range(len(arguments.mesh)))]
    return len(numbers) + len(arguments.mesh)


def label_surfaces(labels, arguments, **options):
    """The surfaces of the labels that the options choose."""
    chosen = wanted_labels(labels, arguments)
    return labels.surfaces(chosen, smoothing=_smoothing(arguments), **options)


def measure_labels(labels, arguments, progress, unicode):
    """Print the measures of labels, or write them to a table."""
    refuse_with(arguments, _NOT_MEASURED, "measures of a label map")
    with progress("measuring", arguments) as report:
        chosen = wanted_labels(labels, arguments)
        found = labels.measure(chosen, smoothing=_smoothing(arguments), progress=report)
    unit = labels.frame["unit"]
    if arguments.output:
        with writing():
            found.to_csv(arguments.output)
        print(f"{arguments.output}: {len(found.numbers)} labels")
    elif arguments.json:
        rows = [dict(zip(found._columns(), row)) for row in found._rows()]
        print(json.dumps({"path": str(arguments.file), "unit": unit, "labels": rows}, indent=2))
    else:
        print(_text(arguments.file, found, unit, unicode))


def _text(path, found, unit, unicode):
    """The table as text."""
    width = max([len(name) for name in found.names] + [5])
    volume, area = (f"{name}, {unit_power(unit, power, unicode)}" for name, power in (("volume", 3), ("area", 2)))
    lines = [str(path), f"  {'number':>6}  {'name':<{width}}  {'voxels':>9}  {volume:>14}  {area:>14}  centroid"]
    for row in range(len(found.numbers)):
        center = ", ".join(f"{each:.{_DIGITS}g}" for each in found.centroids[row])
        lines.append(
            f"  {found.numbers[row]:>6}  {found.names[row]:<{width}}  {found.voxel_counts[row]:>9}  "
            f"{found.enclosed_volumes[row]:>14.{_DIGITS}g}  {found.areas[row]:>14.{_DIGITS}g}  ({center})"
        )
    return "\n".join(lines)
