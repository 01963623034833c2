"""Attributes of DICOM files and of their frames, read by pydicom.

A file of a series has one frame; a multi-frame file has several, whose attributes are in functional groups (PS3.3
C.7.6.16). Functions here run in the reader's process.
"""

from __future__ import annotations

import mmap
import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.parameters import printable
from .checks import check_components, check_samples

_UNDEFINED = 0xFFFFFFFF  # length of an element with an end mark
_PHOTOMETRIC = ("MONOCHROME1", "MONOCHROME2")
# The spacing of pixels, in the order of preference; the last one is what ITK writes in files of no modality.
_SPACINGS = ("PixelSpacing", "ImagerPixelSpacing", "NominalScannedPixelSpacing")
# What frames without positions may differ by, if they are slices.
_IN_SPACE = ("GridFrameOffsetVector", "SliceVector", "SliceLocationVector", "PageNumberVector", "FrameLabelVector")


@dataclass
class Frame:
    """What a file tells of a frame; lengths are in mm, x first, in the patient's coordinates."""

    file: str
    number: int  # in the file
    count: int  # of frames in the file
    series: str  # Series Instance UID
    size: tuple[int, int]
    stored: np.dtype[Any]
    bits: int  # of a stored number
    high_bit: int
    photometric: str
    slope: float
    intercept: float
    spacing: tuple[float, float]
    thickness: float | None  # the distance of slices that the file tells, which positions override
    between: float | None  # the same, if it is that of their middles, and not how thick they are
    direction: Any  # (6,) of rows and of columns
    is_oriented: bool  # whether the file tells the direction, and thus how the patient lies
    position: Any  # (3,) of the first sample
    is_placed: bool  # whether the file tells the position
    segment_number: int  # of the segment of which it is a mask, or 0
    segment: str  # number and label of it, or empty
    told: tuple[str, ...]  # what the user is to know of its place, for a warning

    @property
    def name(self) -> str:
        """For messages."""
        return os.path.basename(self.file) + (f" (frame {self.number + 1})" if self.count > 1 else "")

    @property
    def normal(self) -> Any:
        """Direction across the slice."""
        return np.cross(self.direction[:3], self.direction[3:])

    def scaled(self, samples: Any, dtype: Any) -> Any:
        """Stored numbers in the unit of the file, as `dtype`."""
        if (self.slope, self.intercept) != (1, 0):
            samples = samples * np.float64(self.slope) + np.float64(self.intercept)
        return samples.astype(dtype, copy=False)


class _Mapped(mmap.mmap):
    """A file that allocates no more than it has, whatever length is read; a seek beyond the end goes to the end."""

    def seek(self, offset, whence=os.SEEK_SET):
        begin = {os.SEEK_SET: 0, os.SEEK_CUR: self.tell(), os.SEEK_END: len(self)}[whence]
        super().seek(min(begin + offset, len(self)))


def read_dataset(file, **options):
    """The elements of a file, each of them whole."""
    import pydicom

    if os.path.getsize(file) == 0:
        raise ValueError("expected a DICOM file, got an empty file")
    content: Any
    with open(file, "rb") as opened, _Mapped(opened.fileno(), 0, access=mmap.ACCESS_READ) as content:
        dataset = pydicom.dcmread(content, force=True, **options)
    element: Any
    for tag, element in dataset.items():
        length = getattr(element, "length", _UNDEFINED)
        got = len(element.value or b"") if length != _UNDEFINED else length
        if got != length:
            raise ValueError(f"expected {length} bytes of element {tag}, got {got}: the file is truncated or damaged")
    return dataset


def is_directory(dataset):
    """Whether a file lists others and has no pixels of its own."""
    from pydicom.uid import MediaStorageDirectoryStorage

    return dataset.file_meta.get("MediaStorageSOPClassUID") == MediaStorageDirectoryStorage


