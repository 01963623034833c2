"""Studio light: a soft key light, a fill light and an open sky, with shadows on a ground."""

from __future__ import annotations

import dataclasses
import math
import numbers
from collections.abc import Mapping
from copy import copy
from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .. import _core
from ..base.parameters import check_count, check_type, unit_vector
from ..base.signatures import explained_methods
from ..base.values import itself
from ..cameras import OrthographicCamera, PanoramicCamera
from ..color_rules import ColorByDepth
from ..color_rules.rule import _ColorRule
from ..lights import DirectionalLight
from ..looks import Material, Phong
from ..scene import Scene
from ..suggest.presentation import suggested_view
from .ground import diagonal, square_below, upright_axes
from .image import Image
from .materials import check_materials, names_in_shadings
from .soft_light import LEAST_RAYS, MARGIN, MOST_RAYS, Passes, SoftLight, hidden_from_plane, lit_surfaces, part_of

if TYPE_CHECKING:
    from ..base.types import Background

#: The fractions of the ground's light that come from the key light and from the sky, and that their shadows remove.
KEY_SHADOW, SKY_SHADOW = 0.38, 0.42
# The key light's diameter in degrees.
_ANGLE = 14.0
# The part of the sky that every surface sees in fast light. Faces turned away from the key light need it.
_OPEN = 0.65
# The ground's extent from the middle of the scene, in diagonals of the scene.
_GROUND_REACH = 2.5
# The parts of the time until layers and all surfaces are drawn.
_UNTIL_LAYERS, _UNTIL_GROUND = 0.1, 0.7

# What cuts that show values have in pictures of light: rules are not lit.
_BLACK = ColorByDepth([(0, 0, 0), (0, 0, 0)], limits=(0, 1))


@explained_methods
@dataclass(frozen=True)
class Studio:
    """Light as in a photographer's studio, for ``render(..., light=Studio())``.

    There is a key light with soft shadows over the viewer's left shoulder, a fill light from the right, and a uniform
    sky with ambient occlusion. A ground below the scene receives shadows; elsewhere it has the colour of the
    background, so that no horizon is visible. Surfaces are tone mapped by the neutral curve of `Image.tone_map`, which
    never reaches 1, so that no highlight is clipped.

    Colours and opacities are those of the objects.

    Parameters
    ----------
    key, fill, sky : float
        Brightness of the lights, at least 0: the light that each adds to a white surface facing it.
    ground : bool
        Whether there is a ground. It is left out if the eye is below it, and in panoramas.
    up : (3,) float, optional
        The direction away from the ground; by default what is nearest to the camera's upward direction, of (0, 0, 1),
        the one that `suggest_view` suggests for the scene and the opposites of both.
    light_samples : int
        Shadow rays to the key light, and rays to the sky, for each of the `samples` of a pixel, of which 4 count at
        least; 1 to 65536. No pixel casts more than about 1024 to each. Where light changes slowly, one pixel in four
        casts some.
    fast : bool
        Leaves out shadows, sky and ground; takes about a tenth of the time.
    material : Material, optional
        For objects that have no material of their own. By default, those without a colour have one of
        `isospline.colors.COLORS` each, by their places in the scene.
    materials : dict of object or geometry id to Material
        For these objects of the scene; replaces their own.

    Raises
    ------
    ValueError
        For numbers outside of these ranges, and an `up` of zero.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.torus()
    >>> volume = field.volume(32)
    >>> surface = isospline.Isosurface(volume, field.level, color="ivory")
    >>> isospline.render(surface, size=(32, 24), light=isospline.Studio(key=2.0), background="white")
    Image(32 x 24, 40% covered)
    """

    key: float = 1.5
    fill: float = 0.3
    sky: float = 0.45
    ground: bool = True
    up: tuple[float, float, float] | None = None
    light_samples: int = 1
    fast: bool = False
    _: KW_ONLY
    material: Material | None = None
    materials: Mapping[Any, Material] = field(default_factory=dict, hash=False)

    __copy__ = itself

    def __post_init__(self) -> None:
        for name in ("key", "fill", "sky"):
            value = getattr(self, name)
            is_number = isinstance(value, numbers.Real)
            if not is_number or not 0 <= value < math.inf:
                raise ValueError(f"{name}: expected a finite number of at least 0, got {value!r}")
        if self.up is not None:
            object.__setattr__(self, "up", tuple(unit_vector(self.up, "up").tolist()))
        check_count(self.light_samples, "light_samples", 65536)
        check_type(self.material, "material", (Material, type(None)), "a Material")
        object.__setattr__(self, "materials", check_materials(self.materials))

    def replace(self, **changes: Any) -> Studio:
        """The same light with some parameters changed."""
        return dataclasses.replace(self, **changes)


