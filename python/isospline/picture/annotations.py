"""Annotations in pictures: a scale bar, and bars of colour maps."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..base.parameters import check_type
from ..colors import linear_to_srgb, srgb_to_linear
from .image import Image

Annotation = Literal["scale_bar", "colorbar"]
ANNOTATIONS = ("scale_bar", "colorbar")

# Fractions of the picture: the free border, and the largest length of a scale bar.
BORDER, _LONGEST = 0.04, 0.25
# Linear colours of marks on bright and on dark background, and the luminance that separates both.
_DARK, _BRIGHT, _MIDDLE = 0.015, 1.0, 0.2


def check_annotations(annotate: Any, camera: Any, look: Any, unit: str | None) -> tuple[str, ...]:
    """Check the names of marks before the work begins."""
    if isinstance(annotate, bool):
        has_scale = not isinstance(camera, _core.PanoramicCamera)
        applies = {"scale_bar": has_scale, "colorbar": bool(color_rules(look))}
        annotate = [name for name in ANNOTATIONS if annotate and applies[name]]
    check_type(annotate, "annotate", Iterable, "True or a sequence of names")
    names = (annotate,) if isinstance(annotate, str) else tuple(annotate)
    for name in names:
        if name not in ANNOTATIONS:
            raise ValueError(f"annotate: expected some of {', '.join(ANNOTATIONS)}, got {name!r}")
    check_type(unit, "unit", (str, type(None)), "a str such as 'mm' or None")
    if "scale_bar" in names and isinstance(camera, _core.PanoramicCamera):
        raise ValueError("annotate: scale_bar cannot be combined with a panorama, which has no scale")
    if "colorbar" in names and not color_rules(look):
        raise ValueError("annotate: expected a colour rule with a map, such as ColorByVolume, for colorbar")
    return names


def annotated(image: Image, names: tuple[str, ...], camera: Any, scene: Any, look: Any, unit: str) -> Image:
    """The image, with marks drawn into its colour."""
    if "scale_bar" in names:
        _draw_scale_bar(image, camera, unit)
    if "colorbar" in names:
        place = image.size[0] * (1 - BORDER)
        for rule in reversed(color_rules(look)):
            place = _draw_colorbar(image, place, rule, _limits(rule, scene, camera), unit)
    return image


def scale_bar(camera: Any, size: tuple[int, int]) -> tuple[float, float]:
    """The length of a scale bar in world units, 1, 2 or 5 times a power of ten, and in pixels at the target."""
    if isinstance(camera, _core.ProjectionPlaneCamera):
        target = camera.corner + (camera.right + camera.down) / 2
    else:
        target = camera.target
    ndc = camera.world_to_ndc(size)
    right = camera.world_to_camera[0, :3]

    def column(point):
        whole = ndc @ [*point, 1]
        return whole[0] / whole[3] * size[0]

    # In the plane through the target, equal lengths have equal numbers of pixels.
    step = 1e-3 * np.linalg.norm(np.asarray(camera.eye) - target)
    pixels_per_unit = (column(target + step * right) - column(target - step * right)) / (2 * step)
    length = _round_down(_LONGEST * size[0] / pixels_per_unit)
    return length, length * pixels_per_unit


def ticks(lower: float, upper: float, most: int = 6) -> list[float]:
    """At most `most` round numbers at equal steps between two numbers."""
    lower, upper = min(lower, upper), max(lower, upper)
    step = _round_down((upper - lower) / (most - 1))
    while math.floor(upper / step + 1e-9) - math.ceil(lower / step - 1e-9) + 1 > most:
        step = _round_down(step * 2.5)
    first, last = math.ceil(lower / step - 1e-9), math.floor(upper / step + 1e-9)
    return [round(number * step, 12) for number in range(first, last + 1)]


def _round_down(value):
    """The largest number not above `value` that is 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(each * power for each in (1, 2, 5) if each * power <= value * (1 + 1e-9))


def color_rules(look):
    """The rules with a map that colour the surfaces, each once."""
    looks = list(look.values()) if isinstance(look, Mapping) else [look]
    if hasattr(look, "materials"):  # of path tracers and studios
        looks = [*look.materials.values(), look.material]
    names = ("color", "surface_color", "cap_color")
    colors = [getattr(each, name, None) for each in looks for name in names]
    rules = []
    for color in colors:
        if isinstance(color, (_core.ColorByVolume, _core.ColorByCurvature, _core.ColorByDepth)) and color not in rules:
            rules.append(color)
    return rules


def _limits(rule, scene, camera):
    """The values of a rule's first and last colour."""
    if rule.limits is not None:
        return rule.limits
    corners = np.stack(np.meshgrid(*np.transpose(scene.bounds)), axis=-1).reshape(-1, 3)
    depths = corners @ camera.world_to_camera[2, :3] + camera.world_to_camera[2, 3]
    return float(depths.min()), float(depths.max())


def _title(rule, unit):
    if isinstance(rule, _core.ColorByCurvature):
        power = "^2" if rule.kind == "gaussian" else ""
        return f"{rule.kind} curvature" + (f" (1/{unit}{power})" if unit else "")
    if isinstance(rule, _core.ColorByDepth):
        return "depth" + (f" ({unit})" if unit else "")
    return "value"


