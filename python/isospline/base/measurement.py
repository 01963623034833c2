"""Measured numbers with their errors."""

from __future__ import annotations

import math
import numbers
from dataclasses import dataclass, replace
from typing import Any

from .handed import handed
from .parameters import check_type
from .signatures import explained_methods
from .values import itself


@explained_methods
@dataclass(frozen=True)
class Measurement:
    """A measured number with an estimate of its error.

    ``float(measurement)`` is the number. Measurements can be added, subtracted, multiplied and divided, with each other
    and with numbers, and raised to powers that are numbers. Errors are propagated to first order. Those of two
    measurements are added, because measurements of one surface are not independent. Measurements are ordered by their
    numbers; they are equal if their numbers and their errors are.

    Parameters
    ----------
    value : float
        The number.
    error : float
        An estimate of its error, at least 0.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.sphere(0.7)
    >>> ball = isospline.Isosurface(field.volume(32), field.level)
    >>> porosity = 1 - ball.enclosed_volume() / 8
    >>> round(porosity.value, 4), porosity.error < 0.001
    (0.8204, True)
    >>> print(isospline.Measurement(1.23456, 0.012))
    1.235 ± 0.012
    >>> print(f"{isospline.Measurement(0.31, 0.005):.1%}")
    31.0% ± 0.5%
    """

    value: float
    error: float = 0.0

    # NumPy's numbers leave the arithmetic to this class.
    __array_ufunc__ = None
    __copy__ = itself

    def __post_init__(self) -> None:
        for name in ("value", "error"):
            check_type(getattr(self, name), name, numbers.Real, "a number")
            object.__setattr__(self, name, float(getattr(self, name)))
        if self.error < 0:
            raise ValueError(f"error: expected a number, at least 0, got {self.error:g}")

    def replace(self, **changes: Any) -> Measurement:
        """The same measurement with another value or error."""
        return replace(self, **changes)

    def __float__(self) -> float:
        return self.value

    def __format__(self, spec: str) -> str:
        if spec:
            return f"{self.value:{spec}} ± {self.error:{spec}}"
        if not (0 < self.error < math.inf and math.isfinite(self.value)):
            return f"{self.value:.12g}" + (f" ± {self.error:g}" if self.error else "")
        # Two digits of the error, and the digits of the value down to them.
        places = 1 - math.floor(math.log10(self.error))
        if max(abs(self.value), self.error) >= 1e15 or places > 15:
            return f"{self.value:.12g} ± {self.error:.2g}"
        shown = max(places, 0)
        return f"{round(self.value, places):.{shown}f} ± {round(self.error, places):.{shown}f}"

    def __str__(self) -> str:
        return format(self)

    def __repr__(self) -> str:
        return f"Measurement(value={self.value:.12g}, error={self.error:.3g})"

    # Not derived from each other: equality is that of errors, too, and no comparison holds for NaN.
    def __lt__(self, other: Any) -> bool:
        second = _operand(other)
        return NotImplemented if second is None else self.value < second.value

    def __le__(self, other: Any) -> bool:
        second = _operand(other)
        return NotImplemented if second is None else self.value <= second.value

    def __gt__(self, other: Any) -> bool:
        second = _operand(other)
        return NotImplemented if second is None else self.value > second.value

    def __ge__(self, other: Any) -> bool:
        second = _operand(other)
        return NotImplemented if second is None else self.value >= second.value

    def __neg__(self) -> Measurement:
        return Measurement(-self.value, self.error)

    def __pos__(self) -> Measurement:
        return self

    def __abs__(self) -> Measurement:
        return Measurement(abs(self.value), self.error)

    def __round__(self, digits: int | None = None) -> float:
        return round(self.value, digits)

    def __add__(self, other: Any) -> Measurement:
        second = _operand(other)
        if second is None:
            return NotImplemented
        return Measurement(self.value + second.value, self.error + second.error)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Measurement:
        second = _operand(other)
        return NotImplemented if second is None else self + -second

    def __rsub__(self, other: Any) -> Measurement:
        return -self + other

    def __mul__(self, other: Any) -> Measurement:
        second = _operand(other)
        if second is None:
            return NotImplemented
        error = abs(self.value) * second.error + abs(second.value) * self.error
        return Measurement(self.value * second.value, error)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Measurement:
        second = _operand(other)
        if second is None:
            return NotImplemented
        value = self.value / second.value  # not by a power, which rounds twice and overflows for small numbers
        return Measurement(value, (self.error + abs(value) * second.error) / abs(second.value))

    def __rtruediv__(self, other: Any) -> Measurement:
        first = _operand(other)
        return NotImplemented if first is None else first / self

    def __pow__(self, exponent: Any) -> Measurement:
        if not isinstance(exponent, numbers.Real):
            return NotImplemented
        power = float(exponent)
        if power == 0:
            return Measurement(1.0, 0.0)
        if self.value < 0 and not power.is_integer():
            raise ValueError(
                f"value: expected at least 0 for a power that is not whole, got {self.value:g} ** {power:g}"
            )
        slope = math.inf if self.value == 0 and power < 1 else abs(power * self.value ** (power - 1))
        return Measurement(self.value**power, slope * self.error if self.error else 0.0)


def _operand(value: Any) -> Measurement | None:
    """A measurement or an exact number; None for anything else."""
    if isinstance(value, Measurement):
        return value
    return Measurement(float(value)) if isinstance(value, numbers.Real) else None


@handed
def measurement_of(measured: dict[str, float]) -> Measurement:
    """The measurement of a compiled function."""
    return Measurement(**measured)
