"""What isosurfaces and meshes have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..base.shown import Shown

if TYPE_CHECKING:
    from ..base.types import GivenColor
    from ..looks import Material


class SceneObject(Shown):
    """The part of isosurfaces and meshes about their looks."""

    __slots__ = ()

    material: Material | None

    @property
    def color(self) -> GivenColor | None:
        """Its colour, sRGB, or a rule; None leaves it to the light."""
        return None if self.material is None else self.material.color

    @property
    def opacity(self) -> float:
        """From 0 to 1."""
        return 1.0 if self.material is None else self.material.opacity

    @property
    def name(self) -> str:
        """What legends call it; may be empty."""
        return "" if self.material is None else self.material.name
