"""Names of other libraries, and what their users mean by them here: the table in foreign.toml."""

from __future__ import annotations

import difflib
import functools
import sys
from pathlib import Path
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


@functools.cache
def tables() -> dict[str, dict[str, dict[str, str]]]:
    """The "names" of the module and its classes and the "keywords" of calls, with what is meant by each line."""
    with open(Path(__file__).with_suffix(".toml"), "rb") as file:
        return tomllib.load(file)


def _meaning(kind: str, owner: str, name: str) -> str | None:
    lines = tables()[kind].get(owner, {})
    return next((meaning for names, meaning in lines.items() if name in names.split(", ")), None)


def meaning_of_name(owner: str, name: str, known: list[str]) -> str | None:
    """What is probably meant by an unknown name of the module or of a class."""
    meant = _meaning("names", owner, name)
    if meant is None:
        close = difflib.get_close_matches(name, [each for each in known if not each.startswith("_")], 1, 0.75)
        meant = close[0] if close else None
    return meant


def meaning_of_keyword(call: str, keyword: str) -> str | None:
    """What is probably meant by an unknown keyword of a call."""
    return _meaning("keywords", call, keyword)


def unknown_name(owner: str, name: str, known: list[str], is_module: bool = False) -> AttributeError:
    """The error for an unknown name."""
    meant = None if name.startswith("_") else meaning_of_name(owner, name, known)
    what = f"module {owner!r}" if is_module else f"{owner!r} object"
    return AttributeError(f"{what} has no attribute {name!r}" + (f"; did you mean {meant}?" if meant else ""))


def answer(*classes: type) -> None:
    """Make classes answer unknown names."""

    def missing(self: Any, name: str) -> Any:
        if hasattr(type(self), name):  # a property, whose own error it was
            return object.__getattribute__(self, name)
        raise unknown_name(type(self).__name__, name, dir(type(self)))

    for each in classes:
        each.__getattr__ = missing  # type: ignore[attr-defined]


def table_of_names() -> str:
    """The table of docs/migration.md; docs/names.py writes it there."""
    rows = ["| Elsewhere | isospline |", "|---|---|"]
    for owner, table in tables()["names"].items():
        for names, meaning in table.items():
            prefix = "" if owner == "isospline" else f"{owner}."
            theirs = ", ".join(f"{prefix}{name}" for name in names.split(", "))
            rows.append(f"| {theirs} | `{meaning}` |")
    for call, table in tables()["keywords"].items():
        for names, meaning in table.items():
            theirs = ", ".join(f"{call}({name}=)" for name in names.split(", "))
            rows.append(f"| {theirs} | `{meaning}` |")
    return "\n".join(rows)
