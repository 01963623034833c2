"""Signatures of compiled functions, and one-sentence errors for wrong arguments.

pybind11 puts a signature into the first line of a docstring. Its error for wrong arguments has all signatures and the
representation of all arguments, including arrays. Here a Python function is wrapped around every compiled function. It
has the signature for `inspect`, and its error names the wrong argument (see `mistakes`).
"""

from __future__ import annotations

import ast
import functools
import inspect
import math
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from .mistakes import sentence, wrong_call

if TYPE_CHECKING:
    from typing import TypeVar

    from typing_extensions import ParamSpec

    P = ParamSpec("P")
    R = TypeVar("R")
    T = TypeVar("T", bound=type)

# The beginning of pybind11's error, after the name of the function.
_MISFIT = "(): incompatible "


def attach(module):
    """Wrap all public functions, methods and setters of a compiled module, in place."""
    for name, value in list(vars(module).items()):
        if inspect.isclass(value) and value.__module__ == module.__name__:
            _attach_to_class(value, module)
        elif inspect.isbuiltin(value):
            setattr(module, name, _wrapped(value, name, module))


def attach_methods(owner, kind, **functions):
    """Make functions methods of a compiled class; `kind` wraps each."""
    for name, function in functions.items():
        function.__name__, function.__qualname__ = name, f"{owner.__name__}.{name}"
        setattr(owner, name, kind(function))


def _attach_to_class(owner, module):
    for name, value in list(vars(owner).items()):
        if isinstance(value, property):
            setter = value.fset and _checked_setter(value.fset, name)
            documented = _documented(owner.__doc__ or "").get(name)  # its description in the constructor
            doc = value.__doc__ or (documented and ": ".join(filter(None, documented)))
            setattr(owner, name, property(value.fget, setter, doc=doc))
        elif isinstance(value, staticmethod):
            setattr(owner, name, staticmethod(_wrapped(value.__func__, name, module, owner)))
        elif type(value).__name__ == "instancemethod" and (not name.startswith("_") or name == "__init__"):
            setattr(owner, name, _wrapped(value.__func__, name, module, owner))


def parameters_of(kind):
    """The names of the parameters of a compiled class's constructor."""
    return [name for name in kind.__init__.__signature__.parameters if name != "self"]


