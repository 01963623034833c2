"""Messages of pages and of the viewer: records with the names of their types."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from .checked import field

if TYPE_CHECKING:
    from typing_extensions import dataclass_transform
else:

    def dataclass_transform(**_):
        return lambda function: function


Some = TypeVar("Some")


def kind_of(cls):
    """The type of a message: the name of its class in small letters."""
    return re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__).lower()


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def one_of(messages: dict[str, Any]) -> Callable[[type[Some]], type[Some]]:
    """A decorator that makes a frozen dataclass of a class, and adds it to messages, under its type."""

    def add(cls):
        messages[kind_of(cls)] = made = dataclass(frozen=True)(cls)
        return made

    return add
