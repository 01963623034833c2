"""Annotations in pictures: a scale bar, and bars of colour maps."""

from __future__ import annotations

import contextlib
import functools
import importlib.util
import math
import os
import re
import unicodedata
from collections.abc import Iterable, Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..base.parameters import check_type
from ..base.values import part
from ..cameras import PanoramicCamera
from ..color_rules import ColorByCurvature, ColorByDepth, ColorByDistance, ColorByThickness
from ..colors import linear_to_srgb, srgb_to_linear
from ..looks import Phong
from .image import Image
from .rules import depends_on_object, rules_of, without_object

Annotation = Literal["scale_bar", "colorbar"]
ANNOTATIONS = ("scale_bar", "colorbar")

# The free border, as a part of the picture.
BORDER = 0.04
# Linear colours of marks on bright and on dark background, and the luminance that separates both.
_DARK, _BRIGHT, _MIDDLE = 0.015, 1.0, 0.2
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

#: A rectangle of pixels: its first column and row, its width and its height.
Box = tuple[int, int, int, int]


def has_scale(camera: Any) -> bool:
    """Whether equal lengths at one depth have equal numbers of pixels; None is a camera that is made for the scene."""
    return not isinstance(camera, PanoramicCamera) and getattr(camera, "distortion", None) is None


def check_annotations(annotate: Any, camera: Any, look: Any, unit: str | None) -> tuple[str, ...]:
    """Check the names of marks before the work begins."""
    if isinstance(annotate, bool):
        applies = {"scale_bar": has_scale(camera), "colorbar": bool(color_rules(look))}
        annotate = [name for name in ANNOTATIONS if annotate and applies[name]]
    check_type(annotate, "annotate", Iterable, "True or a sequence of names")
    names = (annotate,) if isinstance(annotate, str) else tuple(annotate)
    for name in names:
        if name not in ANNOTATIONS:
            raise ValueError(f"annotate: expected some of {', '.join(ANNOTATIONS)}, got {name!r}")
    check_type(unit, "unit", (str, type(None)), "a str such as 'mm' or None")
    if "scale_bar" in names and not has_scale(camera):
        kind = "a panorama" if isinstance(camera, PanoramicCamera) else "a lens with distortion"
        raise ValueError(f"annotate: scale_bar cannot be combined with {kind}, which has no scale")
    if "colorbar" in names and not color_rules(look):
        raise ValueError("annotate: expected a colour rule with a map, such as ColorByVolume, for colorbar")
    return names


def color_bars(size: tuple[int, int], look: Any, scene: Any, camera: Any, unit: str) -> list[ColorBar]:
    """The colour bars of a picture, from left to right."""
    rules = color_rules(shown_looks(scene, look))
    return [ColorBar(size, rule, _limits(rule, scene, camera), unit) for rule in rules]


class Covered:
    """The pixels of a picture in which objects are; only those are traced that are asked for."""

    def __init__(self, scene: Any, camera: Any, size: tuple[int, int]):
        self._scene, self._camera, self._size = scene, camera, size
        self._counts: dict[Box, int] = {}

    def count(self, box: Box) -> int:
        """The number of covered pixels in a rectangle."""
        (left, top, wide, high), (width, height) = box, self._size
        left, right, top, bottom = max(0, left), min(width, left + wide), max(0, top), min(height, top + high)
        if left >= right or top >= bottom:
            return 0
        crop = left, top, right - left, bottom - top
        if crop not in self._counts:
            plain: dict[str, Any] = {"encoding": "linear", "progress": None, "background": None, "samples": 1}
            plain.update(layers=(), ambient_occlusion_samples=1, shading=Phong())
            image = Image(_core.render(self._scene, self._camera, size=self._size, crop=crop, **plain))
            self._counts[crop] = int(np.count_nonzero(image.color[..., 3] > 0))
        return self._counts[crop]


def overlap(first: Box, second: Box) -> bool:
    """Whether two rectangles have pixels in common."""
    return all(first[at] < second[at] + second[at + 2] and second[at] < first[at] + first[at + 2] for at in (0, 1))


def best_box(boxes: Iterable[Box], taken: Iterable[Box], covered: Covered) -> Box:
    """The first of the rectangles that hide least, of those without other marks if there are such."""
    taken = list(taken)
    return min(boxes, key=lambda box: (any(overlap(box, each) for each in taken), covered.count(box)))


def ticks(lower: float, upper: float, most: int = 6) -> list[float]:
    """At most `most` round numbers at equal steps between two numbers."""
    lower, upper = min(lower, upper), max(lower, upper)
    step = round_down((upper - lower) / (most - 1))
    while math.floor(upper / step + 1e-9) - math.ceil(lower / step - 1e-9) + 1 > most:
        step = round_down(step * 2.5)
    first, last = math.ceil(lower / step - 1e-9), math.floor(upper / step + 1e-9)
    digits = round(1 - math.log10(step))  # after the point: at least as many as the step has
    return sorted({round(number * step, digits) for number in range(first, last + 1)})


