"""What a picture shows at a hit, as a function that can be differentiated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..colors import srgb_to_linear
from ..lights import PositionalLight
from ..looks import Phong
from .gradients import across

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass
class Seen:
    """Points that rays hit, N of them, in the world."""

    t: NDArray[np.float64]
    normals: NDArray[np.float64]  # (N, 3), unit, outward
    rays: NDArray[np.float64]  # (N, 6)
    #: (N, 1): -1 where rays come from the inner side of the surface.
    sides: NDArray[np.float64]

    @property
    def positions(self):
        return self.rays[:, :3] + self.t[:, None] * self.rays[:, 3:]


@dataclass
class SeenGradients:
    """The gradients of a number by the t, the normals and the rays of points; None for zero."""

    t: Any = None
    normals: Any = None
    rays: Any = None


class Mask:
    """1 where there is a hit."""

    channels, needs_normals = 1, False

    def values(self, seen: Seen):
        return np.ones((len(seen.t), 1))

    def vjp(self, seen: Seen, by_values) -> SeenGradients:
        return SeenGradients()


@dataclass
class Depth:
    """The distance along the camera's viewing direction: t times a number that is the same for all rays of a film."""

    scale: float
    channels, needs_normals = 1, False

    def values(self, seen: Seen):
        return self.scale * seen.t[:, None]

    def vjp(self, seen: Seen, by_values) -> SeenGradients:
        return SeenGradients(t=self.scale * by_values[:, 0])


class Normals:
    """The unit outward normals."""

    channels, needs_normals = 3, True

    def values(self, seen: Seen):
        return seen.normals

    def vjp(self, seen: Seen, by_values) -> SeenGradients:
        return SeenGradients(normals=by_values)


class PhongShade:
    """Phong's formula for one color, as `render` computes it, for lights that do not move with the camera."""

    channels, needs_normals = 3, True

    def __init__(self, phong: Phong):
        if phong.shadows or phong.opacity != 1.0 or phong.silhouette_opacity is not None:
            raise ValueError(
                "channel: expected a Phong without shadows and opaque, got one with shadows or transparent"
            )
        if phong.lights is None:
            raise ValueError("channel: expected a Phong with lights: those of None move with the camera")
        if not isinstance(phong.color, np.ndarray) or phong.cap_color is not None:
            raise ValueError("channel: expected a Phong with one color")
        self.lights: list[Any] = list(phong.lights)
        self.phong, self.color = phong, srgb_to_linear(phong.color)

    def values(self, seen: Seen):
        phong = self.phong
        found = np.tile(phong.ambient * phong.ambient_light * self.color, (len(seen.t), 1))
        for light in self.lights:
            at = _Lit(phong, light, seen)
            strength = np.maximum(at.n_l, 0.0)[:, None] * phong.diffuse * self.color + at.highlight()[:, None]
            found += light.intensity * strength
        return found

    def vjp(self, seen: Seen, by_values) -> SeenGradients:
        by_n, by_v, by_x = (np.zeros((len(seen.t), 3)) for _ in range(3))
        for light in self.lights:
            at = _Lit(self.phong, light, seen)
            diffuse = self.phong.diffuse * (by_values @ (light.intensity * self.color)) * (at.n_l > 0.0)
            by_v_r = (by_values @ light.intensity) * at.highlight_slope()
            by_n_l, by_n_v, by_l_v = diffuse + 2.0 * by_v_r * at.n_v, 2.0 * by_v_r * at.n_l, -by_v_r
            by_n += by_n_l[:, None] * at.l + by_n_v[:, None] * at.v
            by_v += by_n_v[:, None] * at.n + by_l_v[:, None] * at.l
            by_x -= across(at.l, by_n_l[:, None] * at.n + by_l_v[:, None] * at.v) * at.nearness
        directions = seen.rays[:, 3:]
        to_viewer = _unit(-directions)
        by_directions = -across(to_viewer, by_v) / np.linalg.norm(directions, axis=1, keepdims=True)
        sides = _sides(self.phong, seen)
        by_rays = np.concatenate([by_x, by_directions + seen.t[:, None] * by_x], axis=1)
        return SeenGradients((by_x * directions).sum(axis=1), sides * by_n, by_rays)


class _Lit:
    """Points in one light: unit vectors n on the side that is seen, v to the viewer and l to the light."""

    def __init__(self, phong, light, seen):
        self.phong = phong
        self.v = _unit(-seen.rays[:, 3:])
        self.n = _sides(phong, seen) * seen.normals
        if isinstance(light, PositionalLight):
            offsets = light.position - seen.positions
            self.l, self.nearness = _unit(offsets), 1.0 / np.linalg.norm(offsets, axis=1, keepdims=True)
        else:
            self.l = np.broadcast_to(-_unit(light.direction), self.v.shape)
            self.nearness = 0.0
        self.n_l, self.n_v = (self.n * self.l).sum(axis=1), (self.n * self.v).sum(axis=1)
        self.v_r = 2.0 * self.n_l * self.n_v - (self.l * self.v).sum(axis=1)

    def highlight(self):
        shines = self.v_r > 0.0
        return self.phong.specular * np.where(
            shines, np.where(shines, self.v_r, 1.0) ** self.phong.specular_exponent, 0.0
        )

    def highlight_slope(self):
        shines, exponent = self.v_r > 0.0, self.phong.specular_exponent
        return (
            self.phong.specular * exponent * np.where(shines, np.where(shines, self.v_r, 1.0) ** (exponent - 1.0), 0.0)
        )


def _sides(phong, seen):
    """(N, 1): -1 where the side of the surface that is shaded is against the normal."""
    return seen.sides if phong.two_sided else 1.0


def _unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
