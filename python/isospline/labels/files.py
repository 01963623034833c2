"""Label maps from files: the samples, and names and colours where the format has them."""

from __future__ import annotations

import html
import os
import re
from pathlib import Path
from typing import Any

import numpy as np

from ..base.parameters import check_path
from ..colors import linear_to_srgb
from ..io import VolumeData, dicom, nifti, nrrd, read_volume
from ..io.confinement import check_within
from ..io.read import FORMATS, check_frame, check_used, errors_name
from ..io.told import spacing_given
from .segments import Given, Segment, categorical_color, srgb


def read(path: str | os.PathLike[str], **place: Any) -> tuple[VolumeData, list[Segment] | dict[int, Given]]:
    """The samples of a file, and its segments, or what it tells of labels by their numbers.

    Samples of several layers, as Slicer writes overlapping segments, have the shape [z, y, x, layer].
    """
    check_path(path)
    name = os.fspath(path).lower()
    if name.endswith(nrrd.SUFFIXES) and os.path.isfile(path) and place.get("shape") is None:
        with errors_name(path, "NRRD"):
            values = nrrd.read_header(path).values
            segments = _slicer_segments(values)
        data = read_volume(path, **place) if not segments else _read_layers(path, place)
        return data, segments
    if os.path.isfile(path) and place.get("shape") is None and _may_be_dicom(path):
        found = _read(path, "DICOM", place, lambda path, within: dicom.read_segmentation(path))
        if found is not None:
            return found[0], _dicom_segments(found[1])
    data = read_volume(path, **place)
    if name.endswith(nifti.SUFFIXES):
        return data, _nifti_labels(Path(path))
    return data, {}


def has_segments(path: str | os.PathLike[str]) -> bool:
    """Whether a file describes segments, by its header alone."""
    name = os.fspath(path).lower()
    if not os.path.isfile(path):
        return False
    if name.endswith(nrrd.SUFFIXES):
        with errors_name(path, "NRRD"):
            return bool(_slicer_segments(nrrd.read_header(path).values))
    if name.endswith(nifti.SUFFIXES):
        return bool(_nifti_labels(Path(path)))
    if _may_be_dicom(path):
        with errors_name(path, "DICOM"):
            return dicom.has_segments(Path(path))
    return False


def _read_layers(path, place):
    """The samples of a segmentation of Slicer; `read_volume` reads files with one layer only."""
    layered, _ = _read(path, "NRRD", place, lambda path, within: (nrrd.read(path, layered=True, within=within), []))
    return read_volume(path, **place) if layered.data.ndim == 3 else layered


def _read(path, format, place, read):
    """What a function reads, a volume and its segments, or None, with the place that the caller gives."""
    within = place.get("within")
    check_used(path, **{option: place[option] for option in ("dtype", "offset", "name") if option in place})
    frame = check_frame(*(place.get(name) for name in ("spacing", "origin", "direction")))
    with errors_name(path, format):
        check_within(path, within, "a path")
        with spacing_given(frame["spacing"]):
            found = read(Path(path), within)
    if found is None:
        return None
    given = {name: value for name, value in frame.items() if value is not None}
    return found[0].replace(format=format, **given), found[1]


def _may_be_dicom(path):
    name = os.fspath(path).lower()
    return name.endswith(".dcm") or (not name.endswith((*FORMATS, ".raw")) and dicom.begins_as_dicom(path))


def _dicom_segments(told: list[dict[str, Any]]) -> list[Segment]:
    """The segments of a DICOM segmentation."""
    segments = []
    for place, each in enumerate(told):
        color = categorical_color(place) if each["color"] is None else _of_cielab(each["color"])
        name = each["name"] or f"Segment {each['number']}"
        segments.append(Segment(each["number"], name, color, each["number"], each["layer"]))
    return sorted(segments, key=lambda segment: segment.number)


def _of_cielab(stored: list[int]) -> Any:
    """The colour in sRGB of CIELab in 16 bits each (DICOM PS3.3 C.10.7.1.1), with the white D65.

    The standard means D50, but highdicom and DCMTK, and with it 3D Slicer, write and read D65.
    """
    lightness, a, b = np.array(stored) / 65535 * (100, 255, 255) - (0, 128, 128)
    roots = (lightness + 16) / 116 + np.array([a / 500, 0, -b / 200])
    xyz = (0.95047, 1, 1.08883) * np.where(roots > 6 / 29, roots**3, 3 * (6 / 29) ** 2 * (roots - 4 / 29))
    to_rgb = [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.9692660, 1.8760108, 0.0415560],
        [0.0556434, -0.2040259, 1.0572252],
    ]
    return srgb(linear_to_srgb(np.clip(to_rgb @ xyz, 0, 1)))


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
