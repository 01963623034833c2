"""Rules for the colours of surfaces."""

from .of_objects import ColorByDistance, ColorByThickness, ColorByValue
from .of_points import ColorByCurvature, ColorByDepth, ColorByNormal, ColorByVolume, ridges_and_valleys

__all__ = [
    "ColorByCurvature",
    "ColorByDepth",
    "ColorByDistance",
    "ColorByNormal",
    "ColorByThickness",
    "ColorByValue",
    "ColorByVolume",
    "ridges_and_valleys",
]
