"""Names of other libraries, and what their users mean by them here: the table in foreign.toml."""

from __future__ import annotations

import functools
import re
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


@functools.cache
def tables() -> dict[str, dict[str, dict[str, str]]]:
    """The "names" of the module and its classes and the "keywords" of calls, with what is meant by each line.

    The keywords of "any" are those of all calls that have the parameter with which the meaning begins.
    """
    with open(Path(__file__).with_suffix(".toml"), "rb") as file:
        return tomllib.load(file)


def _meaning(kind: str, owner: str, name: str) -> str | None:
    lines = tables()[kind].get(owner, {})
    return next((meaning for names, meaning in lines.items() if name in names.split(", ")), None)


def meaning_of_name(owner: str, name: str, known: list[str]) -> str | None:
    """What is probably meant by an unknown name of the module or of a class."""
    public = [each for each in known if not each.startswith("_")]
    return _meaning("names", owner, name) or close_name(name, public)


def meaning_of_keyword(call: str, keyword: str, parameters: Iterable[str] = ()) -> str | None:
    """What is probably meant by an unknown keyword of a call, by its lines; given its parameters, by those of all."""
    if not parameters:
        return _meaning("keywords", call, keyword)
    meaning = _meaning("keywords", "any", keyword.lower())
    return meaning if meaning and parameter_of(meaning) in parameters else None


def parameter_of(meaning: str) -> str:
    """The parameter with which the meaning of a keyword begins."""
    return re.split(r"\W", meaning, maxsplit=1)[0]


def close_name(name: str, known: Iterable[str]) -> str | None:
    """The only known name of which a name is a misspelling, or None.

    That is, without underscores and the difference of capitals: the same letters, or one letter too many, too few,
    wrong, or in the place of its neighbour. The first letter is right, and in words of up to four letters none is
    wrong, as this would often make another word. Similar words, such as labels and largest, mean different things.
    """
    found = [each for each in known if _is_misspelling(_letters(name), _letters(each))]
    return found[0] if len(found) == 1 else None


def _letters(name: str) -> str:
    return name.lower().replace("_", "")


def _is_misspelling(name: str, right: str) -> bool:
    if name == right:
        return True
    if name[:1] != right[:1] or min(len(name), len(right)) < 4 or abs(len(name) - len(right)) > 1:
        return False
    place = next((i for i, (a, b) in enumerate(zip(name, right)) if a != b), min(len(name), len(right)))
    rest, right_rest = name[place:], right[place:]
    if len(name) != len(right):  # a letter too many or too few
        return rest[1:] == right_rest or rest == right_rest[1:]
    is_swapped = rest[:2] == right_rest[:2][::-1] and rest[2:] == right_rest[2:]
    return is_swapped or (rest[1:] == right_rest[1:] and len(name) > 4)


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
            place = "" if call == "any" else call
            theirs = ", ".join(f"{place}({name}=)" if place else f"{name}=" for name in names.split(", "))
            rows.append(f"| {theirs} | `{meaning}` |")
    return "\n".join(rows)