def labels_of(values: list[float]) -> list[str]:
    """Numbers as text, with six digits, or as many as any of them needs."""
    labels = [f"{value:g}" for value in values]
    if [float(label) for label in labels] == values:
        return labels
    return [str(value).removesuffix(".0") for value in values]


def round_down(value):
    """The largest number not above `value` that is 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(each * power for each in (1, 2, 5) if each * power <= value * (1 + 1e-9))


def shown_looks(scene: Any, look: Any) -> dict[int, Any]:
    """The looks of the visible objects of a scene by geometry id, in a light that is resolved; None if it decides."""
    if hasattr(look, "materials"):  # of path tracers and studios
        looks, others = look.materials, look.material
    else:
        looks, others = (look, Phong()) if isinstance(look, Mapping) else ({}, look)
    shown = [id for id, *_, visibility in scene._placed_objects() if visibility["visible"]]
    return {id: looks.get(id, others) for id in shown}


def color_rules(look):
    """The rules with a map that colour the surfaces, each once."""
    looks = list(look.values()) if isinstance(look, Mapping) else [look]
    if hasattr(look, "materials"):  # of path tracers and studios
        looks = [*look.materials.values(), look.material]
    rules = []
    for given in [rule for each in looks if each is not None for rule in rules_of(each).values()]:
        if hasattr(given, "cmap") and not depends_on_object(given):
            rule = without_object(given)
            if rule not in rules:
                rules.append(rule)
    return rules


def _limits(rule, scene, camera):
    """The values of a rule's first and last colour."""
    if rule.limits is not None:
        return rule.limits
    return _core._depth_range(camera, scene.bounds)


def _title(rule, unit):
    if isinstance(rule, ColorByCurvature):
        power = "^2" if rule.kind == "gaussian" else ""
        return f"{rule.kind} curvature" + (f" (1/{unit}{power})" if unit else "")
    if isinstance(rule, ColorByDepth):
        return "depth" + (f" ({unit})" if unit else "")
    if isinstance(rule, ColorByDistance) and not rule.label.strip():
        return ("signed distance" if rule.signed else "distance") + (f" ({unit})" if unit else "")
    if isinstance(rule, ColorByThickness) and not rule.label.strip():
        return "thickness" + (f" ({unit})" if unit else "")
    return rule.label.strip() or "value"


# What stands for characters that Pillow's font lacks, besides letters with accents.
_PLAIN = str.maketrans(
    {"−": "-", "²": "^2", "³": "^3", "µ": "u", "μ": "u", "ß": "ss", "ẞ": "SS"}
    | {"æ": "ae", "Æ": "AE", "œ": "oe", "Œ": "OE", "ø": "o", "Ø": "O", "ł": "l", "Ł": "L", "đ": "d", "Đ": "D"}
)
_ANGSTROM = re.compile(r"(?<!\w)[Å\N{ANGSTROM SIGN}](?!\w)")


def plain(text: str) -> str:
    """A text without characters that Pillow's font lacks, where others can stand for them: its letters are ASCII."""
    letters = unicodedata.normalize("NFD", _ANGSTROM.sub("angstrom", text).translate(_PLAIN))
    return "".join(each for each in letters if not unicodedata.combining(each))


def font_for(size):
    """The font of a picture of a size."""
    from PIL import ImageFont

    return ImageFont.load_default(max(10, round(min(size) / 30)))


def lettering(font: Any, text: str) -> tuple[str, Any]:
    """A text as it is drawn, and the font: DejaVu Sans for other letters than Latin ones, where it is installed."""
    letters = plain(text)
    wider = None if letters.isascii() else _dejavu(font.size)
    return (letters, font) if wider is None else (unicodedata.normalize("NFC", text), wider)


@functools.lru_cache(maxsize=8)
def _dejavu(size):
    """DejaVu Sans of the system or of matplotlib; None without both."""
    from PIL import ImageFont

    paths = ["DejaVuSans.ttf"]  # is sought among the fonts of the system
    package = importlib.util.find_spec("matplotlib")
    if package is not None and package.origin is not None:
        paths.append(os.path.join(os.path.dirname(package.origin), "mpl-data/fonts/ttf", paths[0]))
    for path in paths:
        with contextlib.suppress(OSError):
            return ImageFont.truetype(path, size)
    return None


def text_width(font: Any, text: str) -> float:
    """The length of a text in pixels."""
    letters, font = lettering(font, text)
    return float(font.getlength(letters))


def line_height(font: Any) -> float:
    """The distance of lines in pixels."""
    return float(font.getbbox("0")[3]) * 1.4


def draw_panel(image: Image, box: Box, covered: Covered | None) -> None:
    """Draw a panel behind marks that objects would make hard to read."""
    if covered is None or not covered.count(box):
        return
    left, top, wide, high = box
    area = np.s_[max(0, top) : top + high, max(0, left) : left + wide]
    behind = _linear(image, area)
    blend(image, area, np.full(behind.shape[:2], 0.85), np.full(3, _BRIGHT if _is_bright(behind) else _DARK))


