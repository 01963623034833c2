"""Measurements drawn into pictures, as the page draws them over its own: rulers, angles, balls and their results."""

from __future__ import annotations

import itertools

import numpy as np

from ..colors import named_color
from ..picture.annotations import Box, blend, font_for, line_height, overlap, plain, text_width
from ..scene.world_units import common_unit

_COLOR, _INK, _RIM = map(named_color, ("#c8553d", "#1f2933", "white"))
# The most pixels that are drawn at once.
_STRIP = 1 << 20


def draw_measurements(image, measurements, camera, unit):
    """Draw measurements into an image, and return it.

    Parameters
    ----------
    image : Image
    measurements : sequence of Measurement
    camera : camera of the picture
    unit : str
        Of lengths; "" if it is not known.
    """
    sheet = _Sheet(image, camera)
    boxes: list[Box] = []
    for each in measurements:
        sheet.lines(each)
    for count, each in enumerate(measurements, 1):
        if (place := sheet.label_place(each)) is not None:
            boxes.append(sheet.text(place, f"{count}{result_text(each, unit)}", boxes))
    return image


def length_unit(document, state):
    """The unit of the volumes of a state's objects, also of hidden ones; empty if it is not known of all."""
    sources = [document[each.source] for each in state.objects]
    return common_unit([source.unit for source in sources if source.is_volume])


def result_text(measurement, unit):
    """The text of a result, with four digits and its unit."""
    if measurement.result is None:
        return ": no other side" if measurement.tool == "thickness" else ""
    number = f"{float(f'{measurement.result:.4g}'):.15g}"
    return f": {number}" + ("°" if measurement.tool == "angle" else f" {unit}".rstrip())


class _Sheet:
    """Lines and texts over an image."""

    def __init__(self, image, camera):
        self._image, self._font = image, font_for(image.size)
        self._to_image = camera.world_to_ndc(image.size)
        self._up = camera.world_to_camera[1, :3]
        self._width = max(1.8, min(image.size) / 300)  # of lines

    def place(self, position):
        """Column and row of a point, or None if it is not in front of the camera."""
        x, y, _, w = self._to_image @ (*position, 1.0)
        return np.array([x, y]) / w * self._image.size if w > 0 else None

    def lines(self, measurement):
        places = [self.place(point.position) for point in measurement.points]
        for first, second in itertools.pairwise(places):
            if first is not None and second is not None:
                self._stroke(_segment(first, second), self._width)
        first = measurement.points[0]
        if measurement.tool == "thickness" and first.thickness is not None:
            middle = np.subtract(first.position, np.multiply(first.normal, first.thickness / 2))
            centre, above = self.place(middle), self.place(middle + self._up * first.thickness / 2)
            if centre is not None and above is not None:
                self._stroke(_circle(centre, np.linalg.norm(above - centre)), self._width)
        for place in places:
            if place is not None:
                self._stroke(_segment(place, place), 2 * self._width)

    def label_place(self, measurement):
        """Where the result is: at the corner of an angle, in the middle of a distance, or at the point."""
        places = [self.place(point.position) for point in measurement.points]
        if len(places) == 1 or any(each is None for each in places[:2]):
            return places[0]
        return places[1] if measurement.tool == "angle" else (places[0] + places[1]) / 2

    def _stroke(self, shape, width):
        """Draw a line of a width in pixels with a bright rim, by the distance of each pixel from it."""
        lower, upper, distance = shape
        reach = 2 * width + 2
        left, top = np.clip(np.floor(lower - reach), 0, self._image.size).astype(int).tolist()
        right, bottom = np.clip(np.ceil(upper + reach), 0, self._image.size).astype(int).tolist()
        if left == right:
            return
        step = max(1, _STRIP // (right - left))
        for row in range(top, bottom, step):
            area = np.s_[row : min(row + step, bottom), left:right]
            rows, columns = np.mgrid[area] + 0.5
            away = distance(np.stack([columns, rows], axis=-1))
            for half, color, opacity in ((width / 2 + 1, _RIM, 0.7), (width / 2, _COLOR, 1.0)):
                blend(self._image, area, opacity * np.clip(half + 0.5 - away, 0, 1), color)

    def text(self, place, text, others):
        """Draw a text beside a place and below others, and return its rectangle."""
        from PIL import Image as Pillow
        from PIL import ImageDraw

        high, wide = round(line_height(self._font)), round(text_width(self._font, text)) + 4
        left, top = round(place[0] + 3 * self._width), round(place[1] - 2 * self._width - high)
        while (other := next((each for each in others if overlap((left, top, wide, high), each)), None)) is not None:
            top = other[1] + high
        width, height = self._image.size
        first_row, last_row = max(0, top), min(height, top + high)
        first_column, last_column = max(0, left), min(width, left + wide)
        if first_row >= last_row or first_column >= last_column:  # it is beside the picture
            return left, top, wide, high
        for stroke, color in ((2, _RIM), (0, _INK)):
            sheet = Pillow.new("L", (wide, high))
            draw = ImageDraw.Draw(sheet)
            draw.text((2, high / 2), plain(text), fill=255, font=self._font, anchor="lm", stroke_width=stroke)
            mask = np.asarray(sheet)[first_row - top : last_row - top, first_column - left : last_column - left] / 255
            blend(self._image, np.s_[first_row:last_row, first_column:last_column], mask, color)
        return left, top, wide, high


def _segment(first, second):
    """The corners of the box of a segment, and the distance of points from it."""
    along = second - first
    squared = along @ along

    def distance(points):
        part = np.clip((points - first) @ along / squared, 0, 1) if squared else np.zeros(points.shape[:-1])
        return np.linalg.norm(points - first - part[..., None] * along, axis=-1)

    return np.minimum(first, second), np.maximum(first, second), distance


def _circle(middle, radius):
    def distance(points):
        return np.abs(np.linalg.norm(points - middle, axis=-1) - radius)

    return middle - radius, middle + radius, distance
