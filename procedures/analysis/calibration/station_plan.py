"""Predicted duration and resolution of a plan of stations, before anything moves."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import brentq

from procedures.core.arrays import Array
from procedures.core.recording import Station
from procedures.core.table_angles import TableAngles

THESIS_ORIENTATIONS = (
    *((0.0, -90.0), (0.0, 90.0), (90.0, 0.0), (-90.0, 0.0), (0.0, 0.0), (180.0, 0.0)),
    *((-90.0, -45.0), (90.0, 45.0), (180.0, -45.0), (0.0, 45.0), (135.0, 0.0), (-45.0, 0.0)),
)
"""(β, γ) [deg] of thesis fig. 5.4: the twelve of the calibration, and the plan that a better one has to beat."""

LONGEST_DWELL_S = 10.0 * 365.25 * 86_400.0
"""Ten years at one station: a dwell that would have to be longer counts as none at all."""
COARSE_DWELLS_S = (*(10.0**k for k in range(-2, 9)), LONGEST_DWELL_S)


def move_time_s(start: TableAngles, stop: TableAngles, axes: Sequence[tuple[float, float]]) -> float:
    """Return the least time to move the table from rest to rest [s]; its axes turn together, the slowest counts.

    `axes` are (rate_deg_s, acceleration_deg_s2) of outer, middle, inner.
    """
    turns = (stop.outer_deg - start.outer_deg, stop.middle_deg - start.middle_deg, stop.inner_deg - start.inner_deg)
    return max(_turn_time_s(turn, *axis) for turn, axis in zip(turns, axes, strict=True))


def _turn_time_s(degrees: float, rate_deg_s: float, acceleration_deg_s2: float) -> float:
    """Least time to turn an axis from rest to rest: triangular or trapezoidal rate [s]."""
    distance = abs(degrees)
    if distance * acceleration_deg_s2 < rate_deg_s**2:
        return 2.0 * float(np.sqrt(distance / acceleration_deg_s2))
    return distance / rate_deg_s + rate_deg_s / acceleration_deg_s2


def windows(stations: Sequence[Station], axes: Sequence[tuple[float, float]], record_s: float | None = None) -> Array:
    """[start, stop] of each station's record in bench time [s], shape (n, 2), the table starting from its zero.

    `record_s`: length of every record; None: each station's own. `axes` are (rate_deg_s, acceleration_deg_s2) of outer,
    middle, inner.
    """
    now, at = 0.0, TableAngles()
    spans: list[tuple[float, float]] = []
    for station in stations:
        to = station.angles or at
        now += move_time_s(at, to, axes) + station.settle_s
        now += station.power_off_s
        spans.append((now, now + (station.record_s if record_s is None else record_s)))
        now, at = spans[-1][1], to
    return np.array(spans).reshape(-1, 2)


def dwell_for(
    uncertainty: Callable[[float], float], limit: float, shortest_s: float, expected: float | None = None
) -> float | None:
    """Shortest dwell [s] of at least `shortest_s` at which an uncertainty comes down to its limit; None where even
    `LONGEST_DWELL_S` is too short. `expected`: the uncertainty at the shortest, where it is known already.

    The uncertainty is taken to fall with the dwell T until slow noise stops it, and never faster than 1/T, as that of
    quantization does; found to 1 % by Brent's method over the logarithms, after a coarse search over decades of a
    second, the same ones for every plan.
    """
    low_s, high_s = shortest_s, shortest_s
    low = high = uncertainty(shortest_s) if expected is None else expected
    while high > limit:
        longer = [dwell for dwell in COARSE_DWELLS_S if dwell > high_s]
        if not longer:
            return None
        low_s, low = high_s, high
        high_s = next((dwell for dwell in longer if dwell >= low_s * low / limit), longer[-1])
        high = uncertainty(high_s)
    if high_s == shortest_s:
        return float(shortest_s)
    ends = float(np.log(low_s)), float(np.log(high_s))
    excess = {at: float(np.log(value / limit)) for at, value in zip(ends, (low, high), strict=True)}

    def above(logarithm: float) -> float:
        if logarithm not in excess:
            excess[logarithm] = float(np.log(uncertainty(float(np.exp(logarithm))) / limit))
        return excess[logarithm]

    brentq(above, *ends, xtol=0.005, rtol=1e-12)
    return float(np.exp(min(at for at, over in excess.items() if over <= 0.0)))
