"""Tone mapping: maps light of any brightness to the range of displays."""

from .._core import tone_mapped

__all__ = ["CURVES", "tone_mapped"]

#: The curves of `Image.tone_map`, from linear light to 0 to 1.
CURVES = ("neutral", "aces", "linear")
