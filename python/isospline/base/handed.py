"""What the compiled module and lower modules call: functions and classes that are handed over when they are defined."""

from __future__ import annotations

from typing import Any, TypeVar

from .. import _core

T = TypeVar("T")

_HANDED: dict[str, Any] = {}


def handed(named: T) -> T:
    """Decorate a function or a class: the compiled module and lower modules know it by its name."""
    _core._hand(named)
    _HANDED[named.__name__] = named  # type: ignore[attr-defined]
    return named


def known(name: str) -> Any:
    """The function or the class of a higher module with this name."""
    return _HANDED[name]


def is_handed(name: str) -> bool:
    """Whether something with this name was handed over."""
    return name in _HANDED


def family(base: str) -> list[str]:
    """The names of the classes that were handed over and are derived from a class."""
    classes = [each for each in _HANDED.values() if isinstance(each, type)]
    return [each.__name__ for each in classes if base in (kind.__name__ for kind in each.__mro__[1:])]
