"""What the compiled module calls: functions and classes that are handed to it when they are defined."""

from __future__ import annotations

from typing import TypeVar

from .. import _core

T = TypeVar("T")


def handed(named: T) -> T:
    """Decorate a function or a class: the compiled module knows it by its name."""
    _core._hand(named)
    return named
