"""Warnings that name the line of the user's code."""

from __future__ import annotations

import sys
import warnings


def warn(message: str) -> None:
    """Warn the user, at the line that called this package; compiled functions warn in this way, too."""
    frame = sys._getframe(1)
    level = 2
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == __package__:
        frame = frame.f_back
        level += 1
    warnings.warn(message, UserWarning, stacklevel=level)
