"""Path tracing, as the light of pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from typing import TYPE_CHECKING, Any

from .. import _core
from ..base.signatures import explained_methods
from ..base.values import itself, parts, same
from ..looks import Material
from .environments import EnvironmentLight
from .materials import check_materials

if TYPE_CHECKING:
    from ..lights import _Light


@explained_methods
@dataclass(frozen=True, eq=False)
class PathTracer:
    """A Monte Carlo path tracer: soft shadows, reflections, and light between surfaces.

    The noise falls with the square root of the number of samples; `Image.variance` estimates the remaining noise.
    Random numbers are a function of pixel, sample and seed, so the picture is the same, bit for bit, for any number of
    threads. A single sample goes through the centre of its pixel and of the lens, so that colour, alpha and ids belong
    to one ray. With several samples, each goes through a random position. All surfaces are opaque.

    Parameters
    ----------
    material : Material
        For objects that have no material of their own, as ``Mesh(..., material=)`` and ``Isosurface(..., color=)``
        have.
    materials : dict of object or geometry id to Material
        For these objects of the scene; replaces their own.
    lights : sequence of lights, optional
        `PositionalLight` (whose intensity here falls off with the square of the distance), `DirectionalLight`
        (irradiance), `RectangleLight`, `SphereLight` and at most one `EnvironmentLight`; by default
        ``EnvironmentLight(1)``.
    max_bounces : int
        Number of hits at which a path scatters, at least 0.
    seed : int
        A whole number from 0 to 2^32 - 1. A different seed gives different noise.

    Raises
    ------
    ValueError
        For negative bounces, a seed out of range, and more than one environment. When rendering, for an object that the
        scene does not have.

    Examples
    --------
    >>> import isospline
    >>> lamp = isospline.SphereLight((3, -3, 5), 1.0, radiance=10)
    >>> light = isospline.PathTracer(lights=[lamp, isospline.EnvironmentLight(0.2)])
    >>> light.max_bounces
    16
    """

    material: Material = field(default_factory=Material)
    _: KW_ONLY
    materials: Mapping[Any, Material] = field(default_factory=dict)
    lights: Sequence[_Light | EnvironmentLight] | None = None
    max_bounces: int = 16
    seed: int = 0

    __copy__ = itself

    def __post_init__(self) -> None:
        object.__setattr__(self, "materials", check_materials(self.materials))
        compiled = self._compiled(dict(enumerate(self.materials.values())))
        object.__setattr__(self, "lights", compiled.lights if self.lights is None else list(self.lights))
        for name in ("max_bounces", "seed"):
            object.__setattr__(self, name, getattr(compiled, name))

    def _compiled(self, materials: dict[int, Material]) -> _core.PathTracer:
        options: dict[str, Any] = dict(lights=self.lights, max_bounces=self.max_bounces, seed=self.seed)
        return _core.PathTracer(self.material, materials=materials, **options)

    def replace(self, **changes: Any) -> PathTracer:
        """The same path tracer with some parameters changed."""
        return replace(self, **changes)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, PathTracer):
            return NotImplemented
        return same(parts(self), parts(other))

    def __hash__(self) -> int:
        return hash((self.material, len(self.materials), self.max_bounces, self.seed))
