"""Writes python/isospline/_core.pyi: what pybind11-stubgen finds in the compiled module, in short.

The public classes and functions have their types in Python. The stub says what the compiled module has, with those
types that its signatures tell: objects, and classes of the package that it knows by name, are Any. So are results of
public classes, which are those of the derived classes in Python, and words, which are Literal there.
"""

import argparse
import ast
import subprocess
import sys
import tempfile
from pathlib import Path

import isospline._core

REPOSITORY = Path(__file__).resolve().parent.parent
STUB = REPOSITORY / "python" / "isospline" / "_core.pyi"
HEAD = '''"""Types of the compiled module, written by `make stubs`."""

from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray
'''
LEFT_OUT = {"__reduce__", "__repr__"}
# Names of types that stay as they are; those of the module's own classes as well.
KNOWN = {"Any", "Iterator", "Mapping", "NDArray", "None", "PathLike", "Sequence"}
KNOWN |= {"bool", "bytes", "dict", "float", "int", "list", "str", "tuple"}
BASES = {"object", "Exception", "OSError", "RuntimeError", "ValueError"}
ITEMS = {"list": "list[Any]", "dict": "dict[str, Any]", "tuple": "tuple[Any, ...]", "Iterator": "Iterator[Any]"}
NUMBERS = {"SupportsFloat": "float", "SupportsInt": "int", "SupportsIndex": "int"}


def generated():
    """What pybind11-stubgen writes about the module alone, without the package."""
    module = Path(isospline._core.__file__)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / module.name).symlink_to(module)
        subprocess.run([sys.executable, "-m", "pybind11_stubgen", "_core", "-o", "."], cwd=folder, check=True)
        return ast.parse((Path(folder) / "_core.pyi").read_text(encoding="utf-8"))


def options_of(annotation):
    """The members of a union."""
    if isinstance(annotation, ast.BinOp):
        return [*options_of(annotation.left), *options_of(annotation.right)]
    return [annotation]


def typed(annotation, known):
    """The text of a type, without modules."""
    options = list(dict.fromkeys(typed_option(each, known) for each in options_of(annotation)))
    if "float" in options:
        options = [each for each in options if each != "int"]
    if "PathLike[str]" in options:
        options = [each for each in options if each != "bytes"]
    return "Any" if "Any" in options else " | ".join(options)


def typed_option(annotation, known):
    if isinstance(annotation, ast.Constant):
        return ast.unparse(annotation)
    if isinstance(annotation, ast.Subscript):
        head = ast.unparse(annotation.value).rpartition(".")[2]
        items = annotation.slice.elts if isinstance(annotation.slice, ast.Tuple) else [annotation.slice]
        if head == "Annotated" and isinstance(items[0], ast.Subscript):  # "FixedSize(2)": two items
            count = "".join(filter(str.isdigit, ast.unparse(items[1])))
            inner, is_list = typed(items[0].slice, known), ast.unparse(items[0].value) == "list"
            return f"list[{inner}]" if is_list else f"tuple[{', '.join([inner] * int(count))}]"
        if head == "Annotated":
            return "Any"
        if head == "PathLike":
            return "PathLike[str]"
        if head == "NDArray":
            number = ast.unparse(annotation.slice).rpartition(".")[2]
            return f"NDArray[np.{'bool_' if number == 'bool' else number}]"
        return f"{head}[{', '.join(typed(each, known) for each in items)}]" if head in known else "Any"
    name = ast.unparse(annotation).rpartition(".")[2]
    if name == "PathLike":
        return "PathLike[str]"
    if name == "ndarray":
        return "NDArray[Any]"
    name = NUMBERS.get(name, name)
    return ITEMS.get(name, name) if name in known else "Any"


def function_of(node, known, derived=frozenset()):
    """A function with short types; `derived` are the names of classes from which public ones are derived."""
    arguments = node.args
    if any(each.arg.startswith("arg") for each in arguments.args):  # without names
        arguments.posonlyargs, arguments.args = arguments.args, []
    for each in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs):
        if each.annotation is not None:
            each.annotation = ast.Name(typed(each.annotation, known))
    node.returns = ast.Name(typed(node.returns, known - derived))
    node.body = [ast.Expr(ast.Constant(...))]
    return node


def stub():
    """The text of the stub."""
    nodes = generated().body
    known = KNOWN | {node.name for node in nodes if isinstance(node, ast.ClassDef)}
    derived = {name for name in known - KNOWN if getattr(isospline._core, name).__subclasses__()}
    constants, classes, functions = [], [], []
    for node in nodes:
        if isinstance(node, ast.ClassDef):
            members = [each for each in node.body if isinstance(each, ast.FunctionDef) and each.name not in LEFT_OUT]
            hidden = derived | {"str"} if node.name in derived else derived
            body = [function_of(each, known, hidden) for each in members] or [ast.Expr(ast.Constant(...))]
            bases = [each for each in node.bases if ast.unparse(each) in BASES]
            classes.append(ast.ClassDef(node.name, bases, [], body, []))
        elif isinstance(node, ast.FunctionDef):
            functions.append(function_of(node, known, derived))
        elif isinstance(node, ast.AnnAssign) and node.target.id != "__all__":
            constants.append(f"{node.target.id}: {typed(node.annotation, known)}")
    found = {node.name for node in nodes if isinstance(node, ast.ClassDef)}
    for name, kind in vars(isospline._core).items():  # pybind11-stubgen leaves out exceptions with several bases
        if isinstance(kind, type) and issubclass(kind, Exception) and name not in found:
            bases = [ast.Name(each.__name__) for each in kind.__bases__]
            classes.append(ast.ClassDef(name, bases, [], [ast.Expr(ast.Constant(...))], []))
    tree = ast.Module([*classes, *functions], [])
    text = "\n".join([HEAD, *constants, ast.unparse(ast.fix_missing_locations(tree))])
    formatter = [sys.executable, "-m", "ruff", "format", "--stdin-filename", STUB, "-"]
    return subprocess.run(formatter, input=text, capture_output=True, encoding="utf-8", check=True).stdout


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("output", nargs="?", default=STUB, type=Path)
    parser.parse_args().output.write_text(stub(), encoding="utf-8")
