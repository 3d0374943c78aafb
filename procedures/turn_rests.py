"""Rests at the end of recordings in which the table turns: its demands take bench time, which the rest must hold."""

from math import ceil

from procedures.bench import BenchDescription
from procedures.core.errors import BadParameter


def rest_with_demands(rest_s: float, bench: BenchDescription, turns: int = 1) -> float:
    """Return the rest [s] and the time that the demands of so many turns take at the bench, to a tenth of a second."""
    return rest_s + turns * ceil(10.0 * bench.turn_extra_s) / 10.0


def require_rest(field: str, rest_s: float | None, bench: BenchDescription, turns: int = 1) -> None:
    """Refuse a rest [s] that is shorter than the demands of so many turns. Raises `BadParameter`, naming the field."""
    least_s = turns * bench.turn_extra_s
    if (rest_s or 0.0) < least_s:
        allowed = f"at least {least_s:.3g} s, which the demands of the table of bench {bench.id} take"
        raise BadParameter(field, rest_s, allowed)
