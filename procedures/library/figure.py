"""Axes for a result's plot; matplotlib is asked for here alone, and its absence is a sentence."""

from typing import Any

from procedures.core.errors import DomainError


def axes(given: Any) -> Any:
    """The given axes, or new ones of one figure. Raises `DomainError` where matplotlib is not installed."""
    if given is not None:
        return given
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise DomainError("plots need matplotlib: pip install 'bench-procedures[plot]'") from error
    return Figure(layout="constrained").subplots()
