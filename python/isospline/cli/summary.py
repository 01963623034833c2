"""A summary of a volume file, as numbers and as text for a terminal."""

from __future__ import annotations

import math

import numpy as np

from ..levels import histogram, levels_of_histogram

#: Rows of the histogram.
ROWS = 24
#: Components of a surface that are listed.
MOST_COMPONENTS = 10

_COMPONENT_COLUMNS = ("enclosed_volumes", "areas", "cell_counts", "bounds")
#: The description of a patient's frame, whose unit is mm unless the file tells another.
PATIENT = "x runs to the left, y to the back, z to the head"


def summarize(volume, path, labels=None):
    """Numbers about a VolumeData, of types that JSON supports; vectors are (x, y, z), a matrix is a list of rows.

    Of a label map, segments are in the place of numbers about its samples.
    """
    data = volume.data
    about = _about(volume, path)
    if labels is not None:
        table = labels.table()
        columns = table.numbers.tolist(), table.names.tolist(), table.voxel_counts.tolist()
        return {**about, "segments": [dict(zip(("number", "name", "voxels"), row)) for row in zip(*columns)]}
    values, counts = histogram(data)
    # Over a power of two, at most 1: neither sums nor squares overflow.
    exponent = int(np.frexp(np.abs(values).max())[1])
    shares = np.ldexp(values, -exponent)
    mean = np.average(shares, weights=counts)
    edges = np.linspace(shares[0], shares[-1], (ROWS if len(values) > 1 else 1) + 1)
    rows = np.histogram(shares, edges, weights=counts)[0] if len(values) > 1 else counts
    return {
        **about,
        "minimum": float(data.min()),
        "maximum": float(data.max()),
        "mean": math.ldexp(mean, exponent),
        "standard_deviation": math.ldexp(_standard_deviation(data, mean, exponent), exponent),
        "histogram": {"edges": np.ldexp(edges, exponent).tolist(), "counts": rows.astype(int).tolist()},
        "suggested_levels": levels_of_histogram(values, counts, 3),
    }


def _standard_deviation(data, mean, exponent):
    """That of the samples over a power of two, slice by slice: bins of the histogram have deviations of their own."""
    slices = (np.ldexp(each.astype(float), -exponent) for each in np.atleast_2d(data))
    squares = math.fsum(float(((each - mean) ** 2).sum()) for each in slices)
    return math.sqrt(squares / data.size)


def _about(volume, path):
    """The format of a VolumeData, and its place."""
    data = volume.data
    return {
        "path": str(path),
        "format": volume.format,
        "size": list(data.shape[::-1]),
        "type": str(data.dtype.newbyteorder("=")),
        "bytes": data.nbytes,
        "spacing": list(volume.spacing),
        "origin": list(volume.origin),
        "direction": np.asarray(volume.direction).tolist(),
        "unit": volume.unit,
        "patient": volume.patient,
        "bounds": bounds_of(volume),
    }


def bounds_of(volume):
    """The lower and the upper corner of the box of a VolumeData's samples in the world."""
    corners = volume.position(np.stack(np.meshgrid(*((0, count - 1) for count in volume.data.shape[::-1])), axis=-1))
    return [corners.min(axis=(0, 1, 2)).tolist(), corners.max(axis=(0, 1, 2)).tolist()]


def describe(summary, width=80, unicode=True):
    """The summary as text; `width` is that of the terminal."""
    lower, upper = summary["bounds"]
    unit = f"  {summary['unit']}" if summary["unit"] else ""
    patient = f"{PATIENT}, in {summary['unit'] or 'mm'}" if summary["patient"] else "unknown"
    lines = [
        summary["path"],
        f"  format     {summary['format']}",
        f"  size       {' x '.join(map(str, summary['size']))}   {summary['type']}, {_bytes(summary['bytes'])}",
        f"  spacing    {_numbers(summary['spacing'])}{unit}",
        f"  origin     {_numbers(summary['origin'])}{unit}",
        f"  direction  {_direction(np.array(summary['direction']))}",
        f"  patient    {patient}",
        f"  from       {_numbers(lower)}{unit}",
        f"  to         {_numbers(upper)}{unit}",
    ]
    if "segments" in summary:
        lines.append(f"  segments   {len(summary['segments'])}   (--labels of render and measure)")
        lines += [f"    {each['number']:>6}  {each['name']}, {each['voxels']} voxels" for each in summary["segments"]]
        return "\n".join(line.rstrip() for line in lines)
    lines += [
        f"  range      {summary['minimum']:.6g} to {summary['maximum']:.6g}, mean {summary['mean']:.6g}, "
        f"standard deviation {summary['standard_deviation']:.6g}",
        f"  levels     {_numbers(summary['suggested_levels']) or 'none: all samples are the same'}   (suggested)",
        "",
        *_histogram_lines(summary, width, unicode),
    ]
    return "\n".join(line.rstrip() for line in lines)


