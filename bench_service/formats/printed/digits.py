"""Decimal digits of a value that follow its uncertainty, for pages and printed reports."""

from math import floor, isfinite, log10

LEAST_DIGITS = 6
"""Significant digits of a number whose uncertainty is not known."""


def places(uncertainty: float | None) -> int | None:
    """Return the number of decimals that shows an uncertainty with two significant digits (negative: rounded to tens,
    hundreds ...); None if it is absent, zero or not finite.
    """
    if uncertainty is None or not isfinite(uncertainty) or uncertainty <= 0.0:
        return None
    return 1 - floor(log10(uncertainty))


def to_uncertainty(value: float, uncertainty: float | None) -> str:
    """Return a value as text to the second significant digit of its uncertainty; without one, with six digits."""
    after_point = places(uncertainty)
    if after_point is None or not isfinite(value):
        return f"{value:.{LEAST_DIGITS}g}"
    if abs(value) >= 1e9 or after_point > 12:
        digits = max(1, floor(log10(abs(value))) + 1 + after_point) if value else 1
        return f"{value:.{min(digits - 1, 15)}e}"
    return f"{round(value, after_point):.{max(after_point, 0)}f}"


def two_digits(uncertainty: float) -> str:
    """Return an uncertainty as text with two significant digits; one that is zero or not finite as it is."""
    after_point = places(uncertainty)
    if after_point is None:
        return f"{uncertainty:.{LEAST_DIGITS}g}"
    return f"{uncertainty:.1e}" if after_point > 12 else f"{round(uncertainty, after_point):.{max(after_point, 0)}f}"