def render_in_studio(
    scene: Scene,
    camera: Any,
    light: Studio,
    *,
    background: Background,
    encoding: Literal["linear", "srgb8"],
    progress: Any,
    **options: Any,
) -> Image:
    """Render a scene in this light, whose materials are by geometry id."""
    _core.background_color(background)  # raises for a bad one
    light = light.replace(up=upward_for(scene, camera)) if light.up is None else light
    looks, values = _without_values(_looks(scene, light))
    lights = _Lights(light, camera)
    flat = {"layers": (), "ambient_occlusion_samples": 16}
    named = options["layers"]  # other types than tuples are refused by the first picture
    albedo = ("albedo",) if isinstance(named, tuple) and "albedo" in named else ()
    if light.fast:
        in_fast_light = {
            id: look.replace(lights=[lights.key, lights.fill], shadows=False, ambient=_OPEN * light.sky)
            for id, look in looks.items()
        }
        image = Image(
            _core.render(
                scene,
                camera,
                shading=in_fast_light,
                background=background,
                tone="neutral",
                encoding="linear" if values else encoding,
                progress=progress,
                **options,
            )
        )
        if values:
            alone = {**options, **flat, "layers": albedo, "progress": None}
            picture = _core.render(scene, camera, shading=values, background=None, encoding="linear", **alone)
            _add_values(image, Image(picture))
            if encoding == "srgb8":
                image._arrays.encode_srgb8()
        return image

    axes = upright_axes(np.asarray(light.up))
    extents = scene.extent(axes)
    radius = diagonal(extents) / 2 if np.isfinite(extents).all() else 0.0  # 0 without visible objects
    ground = None
    if light.ground and radius > 0 and _is_seen_from_above(camera, axes[2], extents[2, 0] + 1e-3 * radius):
        ground = square_below(axes, extents, _GROUND_REACH)
    samples, crop = options["samples"], options["crop"]

    def one_picture(shading, begin, end, **more):
        more = {**options, "progress": part_of(progress, begin, end), **more}
        return Image(_core.render_looks(scene, camera, shadings=[shading], **more)[0])

    layered, done = None, 0.0
    if crop is not None or named != ():
        layered, done = one_picture(looks, 0.0, _UNTIL_LAYERS, samples=1), _UNTIL_LAYERS
    wide, inner = _widened(crop, options["size"])
    passes = Passes(camera, {**options, "crop": wide}, progress, done)
    count = min(max(samples, LEAST_RAYS) * light.light_samples, MOST_RAYS)
    soft = SoftLight(lights.key, lights.fill, count, radius)
    until = 1.0 if ground is None else _UNTIL_GROUND
    lit = lit_surfaces(passes, soft, light.sky, scene, looks, samples, until)
    image = Image(lit._arrays.blank()) if layered is None else layered
    image._arrays.set_color(lit.color[inner])
    image._arrays.tone_map("neutral")
    if values:
        _add_values(image, one_picture(values, until, until, **{**flat, "layers": albedo}))

    shade = None
    if ground is not None:
        below = copy(scene)  # shares the objects; the given scene does not get the ground
        for id in below.ids:
            below.set_visibility(id, visible=False)
        on_ground = soft.on_plane(looks, below.add(ground, casts_shadow=False), lights.diffuse_of_white)
        weights = KEY_SHADOW if lights.diffuse_of_white else 0.0, SKY_SHADOW if light.sky else 0.0
        shade = hidden_from_plane(passes, below, on_ground, weights, lit, 1.0)[inner]
    image._arrays.lay_over(background, shade)
    if encoding == "srgb8":
        image._arrays.encode_srgb8()
    return image


