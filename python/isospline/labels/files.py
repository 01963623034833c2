"""Label maps from files: the samples, and names and colours where the format has them."""

from __future__ import annotations

import html
import os
import re
from pathlib import Path
from typing import Any

from ..base.parameters import check_path
from ..io import VolumeData, nifti, nrrd, read_volume
from ..io.confinement import check_within
from ..io.read import check_frame, check_used, errors_name
from .segments import Given, Segment, categorical_color, srgb


def read(path: str | os.PathLike[str], **place: Any) -> tuple[VolumeData, list[Segment] | dict[int, Given]]:
    """The samples of a file, and its segments, or what it tells of labels by their numbers.

    Samples of several layers, as Slicer writes overlapping segments, have the shape [z, y, x, layer].
    """
    check_path(path)
    name = os.fspath(path).lower()
    if name.endswith((".nrrd", ".nhdr")) and os.path.isfile(path) and place.get("shape") is None:
        with errors_name(path, "NRRD"):
            values = nrrd.read_header(path).values
            segments = _slicer_segments(values)
        data = read_volume(path, **place) if not segments else _read_layers(path, place)
        return data, segments
    data = read_volume(path, **place)
    if name.endswith((".nii", ".nii.gz")):
        return data, _nifti_labels(Path(path))
    return data, {}


def _read_layers(path, place):
    """The samples of a segmentation of Slicer; `read_volume` reads files with one layer only."""
    within = place.get("within")
    check_used(path, **{option: place[option] for option in ("dtype", "offset", "name") if option in place})
    frame = check_frame(*(place.get(name) for name in ("spacing", "origin", "direction")))
    with errors_name(path, "NRRD"):
        check_within(path, within, "a path")
        layered = nrrd.read(Path(path), layered=True, within=within)
    if layered.data.ndim == 3:
        return read_volume(path, **place)
    return layered.replace(format="NRRD", **{name: value for name, value in frame.items() if value is not None})


def _slicer_segments(values: dict[str, str]) -> list[Segment]:
    """The segments in the header of a segmentation of 3D Slicer, such as `Segment0_Name:=liver`."""
    segments: list[Segment] = []
    places = sorted(int(match[1]) for key in values if (match := re.fullmatch(r"Segment(\d{1,6})_LabelValue", key)))
    for place in places:

        def whole(field, default, place=place):
            text = values.get(f"Segment{place}_{field}", str(default)).strip()
            if not re.fullmatch(r"\d{1,9}", text):
                raise ValueError(f"expected Segment{place}_{field} to be a whole number, got {text}")
            return int(text)

        words = values.get(f"Segment{place}_Color", "").split()
        try:
            color = srgb([float(word) for word in words])
        except (TypeError, ValueError):
            color = categorical_color(len(segments))
        name = values.get(f"Segment{place}_Name", "").strip() or f"Segment {place}"
        value = whole("LabelValue", 0)
        segments.append(Segment(value, name, color, value, whole("Layer", 0)))
    if len({each.number for each in segments}) < len(segments):  # several layers share values
        segments = [each._replace(number=number) for number, each in enumerate(segments, 1)]
    return sorted(segments)


def _nifti_labels(path: Path) -> dict[int, Given]:
    """The table of labels in a header extension, as TotalSegmentator and Connectome Workbench write it."""
    with errors_name(path, "NIfTI"):
        text = nifti.read_extensions(path)
    found = {}
    for attributes, name in re.findall(r"<Label\b([^>]*)>(.*?)</Label>", text, re.DOTALL):
        fields = dict(re.findall(r'(\w+)\s*=\s*"([^"]*)"', attributes))
        if not re.fullmatch(r"\d{1,9}", fields.get("Key", "")):
            continue
        plain = re.fullmatch(r"\s*<!\[CDATA\[(.*?)\]\]>\s*", name, re.DOTALL)
        try:
            color = srgb([float(fields[each]) for each in ("Red", "Green", "Blue")])
        except (KeyError, ValueError):
            color = None
        found[int(fields["Key"])] = Given((plain[1] if plain else html.unescape(name)).strip() or None, color)
    return found