def frames_of(file, dataset):
    """The frames of a file in its order. Its pixels need not have been read."""
    size = _required(dataset, "Columns"), _required(dataset, "Rows")
    count = int(dataset.get("NumberOfFrames") or 1)
    check_components(_required(dataset, "SamplesPerPixel"))
    stored, bits, high_bit = _stored_type(dataset)
    check_samples((count, *size[::-1]), stored)
    photometric = str(dataset.get("PhotometricInterpretation"))
    if photometric not in _PHOTOMETRIC:
        raise ValueError(f"expected photometric interpretation {' or '.join(_PHOTOMETRIC)}, got {photometric}")
    if dataset.get("ModalityLUTSequence"):
        raise ValueError("expected samples with a rescale slope, got some with a modality LUT")
    frames = []
    for number, groups in enumerate(_groups_of(dataset, count)):
        slope, intercept = _scaling(dataset, groups)
        oriented = _direction(dataset, groups)
        direction = np.array([1.0, 0, 0, 0, 1, 0]) if oriented is None else oriented
        thickness, between = _distances(dataset, groups)
        position, is_placed = _position(dataset, groups, number, direction, thickness)
        spacing, spacing_name = _spacing(dataset, groups)
        frames.append(
            Frame(
                file=str(file),
                number=number,
                count=count,
                series=str(dataset.get("SeriesInstanceUID") or ""),
                size=size,
                stored=stored,
                bits=bits,
                high_bit=high_bit,
                photometric=photometric,
                slope=slope,
                intercept=intercept,
                spacing=spacing,
                thickness=thickness,
                between=between,
                direction=direction,
                is_oriented=oriented is not None,
                position=position,
                is_placed=is_placed,
                segment_number=_segment_number(groups) or 0,
                segment=_segment(dataset, groups),
                told=_told_of_place(dataset, groups, spacing_name, thickness),
            )
        )
    return frames


def _required(dataset, name):
    value = dataset.get(name)
    if value is None:
        raise ValueError(f"expected an image with the attribute {name}, got none: the file is truncated or damaged")
    return int(value)


def _stored_type(dataset):
    """The type of stored numbers, how many bits they have, and the highest of these."""
    allocated = _required(dataset, "BitsAllocated")
    if "PixelRepresentation" not in dataset:  # as of floating-point pixels
        if allocated not in (32, 64):
            raise ValueError(f"expected 32 or 64 bits of floating-point pixels, got {allocated}")
        return np.dtype(f"f{allocated // 8}"), allocated, allocated - 1
    if allocated not in (1, 8, 16, 32, 64):
        raise ValueError(f"expected 1, 8, 16, 32 or 64 bits allocated, got {allocated}")
    bits, high_bit = _required(dataset, "BitsStored"), _required(dataset, "HighBit")
    if not 1 <= bits <= high_bit + 1 <= allocated:
        raise ValueError(f"expected from 1 to {allocated} bits stored, got {bits}, the highest of them {high_bit}")
    kind = "i" if _required(dataset, "PixelRepresentation") else "u"
    return np.dtype(f"{kind}{max(allocated // 8, 1)}"), bits, high_bit


def _groups_of(dataset, count):
    """The functional groups of each frame: its own before those that all share."""
    shared = list(dataset.get("SharedFunctionalGroupsSequence") or ())[:1]
    each = dataset.get("PerFrameFunctionalGroupsSequence")
    if not each:
        return [shared] * count
    if len(each) != count:
        raise ValueError(f"expected functional groups of {count} frames, got {len(each)}")
    return [[own, *shared] for own in each]


def _lookup(dataset, groups, sequence, name):
    """An attribute of a frame in its functional group, or else of the file; None if it is missing or empty."""
    value = _lookup_group(groups, sequence, name)
    if value is None:
        value = dataset.get(name)
    return None if value == "" else value


def _lookup_group(groups, sequence, name):
    values = (items[0].get(name) for group in groups if (items := group.get(sequence)))
    return next((value for value in values if value not in (None, "")), None)


def _numbers(values, name, count):
    array = np.array(values, dtype=float).reshape(-1)
    if array.shape != (count,) or not np.isfinite(array).all():
        raise ValueError(f"expected {count} finite numbers as {name}, got {array.tolist()}")
    return array


def _scaling(dataset, groups):
    """Rescale slope and intercept, or the factor of a dose."""
    slope = _lookup(dataset, groups, "PixelValueTransformationSequence", "RescaleSlope")
    intercept = _lookup(dataset, groups, "PixelValueTransformationSequence", "RescaleIntercept")
    if slope is None:
        slope = dataset.get("DoseGridScaling")
    return (
        1.0 if slope is None else float(_numbers(slope, "RescaleSlope", 1)[0]),
        0.0 if intercept is None else float(_numbers(intercept, "RescaleIntercept", 1)[0]),
    )


def _spacing(dataset, groups):
    """The spacing along x and y, and the attribute that tells it; 1 and an empty name if none does."""
    for name in _SPACINGS:
        value = _lookup(dataset, groups, "PixelMeasuresSequence", name)
        if value is not None:
            y, x = _numbers(value, name, 2)
            return (float(x), float(y)), name
    return (1.0, 1.0), ""