def _widened(crop, size):
    """A crop with the pixels on which it depends, and where it is in these."""
    if crop is None:
        return None, (slice(None), slice(None))
    column, row, width, height = crop
    left, top = max(0, column - MARGIN), max(0, row - MARGIN)
    right, bottom = min(size[0], column + width + MARGIN), min(size[1], row + height + MARGIN)
    inner = slice(row - top, row - top + height), slice(column - left, column - left + width)
    return (left, top, right - left, bottom - top), inner


def upward_for(scene: Scene, camera: Any) -> tuple[float, float, float]:
    """The direction away from the ground: of z, the suggested one and their opposites, what the camera has above."""
    suggested = suggested_view(scene)
    ups = [(0.0, 0.0, 1.0)] if suggested is None else [(0.0, 0.0, 1.0), suggested.up]
    ups += [(-x, -y, -z) for x, y, z in ups]
    upward = camera.world_to_camera[1, :3]
    return max(ups, key=lambda up: round(float(upward @ up), 9))  # the first of those that are equally near


class _Lights:
    """The lights of a studio; they move with the camera."""

    def __init__(self, studio, camera):
        right, up, forward = camera.world_to_camera[:3, :3]
        gravity = np.asarray(studio.up)
        towards = 1.1 * right - 1.2 * up + 0.8 * forward
        self.key = DirectionalLight(towards, intensity=studio.key, angle=_ANGLE)
        self.fill = DirectionalLight(-right + 0.1 * up + 0.8 * forward, intensity=studio.fill)
        # The diffuse coefficient of a ground that is white where it receives all of the key light; 0 if it gets none.
        received = studio.key * max(0.0, -gravity @ towards / np.linalg.norm(towards))
        self.diffuse_of_white = 1 / received if received > 0 else 0.0


def _looks(scene, studio):
    """A Phong shading of each geometry id."""
    materials = {id: studio.materials.get(id, studio.material) for id in scene.ids} | dict(studio.materials)
    return {id: Phong() if each is None else phong_of(each) for id, each in materials.items()}


def phong_of(material: Material) -> Phong:
    """The Phong shading with the look of a material: half of `Material.specular` is Phong's default."""
    return Phong(specular=0.4 * material.specular)._taking(material, names_in_shadings(material))


def _without_values(looks):
    """The looks with black cuts in place of those that show values, and looks of these values alone; {} without any."""
    black = {id: look.replace(cap_color=_BLACK) for id, look in looks.items() if isinstance(look.cap_color, _ColorRule)}
    if not black:
        return looks, {}
    dark = {id: look.replace(lights=[], shadows=False, ambient=0) for id, look in looks.items()}
    return looks | black, dark


def _add_values(image, values):
    """Add the picture of the values on cuts, whose own colours are black so far."""
    image.color[..., :3] += values.color[..., :3]
    if hasattr(values, "albedo"):
        image.albedo[:] = values.albedo


def _is_seen_from_above(camera, up, height):
    """Whether a camera sees a horizontal plane at a height from above."""
    if isinstance(camera, PanoramicCamera):
        return False
    if isinstance(camera, OrthographicCamera):
        return camera.world_to_camera[2, :3] @ up <= -0.02
    return camera.eye @ up > height
