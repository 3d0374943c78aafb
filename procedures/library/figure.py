"""Axes for a result's plot; only this module imports matplotlib, and says in a sentence where it is missing."""

from typing import Any

from procedures.core.errors import DomainError


def axes(given: Any) -> Any:
    """Return the given axes, or new ones of one figure. Raises `DomainError` where matplotlib is not installed."""
    if given is not None:
        return given
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise DomainError("plots need matplotlib: pip install 'bench-procedures[plot]'") from error
    return Figure(layout="constrained").subplots()
