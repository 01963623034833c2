"""Tone mapping: maps light of any brightness to the range of displays."""

import numbers
from typing import Any

from ..base.parameters import check_type

#: The curves of `Image.tone_map`, from linear light to 0 to 1.
CURVES = ("neutral", "aces", "linear")


def check_exposure(exposure: Any) -> None:
    """Raise an error for what is no number of stops from -64 to 64."""
    check_type(exposure, "exposure", numbers.Real, "a number")
    if not -64 <= exposure <= 64:
        raise ValueError(f"exposure: expected stops from -64 to 64, got {exposure!r}")
