"""The looks of surfaces: shadings and materials."""

from .materials import Material
from .shadings import AmbientOcclusion, Outline, Phong

__all__ = ["AmbientOcclusion", "Material", "Outline", "Phong"]
