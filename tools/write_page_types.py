"""Writes tests/page/messages.d.ts: the messages of isospline.viewer.from_page and to_page, as TypeScript types.

ESLint's and TypeScript's checks of the page know from it what the page may send, and what it receives.
"""

import dataclasses
import types
import typing
from pathlib import Path

from isospline.viewer.from_page import FROM_PAGE
from isospline.viewer.to_page import TO_PAGE

PAGE = Path(__file__).resolve().parents[1] / "tests" / "page" / "messages.d.ts"
#: Fields of any names, whose types are known.
KNOWN = {"Change.changes": "Partial<ViewState>", "ChangeObject.changes": "Partial<ObjectState>"}
NAMES = {float: "number", int: "number", str: "string", bool: "boolean", type(None): "null", typing.Any: "any"}


def type_of(hint):
    """The TypeScript type of a type in Python."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if hint in NAMES:
        return NAMES[hint]
    if origin in (types.UnionType, typing.Union):
        return " | ".join(map(type_of, arguments))
    if origin in (tuple, list):
        element = type_of(arguments[0])
        return f"({element})[]" if "|" in element else f"{element}[]"
    if origin is dict:
        return f"Record<{type_of(arguments[0])}, {type_of(arguments[1])}>"
    return hint.__name__


def records_in(hint):
    """The dataclasses in a type."""
    if dataclasses.is_dataclass(hint):
        yield hint
    for each in typing.get_args(hint):
        yield from records_in(each)


def interface(cls, is_sent):
    """The interface of a dataclass; fields with defaults may be left out of what the page sends."""
    lines = [f"  interface {cls.__name__} {{"]
    for each in dataclasses.fields(cls):
        has_default = (each.default, each.default_factory) != (dataclasses.MISSING,) * 2
        choices = getattr(each.metadata.get("check"), "options", None)
        known = KNOWN.get(f"{cls.__name__}.{each.name}")
        usual = " | ".join(f'"{one}"' for one in choices) if choices else type_of(typing.get_type_hints(cls)[each.name])
        lines.append(f"    {each.name}{'?' if is_sent and has_default else ''}: {known or usual};")
    return "\n".join([*lines, "  }"])


def written():
    """The text of the file."""
    found = {}

    def add(cls, is_sent=False):
        if cls not in found:
            found[cls] = is_sent
            for hint in typing.get_type_hints(cls).values():
                for record in records_in(hint):
                    add(record)

    for cls in FROM_PAGE.values():
        add(cls, is_sent=True)
    for cls in TO_PAGE.values():
        add(cls)
    parts = ["// Written by tools/write_page_types.py.", "declare namespace Viewer {"]
    parts += [interface(cls, is_sent) for cls, is_sent in found.items()]
    for name, messages, more in (("FromPage", FROM_PAGE, "; input?: number"), ("ToPage", TO_PAGE, "")):
        union = "".join(f'\n    | ({{type: "{kind}"{more}}} & {cls.__name__})' for kind, cls in messages.items())
        parts.append(f"  type {name} ={union};")
    return "\n".join([*parts, "}"]) + "\n"


if __name__ == "__main__":
    PAGE.write_text(written(), encoding="utf-8")
