"""DICOM segmentations as label maps, read by pydicom. Functions here run in the reader's process."""

from __future__ import annotations

from typing import Any

import numpy as np

from .checks import check_samples
from .dicom_frames import frames_of, read_dataset
from .dicom_pixels import read_samples
from .dicom_stack import check_one_segment, grid_of
from .volume_data import VolumeData

# The number of no segment in label maps, which may describe it like one.
_BACKGROUND = 0


def load_segmentation(path):
    """`dicom.read_segmentation`, in this process; an empty dict for other files."""
    dataset = read_dataset(path, stop_before_pixels=True)
    if not dataset.get("SegmentSequence"):
        return {}
    kind = dataset.get("SegmentationType")
    if kind not in ("BINARY", "LABELMAP"):
        raise ValueError(f"expected segments of the type BINARY or LABELMAP, got {kind}")
    frames = frames_of(path, dataset)
    slices, count, place, told = grid_of(frames)
    if kind == "LABELMAP":
        layers, layer_of = _layers_of_map(frames, slices, count), {}
    else:
        layers, layer_of = _layers_of_masks(frames, slices, count)
    data = layers[0] if len(layers) == 1 else np.stack(layers, axis=-1)
    segments = [_described(item, layer_of) for item in dataset.SegmentSequence if item.SegmentNumber != _BACKGROUND]
    return {**vars(VolumeData(data, **place, unit="mm")), **told, "segments": segments}


def load_count(path):
    """The number of segments that a file describes."""
    return {"segments": len(read_dataset(path, stop_before_pixels=True).get("SegmentSequence") or ())}


def load_mask(frames):
    """The mask of the only segment, as `read_volume` reads it. Slices without a frame are empty."""
    check_one_segment(frames)
    slices, count, place, told = grid_of(frames)
    (data,) = _layers_of_map(frames, slices, count)
    return {**vars(VolumeData(data, **place, unit="mm")), **told}


def _layers_of_map(frames, slices, count):
    """The only layer, of frames whose samples are the numbers of segments. Slices without a frame are empty."""
    if len(set(slices)) < len(frames):
        raise ValueError("expected one frame a slice, got several")
    samples = read_samples(frames, frames[0].stored)
    check_samples((count, *samples.shape[1:]), samples.dtype)
    data = np.zeros((count, *samples.shape[1:]), samples.dtype)
    data[slices] = samples
    return [data]


def _layers_of_masks(frames, slices, count):
    """Layers of labels, of frames that are masks of a segment each, and the layer of each segment by its number.

    A segment is in the first layer where it overlaps no other. Slices without a frame of it have none of it.
    """
    own: dict[int, list[int]] = {}
    for index, frame in enumerate(frames):
        own.setdefault(frame.segment_number, []).append(index)
    shape = (count, *frames[0].size[::-1])
    dtype = np.min_scalar_type(max(own))
    masks = read_samples(frames, np.dtype("u1")) != 0
    layers: list[Any] = []
    layer_of = {}
    for number, indices in sorted(own.items()):
        if number < 1:
            raise ValueError(f"expected frames of segments from 1 on, got {frames[indices[0]].name} of {number}")
        if len({slices[index] for index in indices}) < len(indices):
            raise ValueError(f"expected one frame a slice of segment {number}, got several")
        free = (
            place
            for place, layer in enumerate(layers)
            if not any(layer[slices[index]][masks[index]].any() for index in indices)
        )
        layer_of[number] = next(free, len(layers))
        if layer_of[number] == len(layers):
            check_samples(shape, dtype)
            layers.append(np.zeros(shape, dtype))
        for index in indices:
            layers[layer_of[number]][slices[index]][masks[index]] = number
    return layers, layer_of


def _described(item, layer_of):
    """Number, name, colour and layer of a segment; the colour is CIELab, in 16 bits each, as in the file."""
    number, color = int(item.SegmentNumber), item.get("RecommendedDisplayCIELabValue")
    return {
        "number": number,
        "name": str(item.get("SegmentLabel") or "").strip(),
        "color": None if color is None else list(map(int, color)),
        "layer": layer_of.get(number, 0),
    }
