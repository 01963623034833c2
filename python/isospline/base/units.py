"""Units of length, by the names that volumes have for them."""

from __future__ import annotations

#: Picometres in each unit.
PICOMETRES = {
    **dict.fromkeys(("Å", "\N{ANGSTROM SIGN}", "angstrom", "angstroms"), 100),
    **dict.fromkeys(("nm", "nanometer", "nanometre", "nanometers", "nanometres"), 10**3),
    **dict.fromkeys(("µm", "\N{GREEK SMALL LETTER MU}m", "um", "micron", "microns"), 10**6),
    **dict.fromkeys(("micrometer", "micrometre", "micrometers", "micrometres"), 10**6),
    **dict.fromkeys(("mm", "millimeter", "millimetre", "millimeters", "millimetres"), 10**9),
    **dict.fromkeys(("cm", "centimeter", "centimetre", "centimeters", "centimetres"), 10**10),
    **dict.fromkeys(("m", "meter", "metre", "meters", "metres"), 10**12),
    **dict.fromkeys(("inch", "in", "inches"), 254 * 10**8),
    **dict.fromkeys(("ft", "foot", "feet"), 3048 * 10**8),
}


def ratio_of_units(unit: str, other: str) -> float | None:
    """How many of `other` one `unit` is: 1 if one of them is empty, and None if they differ and one is not known."""
    if unit == other or not (unit and other):
        return 1.0
    if unit not in PICOMETRES or other not in PICOMETRES:
        return None
    return PICOMETRES[unit] / PICOMETRES[other]