def _numbers(values):
    return "  ".join(f"{value:.6g}" for value in values)


def _histogram_lines(summary, width, unicode):
    """One bar per row, as long as the logarithm of its count; suggested levels are next to their rows."""
    edges, counts = summary["histogram"]["edges"], summary["histogram"]["counts"]
    labels = [f"{edge:.5g}" for edge in edges[:-1]]
    label_width, count_width = max(map(len, labels)), len(str(max(counts)))
    arrow = "←" if unicode else "<-"
    bar_width = max(8, min(width, 120) - label_width - count_width - 24)
    lines = [f"  {'value':>{label_width}}  {'count (bars: logarithm)':<{bar_width}}"]
    for index, (label, count) in enumerate(zip(labels, counts)):
        last = index == len(counts) - 1
        levels = [
            level
            for level in summary["suggested_levels"]
            if edges[index] <= level and (level < edges[index + 1] or last)
        ]
        mark = f" {arrow} {', '.join(f'{level:.5g}' for level in levels)}" if levels else ""
        length = bar_width * math.log1p(count) / math.log1p(max(counts))
        lines.append(f"  {label:>{label_width}}  {_bar(length, unicode):<{bar_width}} {count:>{count_width}}{mark}")
    return lines


def _bar(length, unicode):
    """A bar of a length in characters; in Unicode, to an eighth of a character."""
    if not unicode:
        return "#" * round(length)
    eighths = round(length * 8)
    return "█" * (eighths // 8) + " ▏▎▍▌▋▊▉"[eighths % 8].strip()


def _direction(matrix):
    """`+x +y +z` if the axes are parallel to the world's axes, otherwise the columns."""
    if np.allclose(np.abs(matrix), np.eye(3)[np.abs(matrix).argmax(axis=0)].T, atol=1e-6):
        axes = [int(np.abs(column).argmax()) for column in matrix.T]
        names = [f"{'+' if matrix[axis, index] > 0 else '-'}{'xyz'[axis]}" for index, axis in enumerate(axes)]
        text = " ".join(names)
    else:
        text = "   ".join("(" + ", ".join(f"{value:.4f}" for value in column) + ")" for column in matrix.T)
    return text + ("   (mirrored)" if np.linalg.det(matrix) < 0 else "")


def _bytes(count):
    for unit in ("bytes", "KiB", "MiB", "GiB"):
        if count < 1024 or unit == "GiB":
            return f"{count:.0f} {unit}" if unit == "bytes" else f"{count:.1f} {unit}"
        count /= 1024


def describe_measures(path, level, found, components, unit, unicode):
    """The measures of a file's isosurface as text: a line for each number with its error, and a line for each of the
    largest components. `unit` is that of the volume."""
    powers = {"enclosed_volume": 3, "area": 2, "mean_curvature": 1, "gaussian_curvature": 0}
    units = {name: unit_power(unit, power, unicode) for name, power in powers.items()}
    lines = [str(path), f"  {'level':<20} {level:.6g}"]
    for name, each in found.items():
        lines.append(f"  {name.replace('_', ' '):<20} {each.value:<14.8g} +- {each.error:<8.2g} {units[name]}".rstrip())
    lines.append(f"  {'components':<20} {len(components.areas)}")
    shown = min(len(components.areas), MOST_COMPONENTS)
    if shown:
        heads = [f"{name}, {units[key]}" for name, key in (("volume", "enclosed_volume"), ("area", "area"))]
        box = f"box, {unit_power(unit, 1, unicode)}"
        lines.append(f"    {heads[0]:>14} {heads[1]:>14} {'cells':>9}  {box}")
    for volume, area, cells, box in zip(*(components[name][:shown] for name in _COMPONENT_COLUMNS)):
        corners = " to ".join("(" + ", ".join(f"{value:.6g}" for value in corner) + ")" for corner in box)
        lines.append(f"    {volume:>14.6g} {area:>14.6g} {cells:>9}  {corners}")
    if shown < len(components.areas):
        lines.append(f"    and {len(components.areas) - shown} smaller ones")
    return "\n".join(lines)


def unit_power(unit, power, unicode):
    """The unit of a length, an area or a volume, as mm², or unit^2 if it is unknown."""
    if power == 0:
        return ""
    exponent = ("²", "³")[power - 2] if unit and unicode and power > 1 else f"^{power}" if power > 1 else ""
    return (unit or "unit") + exponent