# What stands for characters that Pillow's font lacks.
_PLAIN = str.maketrans({"−": "-", "²": "^2", "³": "^3", "µ": "u", "μ": "u"})


def font_for(image):
    from PIL import ImageFont

    return ImageFont.load_default(max(10, round(min(image.size) / 30)))


def _draw_scale_bar(image, camera, unit):
    width, height = image.size
    length, pixels = scale_bar(camera, image.size)
    border, thickness = round(BORDER * min(width, height)), max(2, round(height / 160))
    text = f"{length:g} {unit}".strip()
    drawn = Drawing(image)
    drawn.text(border + pixels / 2, height - border - 1.8 * thickness, text, "ms")
    drawn.bar(border, border + pixels, height - border - thickness, height - border)
    drawn.finish()


def _draw_colorbar(image, right, rule, limits, unit):
    """Draw a colour bar whose labels end at a column; returns the column at which it begins."""
    width, height = image.size
    drawn = Drawing(image)
    labels = [(value, f"{value:g}") for value in ticks(*limits)]
    thickness, length = max(6, round(0.025 * width)), round(0.6 * height)
    mark = max(2, thickness // 4)
    text_width = max((drawn.width(text) for _, text in labels), default=0)
    title = _title(rule, unit)
    left = round(right - max(thickness + 2 * mark + text_width, drawn.width(title)))
    top = round((height - length) / 2)
    drawn.text(left, top - drawn.line_height / 2, title, "ls")
    drawn.bar(left - 1, left + thickness + 1, top - 1, top + length + 1)
    for value, text in labels:
        at = top + length * (1 - (value - limits[0]) / (limits[1] - limits[0]))
        row = min(max(round(at - 0.5), top), top + length - 1)
        drawn.bar(left + thickness, left + thickness + mark, row, row + 1)
        drawn.text(left + thickness + 2 * mark, at, text, "lm")
    drawn.finish()
    # The first colour is at the bottom.
    places = 1 - (np.arange(length) + 0.5) / length
    colors = np.asarray(rule._cmap())
    steps = np.linspace(0, 1, len(colors))
    column = np.stack([np.interp(places, steps, part) for part in colors.T], axis=-1)
    area = np.s_[top : top + length, max(left, 0) : left + thickness]
    blend(image, area, np.ones((height, width))[area], column[:, None])
    return left - drawn.line_height


class Drawing:
    """Text and bars in one colour, dark on a bright picture."""

    def __init__(self, image):
        from PIL import Image as Pillow
        from PIL import ImageDraw

        self._image = image
        self._sheet = Pillow.new("L", image.size)
        self._draw = ImageDraw.Draw(self._sheet)
        self._font = font_for(image)
        self._bars = np.zeros(image.size[::-1])
        self.line_height = self._font.getbbox("0")[3] * 1.4

    def width(self, text):
        return self._font.getlength(text.translate(_PLAIN))

    def text(self, x, y, text, anchor):
        """Draw text; `anchor` is Pillow's name of the point of the text at (x, y)."""
        self._draw.text((x, y), text.translate(_PLAIN), fill=255, font=self._font, anchor=anchor)

    def bar(self, left, right, top, bottom):
        """Draw a rectangle; pixels that it covers in part get that part."""
        height, width = self._bars.shape
        rows = np.clip(np.minimum(bottom, np.arange(height) + 1) - np.maximum(top, np.arange(height)), 0, 1)
        columns = np.clip(np.minimum(right, np.arange(width) + 1) - np.maximum(left, np.arange(width)), 0, 1)
        self._bars = np.maximum(self._bars, np.outer(rows, columns))

    def finish(self):
        mask = np.maximum(np.asarray(self._sheet) / 255, self._bars)
        if not mask.any():
            return
        rows, columns = np.nonzero(mask.any(axis=1))[0], np.nonzero(mask.any(axis=0))[0]
        area = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        behind = _linear(self._image, area)
        over_white = behind[..., :3] + 1 - behind[..., 3:]
        bright = (over_white @ [0.2126, 0.7152, 0.0722]).mean() > _MIDDLE
        blend(self._image, area, mask[area], np.full(3, _DARK if bright else _BRIGHT))


def _linear(image, area) -> NDArray[np.float64]:
    """Premultiplied linear colour and alpha of a part of an image."""
    if image._arrays.color is not None:
        return image.color[area].astype(float)
    encoded = image.to_srgb()[area] / 255
    return np.concatenate([srgb_to_linear(encoded[..., :3]) * encoded[..., 3:], encoded[..., 3:]], axis=-1)


def blend(image, area, mask, color):
    """Blend a colour over a part of an image, in place, by a mask."""
    before, mask = _linear(image, area), mask[..., None]
    ink = np.concatenate([np.broadcast_to(color, (*mask.shape[:2], 3)), np.ones(mask.shape)], axis=-1)
    after = before * (1 - mask) + ink * mask
    if image._arrays.color is not None:
        image.color[area] = after
        return
    srgb = linear_to_srgb(after[..., :3] / np.maximum(after[..., 3:], 1e-6))
    image.to_srgb()[area] = np.rint(255 * np.concatenate([srgb, after[..., 3:]], axis=-1))
