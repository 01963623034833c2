"""What all rules for colours have."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..base.mistakes import sentence
from ..base.parameters import number
from ..base.values import Value
from ..colors import color_map, encoded, linear


class _ColorRule(Value):
    """A rule for the colours of a surface. Its attribute `cmap` is sRGB; `_exact` has it in linear numbers."""

    def _keep(self, **fields: Any) -> None:
        if "cmap" in fields:
            exact = linear(color_map(fields["cmap"]))
            object.__setattr__(self, "_exact", {"cmap": exact})
            fields["cmap"] = encoded(exact)
        super()._keep(**fields)

    def _check(self) -> None:
        rule: Any = self
        _core._check_color_rule(rule)


class _MeasuredRule(_ColorRule):
    """A rule by a number of an object, which may fit its limits to the objects that have it."""

    limits: tuple[float, float] | None
    label: str


class _IndexedRule(_MeasuredRule):
    """A rule with an index of what is measured, which the compiled module reads."""

    _index: Any

    @classmethod
    def _with(cls, index: Any, **fields: Any) -> Any:
        """The rule that has an index already."""
        rule = cls.__new__(cls)
        object.__setattr__(rule, "_index", index)
        rule._keep(**fields)
        return rule


def two_numbers(value: Any, parameter: str) -> tuple[float, float]:
    """A pair of numbers, from any sequence."""
    if not hasattr(type(value), "__len__") or isinstance(value, (str, bytes, dict)) or len(value) != 2:
        raise TypeError(sentence(parameter, "two numbers", value))
    first, second = value
    return number(first, parameter), number(second, parameter)


def transform_of(value: ArrayLike | None) -> NDArray[np.float64]:
    """A (4, 4) matrix; that of the identity for None."""
    return np.eye(4) if value is None else _core._doubles(value, "transform", (4, 4))
