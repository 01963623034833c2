"""Types of the options of the command line."""

from __future__ import annotations

import argparse
import contextlib
import re

from ..base.views import VIEWS, light_from
from ..picture.environments import SUFFIXES
from ..picture.layers import LAYERS
from ..store.budget import parse_memory


def floats(text):
    """Numbers that are separated by commas."""
    return tuple(map(float, text.split(",")))


def numbers(*counts, instead=""):
    """A type of numbers that are separated by commas; `instead` names the alternative."""
    expected = f"{' or '.join(map(str, counts))} numbers separated by commas" + (instead and f" or {instead}")

    def parse(text):
        with contextlib.suppress(ValueError):
            numbers = floats(text)
            if len(numbers) in counts:
                return numbers
        raise argparse.ArgumentTypeError(f"expected {expected}, got {text!r}")

    return parse


def layers(text):
    """Names of layers, separated by commas."""
    names = tuple(text.split(","))
    unknown = [name for name in names if name not in LAYERS]
    if unknown:
        raise argparse.ArgumentTypeError(f"expected names among {', '.join(LAYERS)}, got {unknown[0]!r}")
    return names


def count(text):
    """A whole number from 1 on."""
    with contextlib.suppress(ValueError):
        if int(text) >= 1:
            return int(text)
    raise argparse.ArgumentTypeError(f"expected a whole number of at least 1, got {text!r}")


def memory(text):
    """A number of bytes, checked, as a text."""
    try:
        parse_memory(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error).removeprefix("memory_limit: ")) from None
    return text


def counts(text):
    """Three whole numbers."""
    match = re.fullmatch(r"(\d+)[x,](\d+)[x,](\d+)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"expected three counts such as 128,256,256, got {text!r}")
    return tuple(map(int, match.groups()))


def size(text):
    """A width and a height."""
    match = re.fullmatch(r"(\d+)[x,](\d+)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"expected a width and a height such as 640x480, got {text!r}")
    return tuple(map(int, match.groups()))


def view(text):
    """A side by its name, or a direction."""
    return text if re.fullmatch(r"[-+]?[a-z][a-z-]*", text) else numbers(3)(text)


def up(text):
    """An axis of the world, by name or three numbers."""
    return VIEWS[text][0] if re.fullmatch("[-+][xyz]", text) else numbers(3, instead="an axis, +x to -z")(text)


def lamp(text):
    """The direction in which light travels, from a side or in numbers, and an intensity."""
    return light_from(text) if text in VIEWS else numbers(3, 4, instead=f"one of {', '.join(VIEWS)}")(text)


def environment(text):
    """One number or three, or the name of a file."""
    return text if text.lower().endswith(SUFFIXES) else numbers(1, 3, instead="a file: .exr or .hdr")(text)


def dtype(text):
    """A type of samples, as text, which tells whether a byte order was given."""
    import numpy as np

    try:
        np.dtype(text)
    except TypeError:
        raise argparse.ArgumentTypeError(f"expected a type such as uint8, int16 or float32, got {text!r}") from None
    return text
