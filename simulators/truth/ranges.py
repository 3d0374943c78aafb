"""Basic types of all truth values: arrays and vectors, and a refusal that names field, value and allowed range."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]

ZERO: Vector = (0.0, 0.0, 0.0)


class TruthError(ValueError):
    """A truth value is not allowed: names the field, its value and the allowed range."""


def within(where: str, value: object, low: float, high: float) -> float:
    """Check a number against low … high. Raises `TruthError`, also for NaN and non-numbers."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise TruthError(f"{where} = {value!r} must be a number within {low:g} … {high:g}")
    return float(value)


def check_fields(where: str, record: object, ranges: Mapping[str, tuple[float, float]]) -> None:
    """Check that each named field of a record is inside its range."""
    for name, (low, high) in ranges.items():
        within(f"{where}.{name}", getattr(record, name), low, high)
