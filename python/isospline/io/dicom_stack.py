"""Stacks of DICOM frames: their order, the place of the volume and the type of its samples."""

from __future__ import annotations

import numpy as np

# The largest deviation of a slice from its place in an even series, as a fraction of the distance of slices. Positions
# are stored as decimal text, often rounded to 1/100 mm.
TOLERANCE = 0.02
# What the error for a segmentation of several segments advises.
ADVICE = "Labels.read(path) reads all of them"


def arrange(frames):
    """Sort frames along their normal, and check that they make a volume.

    Returns them, the volume's place, and what is `of_spacing` to tell, if there is something.
    """
    first = frames[0]
    check_one_segment(frames)
    _check_alike(frames)
    normal = first.normal
    step = normal * abs(first.thickness or 1.0)
    if len(frames) > 1:
        frames = sorted(frames, key=lambda frame: float(frame.position @ normal))
        step = _even_step(frames)
    return frames, _place(frames, frames[0], step), _told(frames)


def grid_of(frames):
    """The slice of each frame, the number of slices, the volume's place, and what `arrange` tells.

    Several frames may be in a slice, and slices may have none, as in segmentations. The distance of slices is the one
    that the file tells, SpacingBetweenSlices, if the smallest distance of frames is a multiple of it, and otherwise the
    latter.
    """
    _check_alike(frames)
    normal = frames[0].normal
    along = np.array([frame.position @ normal for frame in frames])
    first, last = frames[int(along.argmin())], frames[int(along.argmax())]
    gaps = np.diff(np.sort(along))
    gaps = gaps[gaps > 1e-4 * np.ptp(along)]  # others are between frames of one slice
    if not len(gaps):
        return [0] * len(frames), 1, _place(frames, first, normal * abs(first.thickness or 1.0)), _told(frames)
    count = round(float(np.ptp(along) / _distance(float(gaps.min()), first.between)))
    step = (last.position - first.position) / count
    slices = np.round((along - along.min()) / (step @ normal)).astype(int)
    positions = np.array([frame.position for frame in frames])
    off = np.linalg.norm(positions - first.position - slices[:, None] * step, axis=1)
    if (off > TOLERANCE * np.linalg.norm(step)).any():
        raise ValueError(f"expected evenly spaced slices, got distances from {gaps.min():g} to {gaps.max():g}")
    return slices.tolist(), count + 1, _place(frames, first, step), _told(frames)


def _distance(gap, between):
    """The distance of slices, of the smallest distance of frames and the distance of slices that the file tells."""
    if between is None:
        return gap
    multiple = max(round(gap / abs(between)), 1)
    return gap / multiple if abs(gap / multiple - abs(between)) <= TOLERANCE * abs(between) else gap


def _place(frames, first, step):
    """The place of a volume with this first frame, and this vector from one slice to the next."""
    distance = float(np.linalg.norm(step))
    # The third axis runs along the slices' positions; with a tilted gantry, this is not their normal.
    direction = np.stack([first.direction[:3], first.direction[3:], step / distance], axis=1)
    return {
        "spacing": (*first.spacing, distance),
        "origin": first.position.tolist(),
        "direction": direction,
        "patient": all(frame.is_oriented for frame in frames),
    }


def _told(frames):
    text = "; ".join(dict.fromkeys(told for frame in frames for told in frame.told))
    return {"of_spacing": text} if text else {}


def samples_type(frames):
    """The type of samples of a volume.

    It is that of stored numbers if no frame scales them; an integer type that holds all results if all frames scale by
    the same whole numbers, such as those of Hounsfield units; and float64 otherwise.
    """
    stored = np.result_type(*{frame.stored for frame in frames})
    scalings = {(frame.slope, frame.intercept) for frame in frames}
    if scalings == {(1.0, 0.0)}:
        return stored
    slope, intercept = next(iter(scalings))
    if len(scalings) > 1 or stored.kind == "f" or not (slope.is_integer() and intercept.is_integer()):
        return np.dtype("f8")
    ends = [int(slope) * end + int(intercept) for frame in frames for end in _limits(frame)]
    kind = "u" if min(ends) >= 0 else "i"
    for dtype in (np.dtype(f"{kind}{size}") for size in (1, 2, 4)):
        if np.iinfo(dtype).min <= min(ends) and max(ends) <= np.iinfo(dtype).max:
            return dtype
    return np.dtype("f8")


def check_one_segment(frames):
    """Check that frames are masks of one segment, or of none."""
    segments = list(dict.fromkeys(frame.segment for frame in frames))
    if len(segments) > 1:
        names = ", ".join(each or "frames of none" for each in segments)
        raise ValueError(f"expected a mask of one segment, got {len(segments)}: {names}; {ADVICE}")


def _check_alike(frames):
    """Check that frames have one size, spacing, direction and photometric interpretation."""
    for what in ("size", "spacing", "direction"):
        values = np.array([getattr(frame, what) for frame in frames])
        differ = ~np.isclose(values, values[0], rtol=1e-4, atol=1e-4).all(axis=1)
        if differ.any():
            _refuse(what, frames[0], frames[int(differ.argmax())])
    other = next((frame for frame in frames if frame.photometric != frames[0].photometric), None)
    if other is not None:
        _refuse("photometric interpretation", frames[0], other)
    # Frames of one file may have no positions; they are then in order.
    without = [frame for frame in frames if not frame.is_placed]
    if without and (len(without) < len(frames) or len({frame.file for frame in frames}) > 1):
        raise ValueError(f"expected slices with the attribute ImagePositionPatient, got none in {without[0].name}")


def _refuse(what, first, other):
    expected, got = (np.asarray(getattr(frame, what.split()[0])).tolist() for frame in (first, other))
    raise ValueError(f"expected slices of the same {what}, got {expected} in {first.name} and {got} in {other.name}")


def _even_step(frames):
    """The vector from one slice to the next, after checking that they are evenly spaced along a line."""
    positions = np.array([frame.position for frame in frames])
    step = (positions[-1] - positions[0]) / (len(positions) - 1)
    even = positions[0] + np.arange(len(positions))[:, None] * step
    off = np.linalg.norm(positions - even, axis=1)
    distance = np.linalg.norm(step)
    if not (off <= TOLERANCE * distance).all() or distance == 0:
        gaps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
        raise ValueError(
            f"expected evenly spaced slices, got distances from {gaps.min():g} to {gaps.max():g} "
            "(slices missing, or a time series?)"
        )
    return step


def _limits(frame):
    """The smallest and the largest stored number."""
    if frame.stored.kind == "u":
        return 0, 2**frame.bits - 1
    return -(2 ** (frame.bits - 1)), 2 ** (frame.bits - 1) - 1
