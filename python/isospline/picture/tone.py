"""Tone mapping: maps light of any brightness to the range of displays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

#: The curves of `Image.tone_map`, from linear light to 0 to 1.
CURVES = ("neutral", "aces", "linear")


def tone_mapped(color: NDArray[Any], curve: str) -> NDArray[np.float64]:
    """Linear colours (..., 3) after a curve of `CURVES`."""
    color = np.asarray(color, dtype=float)
    if curve == "linear":
        return np.minimum(color, 1)
    if curve == "aces":
        return np.clip(color * (2.51 * color + 0.03) / (color * (2.43 * color + 0.59) + 0.14), 0, 1)
    return _neutral(color)


def _neutral(color):
    """Khronos PBR neutral, as in its specification (2024): it keeps hues and colours of surfaces."""
    begin, desaturation = 0.8 - 0.04, 0.15
    least = color.min(axis=-1, keepdims=True)
    color = color - np.where(least < 0.08, least - 6.25 * least * least, 0.04)
    peak = color.max(axis=-1, keepdims=True)
    above = peak >= begin
    beyond = np.where(above, peak - begin, 0)
    span = 1 - begin
    compressed = 1 - span * span / (beyond + span)
    scaled = color * compressed / np.where(above, peak, 1)
    gray = 1 - 1 / (desaturation * np.where(above, peak - compressed, 0) + 1)
    return np.where(above, scaled + gray * (compressed - scaled), color)
