"""Conversion of arguments of any common type (lists, arrays, pandas objects) to arrays; what does not fit is refused in
words.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.units import converted, units_like

Samples = ArrayLike
"""List, numpy array or pandas series of numbers."""
RATE_UNITS = (*units_like("rad/s"), *units_like("m/s^2"))


def series(name: str, samples: Samples) -> Array:
    """Return one channel's samples, (n,), as floating-point numbers. Raises `BadParameter`; NaN is left to the
    caller.
    """
    found = _numbers(name, samples)
    if found.ndim == 2 and 1 in found.shape:
        found = found.ravel()
    if found.ndim != 1:
        raise BadParameter(name, f"an array of shape {found.shape}", "one channel at a time, shape (n,): pass a column")
    if len(found) == 0:
        raise BadParameter(name, "no sample", "at least one sample")
    return found


def vectors(name: str, values: Samples) -> Array:
    """Return vectors, (n, 3), finite. Raises `BadParameter`."""
    found = _numbers(name, values)
    if found.ndim != 2 or found.shape[1] != 3:
        raise BadParameter(name, f"an array of shape {found.shape}", "a row of x, y, z for each pose, shape (n, 3)")
    if not np.all(np.isfinite(found)):
        row = int(np.argmax(~np.isfinite(found).all(axis=1)))
        raise BadParameter(f"{name}[{row}]", found[row].tolist(), "finite numbers")
    return found


def positive(name: str, value: float) -> float:
    """Return a finite number above zero. Raises `BadParameter`."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = float("nan")
    if not 0.0 < number < float("inf"):
        raise BadParameter(name, value, "a finite number above zero")
    return number


def one_of(name: str, value: str, allowed: Sequence[str]) -> str:
    """Return a word that must be one of a list. Raises `BadParameter` naming the list."""
    if value not in allowed:
        raise BadParameter(name, value, f"one of {', '.join(allowed)}")
    return value


def si_unit(unit: str) -> tuple[str, float]:
    """Return the SI unit of a rate or specific force, and the size of `unit` in it. Raises `BadParameter`."""
    one_of("unit", unit, RATE_UNITS)
    si = "rad/s" if unit in units_like("rad/s") else "m/s^2"
    return si, converted(1.0, unit, si)


def _numbers(name: str, values: Any) -> Array:
    try:
        found = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise BadParameter(name, type(values).__name__, f"numbers only: {error}") from error
    return np.ascontiguousarray(found)
