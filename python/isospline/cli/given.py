"""The options that were given, and the refusal of those that have no effect.

Options without a value of their own are None, False or empty unless they are given: what they mean then is told where
they are used. So `--degree 2` is not the same as nothing.
"""

from __future__ import annotations

import os
import re

#: The parameters of `Volume` with the same names.
MODEL = ("degree", "boundary", "filter", "smoothing")
#: The options of `read_volume` with the same names.
READING = ("spacing", "shape", "dtype", "offset", "name", "nan")
#: All options of a file with samples.
OF_FILES = (*READING, "big_endian")

#: The commands for one surface alone.
_OF_ONE_LEVEL = ("mesh", "compare")


def given(arguments, options):
    """The options that were given, by their names in the parsed arguments; commands may lack some of them."""
    values = {option: getattr(arguments, option, None) for option in options}
    return [option for option, value in values.items() if value is not None and value is not False and value != []]


def keywords(arguments, options):
    """The given options with their values, for a function that has defaults for the others."""
    return {option: getattr(arguments, option) for option in given(arguments, options)}


def flag(option):
    """An option as it is typed."""
    return f"--{option.replace('_', '-')}"


def refuse_without(arguments, options, needed, got=None):
    """Refuse options that need something; `got` is what was given instead."""
    for option in given(arguments, options):
        raise ValueError(f"{flag(option)}: expected {needed} with it, got {'none' if got is None else got}")


def refuse_with(arguments, options, what):
    """Refuse options that have no effect with something, such as "a store"."""
    for option in given(arguments, options):
        raise ValueError(f"{flag(option)}: expected none with {what}, got {getattr(arguments, option)}")


def refuse_several_levels(words):
    """Refuse several numbers after one `--level`, unless they are files: argparse would only tell the next word."""
    number = r"-?\.?\d[-+\d.eE]*"
    found = re.search(rf"\0(?:-l\0?|--level[\0=])({number}(?:\0{number})+)\0", "\0".join(["", *words, ""]))
    levels = found[1].split("\0") if found else []
    if all(os.path.exists(level) for level in levels[1:]):
        return
    instead = "" if words[0] in _OF_ONE_LEVEL else f"; more are told as {' '.join(f'-l {level}' for level in levels)}"
    raise ValueError(f"--level: expected one number, got {' '.join(levels)}{instead}")
