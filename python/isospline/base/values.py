"""Values: cameras, shadings, lights, materials, and cuts, which are equal if their parameters are.

They never change. `replace` makes a new one with changed parameters, and pickle stores the parameters.
Volumes, meshes, surfaces and scenes are compared by identity, and pickled whole.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from .handed import handed
from .parameters import vector_text

if TYPE_CHECKING:
    from typing_extensions import Self

# The parameters of the only compiled value.
_PATH_TRACER = ("material", "materials", "lights", "max_bounces", "seed")

_DATACLASSES: list[type] = []


def value_types() -> tuple[type, ...]:
    """All classes of values."""
    return (_core.PathTracer, *_DATACLASSES)


def parts(value):
    """The parameters of a value's constructor, with their values."""
    if dataclasses.is_dataclass(value):
        return {each.name: part(value, each.name) for each in dataclasses.fields(value)}
    return {name: getattr(value, name) for name in _PATH_TRACER}


def part(value, name):
    """A parameter of a value's constructor, exactly as it is kept."""
    exact = getattr(value, "_exact", {})
    return exact[name] if name in exact else getattr(value, name)


def same(one, other):
    """Whether two parts of values, results or states of objects are equal; NaN in arrays equals NaN."""
    if isinstance(one, dict):
        return isinstance(other, dict) and one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, (list, tuple)):
        return isinstance(other, (list, tuple)) and len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, np.ndarray):
        has_nan = one.dtype.kind in "fc"
        return isinstance(other, np.ndarray) and np.array_equal(one, other, equal_nan=has_nan)
    if isinstance(one, _core.Volume):
        return one is other or (isinstance(other, _core.Volume) and same(one.__getstate__(), other.__getstate__()))
    if isinstance(one, (_core.Scene, _core.Isosurface, _core.Mesh)):
        return one is other or (
            type(one) is type(other) and same(one.__reduce_ex__(2)[1:3], other.__reduce_ex__(2)[1:3])
        )
    return type(one) is type(other) and bool(one == other)


def _hashable(part):
    """Something small and hashable that is equal for equal parts."""
    if isinstance(part, np.ndarray):
        return part.shape if part.size > 16 else tuple(part.ravel().tolist())
    if isinstance(part, dict):
        return tuple(sorted(part))
    if isinstance(part, (list, tuple)):
        return tuple(_hashable(item) for item in part)
    if isinstance(part, _core.Volume):
        return part.shape, part.minimum, part.maximum
    if isinstance(part, _core.Isosurface):
        return _hashable(part.volume)
    if isinstance(part, _core.Scene):
        return tuple(part.ids)
    return part


def _make(kind, given):
    return kind(**given)


def itself(self, memo=None):
    """The copy of a value that never changes."""
    return self


class Value:
    """The base of classes of values: frozen dataclasses.

    Their constructors keep each parameter in one form, with `_keep`, which checks all of them. The compiled module
    knows these classes by their names. Those that begin with an underscore are bases. A dataclass that derives from one
    of them needs ``init=False``, and calls its constructor.
    """

    #: Parameters whose attributes have another form, exactly as they were given.
    _exact: Mapping[str, Any] = MappingProxyType({})

    def __init_subclass__(cls) -> None:
        cls.__replace__ = Value.__replace__  # type: ignore[method-assign]  # before `dataclass` sets its own
        is_ours = cls.__module__.partition(".")[0] == __name__.partition(".")[0]
        if is_ours and not cls.__name__.startswith("_"):
            _DATACLASSES.append(cls)
            handed(cls)

    def _keep(self, **fields: Any) -> None:
        for name, value in fields.items():
            # Of bytes, which nobody can make writeable again; nor can one those of the compiled module.
            if isinstance(value, np.ndarray) and (value.flags.writeable or isinstance(value.base, np.ndarray)):
                value = np.frombuffer(value.tobytes(), value.dtype).reshape(value.shape)
            object.__setattr__(self, name, value)
        self._check()

    def _check(self) -> None:
        """Raise an error if the parameters do not fit together."""

    def __repr__(self) -> str:
        shown: Any = dataclasses.fields(self)  # type: ignore[arg-type]
        text = ", ".join(f"{each.name}={text_of(getattr(self, each.name))}" for each in shown)
        return f"{type(self).__name__}({text})"

    def replace(self, **changes: Any) -> Self:
        """The same value with changed parameters: ``light.replace(radiance=2)``.

        So does `copy.replace` of Python 3.13. `dataclasses.replace` takes attributes for what was given, so that a
        focus stays at its distance in place of on the target.

        Parameters
        ----------
        **changes
            Parameters of the constructor.
        """
        return type(self)(**{**parts(self), **changes})

    def __replace__(self, **changes: Any) -> Self:
        return self.replace(**changes)

    def __eq__(self, other: object) -> Any:
        if type(other) is not type(self):
            return NotImplemented
        return same(parts(self), parts(other))

    def __hash__(self) -> int:
        return hash((type(self), *(_hashable(part) for part in parts(self).values())))

    def __reduce__(self) -> Any:
        return _make, (type(self), parts(self))

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: Any) -> Self:
        return self


def text_of(part: Any) -> str:
    """A part of a value in the text of its constructor's call."""
    if isinstance(part, np.ndarray):
        return vector_text(part) if part.ndim == 1 else f"array{part.shape}"
    if isinstance(part, tuple) and all(isinstance(each, float) for each in part):
        return vector_text(np.array(part))
    return f"{part:.12g}" if isinstance(part, float) else repr(part)


for _name in ("__eq__", "__hash__", "__reduce__", "__copy__", "__deepcopy__"):
    setattr(_core.PathTracer, _name, getattr(Value, _name))
