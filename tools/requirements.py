"""Prints packages that pyproject.toml requires: for the build, or for the package with the extras that are given."""

import re
import sys
from pathlib import Path

try:
    import tomllib
except ImportError:  # before Python 3.11
    from pip._vendor import tomli as tomllib

PROJECT = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))


def of_extra(name):
    """The requirements of an extra, which may name other extras of the package."""
    for requirement in PROJECT["project"]["optional-dependencies"][name]:
        others = re.fullmatch(r"isospline\[(.*)\]", requirement)
        if others:
            yield from (each for other in others[1].split(",") for each in of_extra(other.strip()))
        else:
            yield requirement


extras = sys.argv[1:]
wanted = PROJECT["project"]["dependencies"] if extras else PROJECT["build-system"]["requires"]
print(*wanted, *(each for name in extras for each in of_extra(name)), sep="\n")