def explained(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate a Python function: calls that do not fit its signature get one sentence."""

    @functools.wraps(function)
    def call(*positional: P.args, **keywords: P.kwargs) -> R:
        try:
            return function(*positional, **keywords)
        except TypeError as error:
            if error.__traceback__ is None or error.__traceback__.tb_next is not None:
                raise  # by the function's own code
            message = _without_self(function, wrong_call, inspect.signature(function), positional, keywords)
            raise TypeError(message or str(error)) from None

    return call


def explained_methods(kind: T) -> T:
    """Decorate a Python class: the same for its public methods and its constructor."""
    for name, value in list(vars(kind).items()):
        if isinstance(value, classmethod):
            setattr(kind, name, classmethod(explained(value.__func__)))
        elif inspect.isfunction(value) and (not name.startswith("_") or name == "__init__"):
            setattr(kind, name, explained(value))
    return kind


def _without_self(function, explain, signature, positional, keywords):
    name = function.__qualname__
    if next(iter(signature.parameters), None) in ("self", "cls"):
        name = name.removesuffix(".__init__")
        signature = signature.replace(parameters=list(signature.parameters.values())[1:])
        positional = positional[1:]
    return explain(name, signature, positional, keywords)


def _wrapped(function, name, module, owner=None):
    first, _, rest = (function.__doc__ or "").partition("\n")
    definition = ast.parse(f"def {first.replace(name, '_', 1)}: pass").body[0]

    @functools.wraps(function, assigned=())
    def call(*positional, **keywords):
        try:
            return function(*positional, **keywords)
        except TypeError as error:
            if _MISFIT in str(error):
                explain = functools.partial(_misfit, definition=definition)
                error = _without_self(call, explain, signature, positional, keywords)
            positional = ()
            raise error from None
        except BaseException:
            positional = ()  # debuggers show the objects of a traceback, which must be complete
            raise

    del call.__wrapped__  # stubs and help() shall see this function's own signature
    call.__name__ = name
    call.__qualname__ = f"{owner.__name__}.{name}" if owner else name
    call.__module__ = module.__name__
    call.__doc__ = rest.lstrip("\n") or None
    doc = owner.__doc__ if name == "__init__" else call.__doc__
    signature = _signature(definition, vars(module), _documented(doc or ""))
    call.__signature__ = signature  # type: ignore[attr-defined]
    return call


def _checked_setter(setter, name):
    annotation = ast.parse("def _" + setter.__doc__.strip() + ": pass").body[0].args.args[1].annotation

    def set_value(self, value):
        try:
            setter(self, value)
        except TypeError as error:
            if _MISFIT not in str(error):
                raise
            raise TypeError(sentence(name, _phrase(annotation), value)) from None

    return set_value


def _documented(doc):
    """The parameters in a docstring: their types, with the shapes of arrays, and their descriptions."""
    section = re.search(r"^Parameters\n-+\n(.*?)(?:\n\n\w[^\n]*\n--|\Z)", doc, re.DOTALL | re.MULTILINE)
    text = f"{section.group(1)}\n" if section else ""
    items = re.findall(r"^(\w+(?:, \w+)*) : (.+)\n((?:    .*\n|\n)*)", text, re.MULTILINE)
    return {name: (kind, inspect.cleandoc(text)) for names, kind, text in items for name in names.split(", ")}


def _signature(definition, names, documented):
    """The signature for `inspect`, from pybind11's line as a definition."""
    given, parameters = definition.args, []
    known = {**names, "inf": math.inf, "nan": math.nan, "dtype": np.dtype}

    def add(argument, default, kind):
        value = inspect.Parameter.empty
        if default is not None:
            value = eval(compile(ast.Expression(default), "<signature>", "eval"), {}, known)
        annotation = inspect.Parameter.empty
        if argument.arg != "self" and argument.annotation is not None:
            annotation = _readable(argument.annotation)
            if annotation in ("object", "dict"):
                annotation, _ = documented.get(argument.arg, (annotation, ""))
        parameters.append(inspect.Parameter(argument.arg, kind, default=value, annotation=annotation))

    missing = len(given.args) - len(given.defaults)
    for argument, default in zip(given.args, [None] * missing + given.defaults):
        add(argument, default, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    if given.vararg is not None:
        parameters.append(inspect.Parameter("more", inspect.Parameter.VAR_POSITIONAL))  # pybind11's name is args
    for argument, default in zip(given.kwonlyargs, given.kw_defaults):
        add(argument, default, inspect.Parameter.KEYWORD_ONLY)
    return inspect.Signature(parameters, return_annotation=_readable(definition.returns))


def _readable(annotation):
    """The text of an annotation in readable form."""
    text = ast.unparse(annotation)
    for long, short in (
        ("typing.SupportsFloat | typing.SupportsIndex", "float"),
        ("typing.SupportsInt | typing.SupportsIndex", "int"),
        ("isospline._core.", ""),
        ("collections.abc.", ""),
        ("numpy.typing.", ""),
        ("typing.", ""),
        ("numpy.", "np."),
    ):
        text = text.replace(long, short)
    return text


def _misfit(name, signature, positional, keywords, definition):
    """The error for arguments that pybind11 did not accept."""
    message = wrong_call(name, signature, positional, keywords)
    if message:
        return TypeError(message)
    annotations = {each.arg: each.annotation for each in (*definition.args.args, *definition.args.kwonlyargs)}
    given = signature.bind(*positional, **keywords).arguments
    for parameter, value in given.items():
        none_fits = value is None and signature.parameters[parameter].default is None
        if not none_fits and not _fits(annotations[parameter], value):
            return TypeError(
                sentence(parameter, _phrase(annotations[parameter]), value, _lone_item(annotations[parameter], value))
            )
    for parameter, value in given.items():  # the remaining ones do not fit into the machine's integers
        if _phrase(annotations[parameter]) == _WHOLE_NUMBER and not 0 <= int(value) < 2**31:
            return ValueError(f"{parameter}: expected {_WHOLE_NUMBER} of 32 bits, got {value!r}")
    return TypeError(f"{name}: expected arguments {signature}, got others")


def _lone_item(annotation, value):
    """The list that was probably meant if a single item was given."""
    for option in _options(annotation):
        if _head(option) == "collections.abc.Sequence" and _fits(option.slice, value):
            return f"[{type(value).__name__}(...)]" if type(value).__module__ not in ("builtins",) else f"[{value!r}]"
    return None


_WHOLE_NUMBER = "a whole number"
# Pairs of types with one meaning.
_NUMBERS = {"typing.SupportsFloat": "a number", "typing.SupportsInt": _WHOLE_NUMBER}
_COUNTS = {2: "two", 3: "three", 4: "four"}


def _options(annotation):
    """The members of a union."""
    if isinstance(annotation, ast.BinOp):
        return [*_options(annotation.left), *_options(annotation.right)]
    return [annotation]


def _head(annotation):
    """The dotted name of a type, without brackets."""
    return ast.unparse(annotation.value if isinstance(annotation, ast.Subscript) else annotation)


def _class_of_ours(head):
    """The name of a compiled class, or of a class of values, which has no module in signatures; "" for other types."""
    module, _, name = head.rpartition(".")
    return name if module == "isospline._core" or (not module and name[0].isupper() and name != "None") else ""


def _items(annotation):
    return annotation.slice.elts if isinstance(annotation.slice, ast.Tuple) else [annotation.slice]


def _size(annotation):
    """For ``Annotated[Sequence[X], "FixedSize(2)"]``: X and 2."""
    sequence, size = _items(annotation)
    return _items(sequence)[0], int("".join(filter(str.isdigit, size.value)))


def _fits(annotation, value):
    return any(_fits_one(option, value) for option in _options(annotation))


def _fits_one(annotation, value):
    head = _head(annotation)
    if head == "None":
        return value is None
    if head in _NUMBERS:
        return _is_number(value, whole=head == "typing.SupportsInt")
    if head == "typing.SupportsIndex":  # part of a union with one of these, which checks it
        return False
    if head == "bool":
        return value is None or hasattr(type(value), "__bool__")
    if head == "typing.Annotated":
        item, size = _size(annotation)
        return _is_sequence(value) and len(value) == size and all(_fits(item, each) for each in value)
    if head == "collections.abc.Sequence":
        return _is_sequence(value) and all(_fits(_items(annotation)[0], each) for each in value)
    if head == "tuple" and isinstance(annotation, ast.Subscript):
        items = _items(annotation)
        return _is_sequence(value) and len(value) == len(items) and all(map(_fits, items, value))
    if head == "collections.abc.Mapping":
        key, item = _items(annotation)
        return hasattr(value, "items") and all(_fits(key, k) and _fits(item, v) for k, v in value.items())
    if head == "collections.abc.Iterable":
        return hasattr(type(value), "__iter__") or hasattr(type(value), "__getitem__")
    if head == "os.PathLike":
        return hasattr(type(value), "__fspath__")
    if name := _class_of_ours(head):
        return any(kind.__name__ == name for kind in type(value).__mro__)
    kinds: dict[str, Any] = {"str": (str, bytes), "bytes": bytes, "dict": dict}
    return isinstance(value, kinds.get(head, object))


def _is_number(value, whole):
    if isinstance(value, (str, bytes)) or (whole and isinstance(value, (float, np.floating))):
        return False
    try:
        (int if whole else float)(value)
    except (TypeError, ValueError, OverflowError):
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
    if head in _NUMBERS:
        return _NUMBERS[head]
    if head == "typing.Annotated":
        item, size = _size(annotation)
        return f"{_COUNTS[size]} {_phrase(item, plural=True)}s"
    if head == "collections.abc.Sequence":
        return f"a sequence of {_phrase(_items(annotation)[0], plural=True)}"
    if head == "tuple" and isinstance(annotation, ast.Subscript):
        items = _items(annotation)
        return f"{_COUNTS[len(items)]} {_phrase(items[0], plural=True)}s"
    if head == "collections.abc.Mapping":
        key, item = _items(annotation)
        return f"a dict of {_phrase(key, plural=True)} to {_phrase(item, plural=True)}"
    if name := _class_of_ours(head):
        return f"{'an' if name[0] in 'AEIO' else 'a'} {name}"
    return {
        "None": "None",
        "typing.SupportsIndex": None,
        "bool": "True or False",
        "str": "a str",
        "bytes": None,
        "dict": "a dict",
        "os.PathLike": "a path",
        "collections.abc.Iterable": "an iterable",
    }.get(head, f"a value of type {head}")