def _told_of_place(dataset, groups, spacing_name, thickness):
    """What the user is to know: what the file has not, or has for another place."""
    told, missing = [], [] if spacing_name else ["PixelSpacing"]
    if spacing_name == "ImagerPixelSpacing":
        told.append("spacing along x and y is that on the detector, ImagerPixelSpacing, and not in the patient")
    placed = _lookup_group(groups, "PlanePositionSequence", "ImagePositionPatient")
    if thickness is None and placed is None and int(dataset.get("NumberOfFrames") or 1) > 1:
        missing += [] if "GridFrameOffsetVector" in dataset else ["distance of slices"]
    if missing:
        told.append(f"the file has no {' and no '.join(missing)}: 1 mm is assumed; say spacing=(x, y, z)")
    return tuple(told)


def _segment_number(groups):
    return _lookup_group(groups, "SegmentIdentificationSequence", "ReferencedSegmentNumber")


def _segment(dataset, groups):
    """The number and the label of the segment of a frame of a segmentation; empty for other frames."""
    number = _segment_number(groups)
    if number is None:
        return ""
    described = (each for each in dataset.get("SegmentSequence") or () if each.get("SegmentNumber") == number)
    label = next((each.get("SegmentLabel") for each in described), None)
    return printable(f"{number} ({label})" if label else f"{number}")


def _detector(dataset):
    """The detector of nuclear medicine, whose files have no functional groups, in a list; an empty one for others."""
    return list(dataset.get("DetectorInformationSequence") or ())[:1]


def _direction(dataset, groups):
    """The directions of rows and of columns, (6,), or None if the file does not tell them."""
    direction = _lookup(dataset, groups, "PlaneOrientationSequence", "ImageOrientationPatient")
    if direction is None:
        direction = next((each.get("ImageOrientationPatient") for each in _detector(dataset)), None)
    if not direction:
        return None
    direction = _numbers(direction, "ImageOrientationPatient", 6)
    lengths = np.linalg.norm(direction.reshape(2, 3), axis=1)
    if not np.allclose(lengths, 1, atol=0.01) or abs(direction[:3] @ direction[3:]) > 0.01:
        raise ValueError(f"expected two perpendicular directions as ImageOrientationPatient, got {direction.tolist()}")
    return direction / np.repeat(lengths, 3)


def _distances(dataset, groups):
    """The distance of slices that the file tells, and the same if it is that of their middles; None for what is not."""
    names = ("SpacingBetweenSlices", "SliceThickness")
    told = {name: _lookup(dataset, groups, "PixelMeasuresSequence", name) for name in names}
    lengths = {name: float(_numbers(value, name, 1)[0]) for name, value in told.items() if value is not None}
    return next((length for length in lengths.values() if length), None), lengths.get(names[0]) or None


def _position(dataset, groups, number, direction, thickness):
    """The position of a frame, and whether the file tells it."""
    position = _lookup_group(groups, "PlanePositionSequence", "ImagePositionPatient")
    if position is not None:
        return _numbers(position, "ImagePositionPatient", 3), True
    # The position of the first frame, and a distance of each other from it.
    sources = (dataset, *_detector(dataset))
    position = next((found for each in sources if (found := each.get("ImagePositionPatient"))), None)
    first = _numbers(position or (0, 0, 0), "ImagePositionPatient", 3)
    if number:
        first = first + np.cross(direction[:3], direction[3:]) * _offset(dataset, number, thickness)
    return first, position is not None


def _offset(dataset, number, thickness):
    """The distance of a frame from the first, along the normal, in a file that has no position of each frame."""
    _check_increments(dataset)
    for name, unit in (("GridFrameOffsetVector", 1.0), ("SliceVector", thickness or 1.0)):  # of a dose, of a tomogram
        offsets = dataset.get(name)
        if offsets is not None:
            offsets = _numbers(offsets, name, int(dataset.NumberOfFrames))
            return (offsets[number] - offsets[0]) * unit
    return number * (thickness or 1.0)


def _check_increments(dataset):
    """Refuse frames that differ by something else than their place, such as time or the angle of a projection."""
    from pydicom.datadict import keyword_for_tag

    pointer = dataset.get("FrameIncrementPointer") or ()
    for tag in (pointer,) if isinstance(pointer, int) else pointer:
        name = keyword_for_tag(tag) or str(tag)
        numbers: Any = dataset.get(name) if name.endswith("Vector") else None
        is_constant = np.size(numbers) > 1 and len(set(numbers)) == 1  # as of the only detector
        if name not in _IN_SPACE and not is_constant:
            raise ValueError(f"expected frames that are slices, got some that differ by {name} (a time series?)")
