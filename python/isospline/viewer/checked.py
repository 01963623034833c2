"""Immutable records with checked fields: data of pages and sessions become a record or one clear error."""

from __future__ import annotations

import dataclasses
import math
import numbers

from ..colors import hex_of, named_color


@dataclasses.dataclass(frozen=True)
class Checked:
    """A frozen dataclass with a check for each field, ``field(check, default)``; `replace` checks, too."""

    def __post_init__(self):
        for each in dataclasses.fields(self):
            object.__setattr__(self, each.name, each.metadata["check"](getattr(self, each.name), each.name))

    def to_json(self):
        """The record as numbers, strings, lists and dicts."""
        return {each.name: _to_json(getattr(self, each.name)) for each in dataclasses.fields(self)}

    @classmethod
    def from_json(cls, data, where):
        """The record of a dict; missing fields get their defaults."""
        if not isinstance(data, dict):
            raise ValueError(f"{where}: expected an object with named values, got {type(data).__name__}")
        fields = {each.name: each for each in dataclasses.fields(cls)}
        for name in data:
            if name not in fields:
                raise ValueError(f"{where}: expected one of {', '.join(fields)}, got {name!r}")
        none = dataclasses.MISSING
        needed = [name for name, each in fields.items() if each.default is none and each.default_factory is none]
        missing = [name for name in needed if name not in data]
        if missing:
            raise ValueError(f"{where}: expected {missing[0]}, got {', '.join(data) or 'nothing'}")
        return cls(**data)

    def replace(self, **changes):
        """The same record with some fields changed."""
        for name in changes:
            if name not in {each.name for each in dataclasses.fields(self)}:
                raise ValueError(f"{name}: expected one of {', '.join(self.to_json())}")
        return dataclasses.replace(self, **changes)


def field(check, default=dataclasses.MISSING):
    """A field with its check, a function of a value and its name that returns the value or raises."""
    return dataclasses.field(**_default(default), metadata={"check": check})


def _default(value):
    if isinstance(value, dict):
        return {"default_factory": value.copy}
    return {} if value is dataclasses.MISSING else {"default": value}


def number(least=-math.inf, most=math.inf):
    """A finite number within limits."""

    def check(value, name):
        real = isinstance(value, numbers.Real) and not isinstance(value, bool)
        if not (real and _is_finite(value) and least <= value <= most):
            limits = f" from {least:g} to {most:g}" if math.isfinite(least) and math.isfinite(most) else ""
            raise ValueError(f"{name}: expected a finite number{limits}, got {value!r}")
        return float(value)

    return check


def _is_finite(value):
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number larger than the largest float
        return False


def _kind(is_valid, expected):
    """A value that is valid, as the words say."""

    def check(value, name):
        if not is_valid(value):
            raise ValueError(f"{name}: expected {expected}, got {value!r}")
        return value

    return check


def _whole(least):
    def is_valid(value):
        return isinstance(value, int) and not isinstance(value, bool) and value >= least

    return _kind(is_valid, f"a whole number of at least {least}")


whole, count = _whole(0), _whole(1)
flag = _kind(lambda value: isinstance(value, bool), "true or false")
text = _kind(lambda value: isinstance(value, str), "text")


def choice(*options):
    """One of some strings."""

    def check(value, name):
        if value not in options:
            raise ValueError(f"{name}: expected one of {', '.join(options)}, got {value!r}")
        return value

    vars(check)["options"] = options  # for tools/write_page_types.py
    return check


def color(value, name):
    """A colour in the form of web pages, #rrggbb in sRGB; names of colours are converted."""
    if not isinstance(value, str):
        raise ValueError(f"{name}: expected the name of a colour or one such as #d8c3a5, got {value!r}")
    return hex_of(named_color(value, name))


def vector(count):
    """A fixed number of finite numbers."""

    def check(value, name):
        if not isinstance(value, (list, tuple)) or len(value) != count:
            raise ValueError(f"{name}: expected {count} numbers, got {value!r}")
        return tuple(number()(each, name) for each in value)

    return check


def interval(value, name):
    """Two finite numbers that differ."""
    first, last = vector(2)(value, name)
    if first == last:
        raise ValueError(f"{name}: expected two finite numbers that differ, got {first:g} and {last:g}")
    return first, last


def options(*names):
    """Some of the named values, such as keyword arguments."""

    def check(value, name):
        if not isinstance(value, dict):
            raise ValueError(f"{name}: expected an object with named values, got {type(value).__name__}")
        for key in value:
            if key not in names:
                raise ValueError(f"{name}: expected some of {', '.join(names)}, got {key!r}")
        return dict(value)

    return check


def optional(check):
    """A value that passes the check, or None."""
    return lambda value, name: None if value is None else check(value, name)


def record(cls):
    """A record of a class, or the dict of one."""
    return lambda value, name: value if isinstance(value, cls) else cls.from_json(value, name)


def records(cls):
    """Any number of records of a class."""

    def check(value, name):
        if not isinstance(value, (list, tuple)):
            raise ValueError(f"{name}: expected a list, got {type(value).__name__}")
        return tuple(record(cls)(each, f"{name}[{index}]") for index, each in enumerate(value))

    return check


def _to_json(value):
    if isinstance(value, Checked):
        return value.to_json()
    return [_to_json(each) for each in value] if isinstance(value, tuple) else value