def _is_bright(part):
    """Whether a part of an image is bright, over white."""
    return ((part[..., :3] + 1 - part[..., 3:]) @ _LUMINANCE).mean() > _MIDDLE


class ColorBar:
    """The bar of a colour map: its title above, and round values beside it."""

    def __init__(self, size, rule, limits, unit):
        self._size, self._limits, self._cmap = size, limits, np.asarray(part(rule, "cmap"))
        font = font_for(size)
        values = ticks(*limits)
        self._labels = list(zip(values, labels_of(values)))
        self._thickness, self._length = max(6, round(0.025 * size[0])), round(0.6 * size[1])
        self._mark = max(2, self._thickness // 4)
        labels = max((text_width(font, text) for _, text in self._labels), default=0)
        column = self._thickness + 2 * self._mark + labels
        words = _title(rule, unit).split()
        column = max(column, *(text_width(font, word) for word in words))
        self._lines = [words[0]]
        for word in words[1:]:
            longer = f"{self._lines[-1]} {word}"
            if text_width(font, longer) <= column:
                self._lines[-1] = longer
            else:
                self._lines.append(word)
        #: Of the bar with its labels and its title, in pixels.
        self.width = column + line_height(font)

    def draw(self, image: Image, left: float, covered: Covered | None = None) -> Box:
        """Draw it into an image, and return its rectangle; its first column is `left`."""
        width, height = self._size
        drawn = Drawing(image)
        thickness, length, left = self._thickness, self._length, round(left)
        top = min(round((height - length + (len(self._lines) - 1) * drawn.line_height) / 2), height - length)
        above = round((len(self._lines) + 0.5) * drawn.line_height)
        box = left - 4, top - above, round(self.width), length + above + above // 2
        draw_panel(image, box, covered)
        for number, line in enumerate(reversed(self._lines)):
            drawn.text(left, top - (0.5 + number) * drawn.line_height, line, "ls")
        drawn.bar(left - 1, left + thickness + 1, top - 1, top + length + 1)
        for value, text in self._labels:
            at = top + length * (1 - (value - self._limits[0]) / (self._limits[1] - self._limits[0]))
            row = min(max(round(at - 0.5), top), top + length - 1)
            drawn.bar(left + thickness, left + thickness + self._mark, row, row + 1)
            drawn.text(left + thickness + 2 * self._mark, at, text, "lm")
        drawn.finish()
        # The first colour is at the bottom.
        places = 1 - (np.arange(length) + 0.5) / length
        steps = np.linspace(0, 1, len(self._cmap))
        column = np.stack([np.interp(places, steps, part) for part in self._cmap.T], axis=-1)
        area = np.s_[top : top + length, max(left, 0) : left + thickness]
        blend(image, area, np.ones((height, width))[area], column[:, None])
        return box


class Drawing:
    """Text and bars in one colour, dark on a bright picture; with a bright rim where the picture is transparent."""

    def __init__(self, image):
        from PIL import Image as Pillow
        from PIL import ImageDraw

        self._image = image
        self._sheet = Pillow.new("L", image.size)
        self._draw = ImageDraw.Draw(self._sheet)
        self._font = font_for(image.size)
        self._bars = np.zeros(image.size[::-1])
        self.line_height = line_height(self._font)

    def text(self, x, y, text, anchor):
        """Draw text; `anchor` is Pillow's name of the point of the text at (x, y)."""
        letters, font = lettering(self._font, text)
        self._draw.text((x, y), letters, fill=255, font=font, anchor=anchor)

    def bar(self, left, right, top, bottom):
        """Draw a rectangle; pixels that it covers in part get that part."""
        height, width = self._bars.shape
        rows = np.clip(np.minimum(bottom, np.arange(height) + 1) - np.maximum(top, np.arange(height)), 0, 1)
        columns = np.clip(np.minimum(right, np.arange(width) + 1) - np.maximum(left, np.arange(width)), 0, 1)
        self._bars = np.maximum(self._bars, np.outer(rows, columns))

    def finish(self):
        """Blend everything that was drawn over the image."""
        from PIL import Image as Pillow
        from PIL import ImageFilter

        mask = np.maximum(np.asarray(self._sheet) / 255, self._bars)
        if not mask.any():
            return
        rows, columns = np.nonzero(mask.any(axis=1))[0], np.nonzero(mask.any(axis=0))[0]
        area = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        behind = _linear(self._image, area)
        bright = _is_bright(behind)
        if bright and behind[..., 3].mean() < 0.5:  # files of other formats may show it on black
            wide = 2 * max(1, round(min(self._image.size) / 300)) + 1
            rim = Pillow.fromarray(np.rint(255 * mask).astype(np.uint8)).filter(ImageFilter.MaxFilter(wide))
            blend(self._image, np.s_[:, :], np.asarray(rim) / 255, np.full(3, _BRIGHT))
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
