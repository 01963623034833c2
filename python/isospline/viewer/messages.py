"""Messages of pages and of the viewer: records with the names of their types."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, TypeVar

Some = TypeVar("Some")


def kind_of(cls):
    """The type of a message: the name of its class in small letters."""
    return re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__).lower()


def one_of(messages: dict[str, Any]) -> Callable[[type[Some]], type[Some]]:
    """A decorator that adds a class to messages, under its type."""

    def add(cls):
        messages[kind_of(cls)] = cls
        return cls

    return add
