"""Turns and sinusoids that the table of a bench can make: default ramps and rests, and refusals before anything moves.

The table's demands of a turn take bench time, which the rest at the end of its recording must hold.
"""

from collections.abc import Sequence
from math import ceil

from procedures.bench import BenchDescription
from procedures.core.errors import BadParameter
from procedures.core.recording import Station
from procedures.core.turn import PEAK_ACCELERATION

ACCELERATION_SHARE = 0.9
"""Share of the outer axis' acceleration for ramps without a given length; the rest is for the servo."""


def default_ramp_s(rate_deg_s: float, bench: BenchDescription, share: float = ACCELERATION_SHARE) -> float:
    """Return the least ramp to a rate within a share of the outer axis' acceleration, rounded up to a tenth of a second
    [s].
    """
    return ceil(10.0 * (PEAK_ACCELERATION * rate_deg_s / (share * bench.outer.acceleration_deg_s2))) / 10.0


def rest_with_demands(rest_s: float, bench: BenchDescription, turns: int = 1) -> float:
    """Return the rest [s] and the time that the demands of so many turns take at the bench, to a tenth of a second."""
    return rest_s + turns * ceil(10.0 * bench.turn_extra_s) / 10.0


def require_rest(field: str, rest_s: float | None, bench: BenchDescription, turns: int = 1) -> None:
    """Refuse a rest [s] that is shorter than the table takes for the demands of so many turns; None counts as no rest.
    Raises `BadParameter`, naming the field.
    """
    least_s = turns * bench.turn_extra_s
    if (rest_s or 0.0) < least_s:
        allowed = f"at least {least_s:.3g} s, which the demands of the table of bench {bench.id} take"
        raise BadParameter(field, rest_s, allowed)


def require_possible(field: str, value: object, stations: Sequence[Station], bench: BenchDescription) -> None:
    """Refuse stations beyond the bench's limits. Raises `BadParameter`, naming the field and its value."""
    for station in stations:
        if found := bench.motion_violations(station):
            raise BadParameter(field, value, f"station {station.label}: {'; '.join(found)}")
