"""Individuals control chart: detection of a change in a quantity that is measured repeatedly.

For single values x_1…x_n in the order of measurement the spread of the process is taken from the moving ranges of two
neighbours, so that a slow drift does not widen its own limits: ``σ = mR̄/d2``, d2 = 1.128 for two, and the limits are
``x̄ ± 3σ = x̄ ± 2.66·mR̄`` (Shewhart's chart for individuals: NIST/SEMATECH e-Handbook 6.3.2.2; Montgomery,
Introduction to Statistical Quality Control, 6.4; ISO 7870-2).

The run rules are those of the Western Electric handbook (1956; NIST/SEMATECH e-Handbook 6.3.2): of a process that did
not change 1 point in 370 lies beyond 3σ, and the four rules together raise a false alarm once in 92 points.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.core.arrays import Array
from procedures.core.errors import BadParameter

D2 = 1.128
"""Expected range of two standard Gaussian values, 2/√π, to the digits that every table of the chart has."""
D4 = 3.267
"""Upper limit of a moving range of two, in mean moving ranges."""
LEAST_POINTS = 2
ROUNDING = 8.0 * float(np.finfo(np.float64).eps)
"""Rounding error of a mean and of distances from it, relative to the greatest value."""


@dataclass(frozen=True)
class RunRule:
    """Rule of a control chart: `count` of `window` points in a row beyond `sigmas` on one side of the centre."""

    name: str
    count: int
    window: int
    sigmas: float


RULES = (
    RunRule("one point beyond 3σ", 1, 1, 3.0),
    RunRule("two of three points in a row beyond 2σ on one side", 2, 3, 2.0),
    RunRule("four of five points in a row beyond 1σ on one side", 4, 5, 1.0),
    RunRule("eight points in a row on one side", 8, 8, 0.0),
)
"""Western Electric rules 1 to 4."""


@dataclass(frozen=True)
class ControlLimits:
    """Centre and limits, in the unit of the values."""

    centre: float
    sigma: float
    lower: float
    upper: float
    mean_moving_range: float
    moving_range_upper: float
    """Upper limit of a step between neighbours; a greater one is a signal of its own."""
    points: int
    """Number of values that the limits rest on."""


@dataclass(frozen=True)
class Signal:
    """A rule violation, placed at the last of the points that break the rule."""

    index: int
    rule: str
    side: int
    """+1 above the centre, −1 below."""


def control_limits(values: Sequence[float]) -> ControlLimits:
    """Return centre and limits from values in the order of measurement, at least two, all finite. Raises
    `BadParameter`.
    """
    x = _finite(values)
    if len(x) < LEAST_POINTS:
        raise BadParameter("values", len(x), f"a control chart needs at least {LEAST_POINTS}")
    centre = float(x[0] + np.mean(x - x[0]))  # of equal values just that value, not one that rounding moved
    mean_range = float(np.mean(np.abs(np.diff(x))))
    sigma = mean_range / D2
    return ControlLimits(centre, sigma, centre - 3.0 * sigma, centre + 3.0 * sigma, mean_range, D4 * mean_range, len(x))


def signals(values: Sequence[float], limits: ControlLimits) -> tuple[Signal, ...]:
    """Every point at which a rule is broken, in order; a point that lies on a line is not beyond it.

    A point breaks a rule of a window when it belongs to those beyond the line itself: a point back within it does not.
    Where the spread is zero every departure from the centre is beyond every line, except by the rounding of doubles.
    """
    x = _finite(values)
    rounding = ROUNDING * max(float(np.max(np.abs(x), initial=0.0)), abs(limits.centre))
    x = x - limits.centre
    found: list[Signal] = []
    for rule in RULES:
        for side in (1, -1):
            beyond = side * x > rule.sigmas * limits.sigma + rounding
            for index in np.flatnonzero(beyond).tolist():
                window = beyond[max(0, index - rule.window + 1) : index + 1]
                if int(np.sum(window)) >= rule.count:
                    found.append(Signal(index, rule.name, side))
    return tuple(sorted(found, key=lambda s: (s.index, [r.name for r in RULES].index(s.rule))))


def _finite(values: Sequence[float]) -> Array:
    x = np.asarray(values, dtype=np.float64)
    bad = np.flatnonzero(~np.isfinite(x)).tolist()
    if bad:
        raise BadParameter(f"values[{bad[0]}]", float(x[bad[0]]), "must be finite")
    return x
