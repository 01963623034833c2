"""What the metadata of TIFF files, opened by tifffile, tell of their samples: place, orientation and calibration."""

from __future__ import annotations

import xml.etree.ElementTree
from typing import Any

import numpy as np

# Names of units in ImageJ, and units of length in metres.
_UNITS = {"micron": "µm", "microns": "µm", "um": "µm", "\\u00B5m": "µm", "pixel": "", "pixels": ""}
_LENGTHS = {"nm": 1e-9, "µm": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "inch": 0.0254}
# The numbers of coefficients of ImageJ's calibration functions of samples that are polynomials, by their codes (its
# class Calibration), and the code of none.
_POLYNOMIALS, _UNCALIBRATED = {0: 2, 1: 3, 2: 4, 3: 5}, 20
# Millimetres of the units of the resolution tags, and resolutions per inch of screens, printers and scanners, which
# tell nothing of the sample.
_RESOLUTION_UNITS = {2: 25.4, 3: 10.0}
_RESOLUTIONS = (1, 72, 75, 90, 96, 100, 120, 144, 150, 180, 200, 240, 300, 350, 360, 400, 600, 720, 1200, 2400, 4800)


def place_of(file):
    """Spacing and unit from ImageJ's or OME's metadata; ones without a unit if these do not calibrate x and y.

    A missing spacing along z is 1 in a stack of ImageJ, which does not write it then (ij/io/FileSaver.java). OME leaves
    it open, and so does one slice of ImageJ: then `of_spacing` tells it, too, as resolution tags of other files.
    """
    is_known = True  # the spacing along z
    if file.is_imagej:
        metadata, tags = file.imagej_metadata, file.pages[0].tags
        is_known = "spacing" in metadata or int(metadata.get("images", 1)) > 1
        names = [str(metadata.get(name, metadata.get("unit", ""))) for name in ("unit", "yunit", "zunit")]
        # Pixels per inch without a spacing are a printer's resolution, which ImageJ takes from any TIFF file.
        if "spacing" not in metadata and _UNITS.get(names[0], names[0]) in ("", "inch"):
            return {}
        spacing = _resolution_of(tags)
        spacing.append(abs(float(metadata.get("spacing", 1))))
    elif file.is_ome:
        elements = xml.etree.ElementTree.fromstring(file.ome_metadata).iter()
        pixels: Any = next((element for element in elements if element.tag.endswith("}Pixels")), {})
        spacing = [float(pixels.get(f"PhysicalSize{axis}", 0)) for axis in "XYZ"]
        names = [pixels.get(f"PhysicalSize{axis}Unit", "µm") for axis in "XYZ"]
        if min(spacing[:2]) > 0 and spacing[2] == 0:
            spacing[2], names[2], is_known = 1.0, names[0], False
    else:
        return _told_of_resolution(file.pages[0].tags)
    if not min(spacing) > 0:
        return {}
    told = f"the file has no spacing along z: 1 {names[0]} is assumed; say spacing=(x, y, z)"
    units = [_UNITS.get(name, name) for name in names]
    if len(set(units)) > 1:
        if not set(units) <= set(_LENGTHS):
            raise ValueError(f"expected units of length along x, y and z, got {', '.join(names)}")
        spacing = [value * _LENGTHS[unit] / _LENGTHS[units[0]] for value, unit in zip(spacing, units)]
        spacing = [float(f"{value:.12g}") for value in spacing]  # without the rounding of the factors
    if is_transposed(file):
        spacing[:2] = spacing[1::-1]
    return {"spacing": tuple(spacing), "unit": units[0], **({} if is_known else {"of_spacing": told})}


def _resolution_of(tags):
    """The spacing along x and y in the unit of the resolution tags; zeros without them."""
    resolution = [tags[name].value if name in tags else (0, 1) for name in ("XResolution", "YResolution")]
    return [bottom / top if top else 0.0 for top, bottom in resolution]


def _told_of_resolution(tags):
    """What `of_spacing` tells if resolution tags of a plain file may be the sample's: they do not include z."""
    unit = _RESOLUTION_UNITS.get(int(tags["ResolutionUnit"].value) if "ResolutionUnit" in tags else 2)
    spacing = [each * unit for each in _resolution_of(tags)] if unit else [0.0]
    if not min(spacing) > 0 or all(min(abs(25.4 / each - known) for known in _RESOLUTIONS) < 0.1 for each in spacing):
        return {}
    text = " and ".join(f"{each:.6g}" for each in spacing)
    return {"of_spacing": f"spacing is 1, and not {text} mm, the resolution that tags tell for x and y: say spacing="}


def _orientation_of(file):
    """The tag Orientation, from 1 to 8; 1, the first row at the top and the first column at the left, without it."""
    tags = file.pages[0].tags
    value = tags["Orientation"].value if "Orientation" in tags else 1
    return int(value) if value in range(1, 9) else 1


def is_upright(file):
    """Whether the first row is at the top, and the first column at the left."""
    return _orientation_of(file) == 1


def is_transposed(file):
    """Whether rows are columns of the picture."""
    return _orientation_of(file) > 4


def upright(samples, file):
    """Samples [..., row, column] of a file, with the first row at the top and the first column at the left."""
    if is_upright(file):
        return samples
    orientation = _orientation_of(file)
    samples = samples.swapaxes(-1, -2) if is_transposed(file) else samples
    samples = samples[..., ::-1] if orientation in (2, 3, 6, 7) else samples
    return np.ascontiguousarray(samples[..., ::-1, :] if orientation in (3, 4, 7, 8) else samples)


def calibration_of(file):
    """The coefficients of ImageJ's polynomial from stored samples to values, or None."""
    metadata = file.imagej_metadata if file.is_imagej else {}
    function = int(metadata.get("cf", _UNCALIBRATED))
    if function == _UNCALIBRATED:
        return None
    if function not in _POLYNOMIALS:
        raise ValueError(f"expected samples that are calibrated by a polynomial, got ImageJ's function {function}")
    coefficients = [float(metadata.get(f"c{power}", 0)) for power in range(_POLYNOMIALS[function])]
    if not np.isfinite(coefficients).all():
        raise ValueError(f"expected finite coefficients of the calibration of samples, got {coefficients}")
    return None if coefficients == [0, 1] else coefficients


def calibrated(samples, coefficients):
    """The values of stored samples: integers if these are only moved, and real numbers otherwise."""
    if coefficients is None:
        return samples
    move, *others = coefficients
    if samples.dtype.kind in "iu" and others == [1] and move.is_integer() and abs(move) < 2**31:
        limits = np.iinfo(samples.dtype)
        kinds = (kind for kind in (np.int8, np.int16, np.int32, np.int64) if np.iinfo(kind).min <= limits.min + move)
        kind = next(kind for kind in kinds if limits.max + move <= np.iinfo(kind).max)
        return (samples.astype(np.int64) + int(move)).astype(kind)
    values = np.polynomial.polynomial.polyval(samples.astype(np.float64), coefficients)
    return values.astype(np.float32 if samples.dtype.itemsize <= 2 else np.float64)
