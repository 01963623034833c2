"""The public classes of objects that the compiled module makes."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, TypeVar

from .. import _core
from ..base.handed import handed
from ..base.signatures import explained_methods

T = TypeVar("T", bound=type)


def public(kind: T) -> T:
    """Decorate a class that is derived from a compiled one: it is the class of all such objects from now on."""
    _core._derive(kind)
    compiled: Any = kind.__repr__

    def represent(self: Any) -> str:
        try:
            return compiled(self)
        except TypeError:  # debuggers show objects whose constructor has failed
            return f"<{type(self).__name__}, not initialized>"

    kind.__repr__ = represent  # type: ignore[assignment]
    return handed(explained_methods(kind))


def attributes_of(made: Any) -> dict[str, Any]:
    """The attributes of an object of a derived class, for pickles."""
    return dict(getattr(made, "__dict__", {}))


def from_state(kind: Any, state: dict[str, Any], attributes: Mapping[str, Any] = MappingProxyType({})) -> Any:
    """An object of a class, from a pickle."""
    made = kind.__new__(kind)
    made.__setstate__(state)
    return with_attributes(made, attributes)


def with_attributes(made: Any, attributes: Mapping[str, Any]) -> Any:
    """An object with the attributes of a derived class."""
    for name, value in attributes.items():
        setattr(made, name, value)
    return made
