"""One-sentence errors for calls that do not fit a function's signature.

Python names a missing or an unknown argument, but not what was probably meant. Compiled functions say of wrong types
only that they are incompatible, with the representation of all arguments. `explained` looks at the signature of the
Python function that was called, and its error names the wrong argument (see `mistakes`).
"""

from __future__ import annotations

import ast
import functools
import inspect
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from .handed import family, is_handed, known
from .mistakes import described, sentence, wrong_call

if TYPE_CHECKING:
    from typing import TypeVar

    from typing_extensions import ParamSpec

    P = ParamSpec("P")
    R = TypeVar("R")
    T = TypeVar("T", bound=type)

# The beginning of pybind11's error, after the name of the function.
_MISFIT = "(): incompatible "


def explained(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate a Python function: calls that do not fit its signature get one sentence."""

    @functools.wraps(function)
    def call(*positional: P.args, **keywords: P.kwargs) -> R:
        try:
            return function(*positional, **keywords)
        except TypeError as error:
            has_begun = error.__traceback__ is None or error.__traceback__.tb_next is not None
            if has_begun and _MISFIT not in str(error):
                raise  # by the function's own code
            raise _explanation(call, positional, keywords, str(error)) from None

    return call


def methods_of(owner: str) -> Callable[[T], T]:
    """Decorate a base class with some methods of one class of its package: errors and `help` name that class."""
    return functools.partial(explained_methods, owner=owner)


def explained_methods(kind: T, owner: str | None = None) -> T:
    """Decorate a Python class: the same for its constructor, its public methods and its setters."""

    def named(name, function):
        method = explained(function)
        method.__name__, method.__qualname__ = name, f"{owner or kind.__name__}.{name}"
        if owner:
            method.__module__ = kind.__module__.rpartition(".")[0]
        if name == "__init__":
            method.__doc__ = method.__doc__ or ""  # otherwise `help` shows that of the compiled class
        return method

    for name, value in list(vars(kind).items()):
        if isinstance(value, classmethod):
            setattr(kind, name, classmethod(named(name, value.__func__)))
        elif isinstance(value, property) and value.fset is not None:
            setattr(kind, name, value.setter(named(name, value.fset)))
        elif inspect.isfunction(value) and (not name.startswith("_") or name == "__init__"):
            setattr(kind, name, named(name, value))
    return kind


def _explanation(function, positional, keywords, said):
    """The error for arguments that do not fit; `said` is what Python or pybind11 says of them."""
    name, signature = function.__qualname__, inspect.signature(function)
    if next(iter(signature.parameters), None) in ("self", "cls"):
        if positional:
            owner = positional[0] if isinstance(positional[0], type) else type(positional[0])
            if hasattr(owner, function.__name__):
                name = f"{owner.__name__}.{function.__name__}"
        name = name.removesuffix(".__init__")
        signature = signature.replace(parameters=list(signature.parameters.values())[1:])
        positional = positional[1:]
    message = wrong_call(name, signature, positional, keywords)
    if message or _MISFIT not in said:
        return TypeError(message or said)
    given = {
        parameter: (_parsed(signature.parameters[parameter].annotation), value)
        for parameter, value in signature.bind(*positional, **keywords).arguments.items()
        if signature.parameters[parameter].kind not in (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
    }
    for parameter, (annotation, value) in given.items():
        if not _fits(annotation, value):
            return TypeError(sentence(parameter, _phrase(annotation), value, _lone_item(annotation, value)))
    for parameter, (annotation, value) in given.items():  # the others do not fit into the machine's integers
        if value is not None and _WHOLE_NUMBER in _phrase(annotation) and not 0 <= int(value) < 2**31:
            bits = 32 if -(2**63) <= int(value) < 2**64 else 64
            return ValueError(f"{parameter}: expected {_WHOLE_NUMBER} of {bits} bits, got {described(value)}")
    return TypeError(f"{name}: expected arguments {signature}, got others")


def _parsed(annotation):
    """The annotation of a parameter, a text, as a tree."""
    return ast.parse(annotation if isinstance(annotation, str) else "Any", mode="eval").body


def _lone_item(annotation, value):
    """The list that was probably meant if a single item was given."""
    for option in _options(annotation):
        if _head(option) == "Sequence" and _fits(option.slice, value):
            return f"[{type(value).__name__}(...)]" if type(value).__module__ != "builtins" else f"[{value!r}]"
    return None


_WHOLE_NUMBER = "a whole number"
_COUNTS = {2: "two", 3: "three", 4: "four"}
_WORDS = {
    "None": "None",
    "bool": "True or False",
    "int": _WHOLE_NUMBER,
    "float": "a number",
    "str": "a str",
    "Literal": "a str",
    "bytes": None,
    "dict": "a dict",
    "PathLike": "a path",
    "Iterable": "an iterable",
}


def _options(annotation):
    """The members of a union; of a base whose name begins with an underscore, its classes."""
    if isinstance(annotation, ast.BinOp):
        return [*_options(annotation.left), *_options(annotation.right)]
    if isinstance(annotation, ast.Name) and annotation.id.startswith("_"):
        return [ast.Name(each) for each in family(annotation.id)] or [annotation]
    return [annotation]


def _head(annotation):
    """The name of a type, without brackets and modules."""
    named = annotation.value if isinstance(annotation, ast.Subscript) else annotation
    return ast.unparse(named).rpartition(".")[2]


def _items(annotation):
    return annotation.slice.elts if isinstance(annotation.slice, ast.Tuple) else [annotation.slice]


def _fits(annotation, value):
    return any(_fits_one(option, value) for option in _options(annotation))


def _fits_one(annotation, value):
    """Whether a value has a type; types without a rule here fit all values."""
    head, has_items = _head(annotation), isinstance(annotation, ast.Subscript)
    if head == "None":
        return value is None
    if head in ("int", "float"):
        return _is_number(value, whole=head == "int")
    if head == "bool":
        return value is None or (hasattr(type(value), "__bool__") and _converts(bool, value))
    if head == "Sequence":
        return _is_sequence(value) and all(_fits(_items(annotation)[0], each) for each in value)
    if head == "tuple" and has_items:
        items = _items(annotation)
        return _is_sequence(value) and len(value) == len(items) and all(map(_fits, items, value))
    if head == "Mapping":
        key, item = _items(annotation)
        return hasattr(value, "items") and all(_fits(key, k) and _fits(item, v) for k, v in value.items())
    if head == "Iterable":
        return hasattr(type(value), "__iter__") or hasattr(type(value), "__getitem__")
    if head == "PathLike":
        return hasattr(type(value), "__fspath__")
    if is_handed(head):
        return isinstance(value, known(head))
    if head in ("str", "Literal"):
        return isinstance(value, bytes) or (isinstance(value, str) and _converts(str.encode, value))
    kinds: dict[str, Any] = {"bytes": bytes, "dict": dict}
    return isinstance(value, kinds.get(head, object))


def _is_number(value, whole):
    if isinstance(value, (str, bytes)) or (whole and isinstance(value, (float, np.floating))):
        return False
    return _converts(int if whole else float, value)


def _converts(convert, value):
    """Whether a value can be converted."""
    try:
        convert(value)
    except Exception:  # of any code of the value's type
        return False
    return True


def _is_sequence(value):
    return hasattr(type(value), "__len__") and hasattr(type(value), "__iter__") and not isinstance(value, (str, bytes))


def _phrase(annotation, plural=False):
    """A type in words."""
    phrases: list[str] = []
    for option in _options(annotation):
        phrase = _phrase_one(option)
        if phrase not in (None, *phrases):
            phrases.append(phrase)
    if plural:
        phrases = [phrase.removeprefix("a ").removeprefix("an ") for phrase in phrases]
    return " or ".join([", ".join(phrases[:-1]), phrases[-1]] if len(phrases) > 1 else phrases)


def _phrase_one(annotation):
    head = _head(annotation)
    if head == "Sequence":
        return f"a sequence of {_phrase(_items(annotation)[0], plural=True)}"
    if head == "tuple" and isinstance(annotation, ast.Subscript):
        items = _items(annotation)
        return f"{_COUNTS[len(items)]} {_phrase(items[0], plural=True)}s"
    if head == "Mapping":
        key, item = _items(annotation)
        return f"a dict of {_phrase(key, plural=True)} to {_phrase(item, plural=True)}"
    if is_handed(head):
        return f"{'an' if head[0] in 'AEIO' else 'a'} {head}"
    return _WORDS.get(head)
