"""The public classes of objects that the compiled module makes."""

from __future__ import annotations

from typing import TypeVar

from .. import _core
from ..base.handed import handed
from ..base.signatures import explained_methods

T = TypeVar("T", bound=type)


def public(kind: T) -> T:
    """Decorate a class that is derived from a compiled one: it is the class of all such objects from now on."""
    _core._derive(kind)
    return handed(explained_methods(kind))
