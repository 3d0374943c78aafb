"""Forecast of a limit from a plan: does the plan resolve it, does the unit as recorded meet it, would twice the limit
be found?
"""

from dataclasses import dataclass
from math import sqrt

from bench_service.campaigns.campaign import DecisionRule
from procedures.core.limits import Limit, PlannedCheck, bounds
from procedures.importing import IMPORTING


@dataclass(frozen=True)
class LimitPreview:
    """One limit that a step will be held to, with its source and what the plan makes of it."""

    check: str
    unit: str
    minimum: float | None
    maximum: float | None
    source: str
    standard_uncertainty: float | None
    """Standard uncertainty u of the value by the plan; None: not predicted."""
    expanded_uncertainty: float | None
    """Expanded uncertainty k·u."""
    coverage_factor: float
    degrees_of_freedom: float | None
    """Degrees of freedom of a root mean square, such as a scatter between launches; None for an estimate."""
    resolved: bool | None
    """True where the expanded uncertainty is within the limit; None where no uncertainty is predicted."""
    expected: float | None
    """Value to expect of this unit by its record."""
    false_alarm: float | None
    """Probability that the unit as recorded fails; of a test of significance its level."""
    power_at_twice: float | None
    """Probability that a unit at twice the limit fails."""
    level: float | None = None
    """Level of a test of significance; None for a requirement on the unit."""

    def __str__(self) -> str:
        parts = [f"{self.check}: {_bounds(self)} ({self.source or 'source not said'})"]
        if self.expanded_uncertainty:
            parts.append(f"U = {self.expanded_uncertainty:.3g} {self.unit} (k = {self.coverage_factor:g})")
        if self.power_at_twice is not None:
            parts.append(f"power at twice the limit {100.0 * self.power_at_twice:.3g} %")
        return "; ".join(parts)


def preview(planned: PlannedCheck, rule: DecisionRule) -> LimitPreview:
    """Return the forecast of a planned check; `rule` gives the coverage factor, and the guard band of a campaign's
    limit.
    """
    limit, u, k = planned.limit, planned.standard_uncertainty, rule.coverage_factor
    width = half_width(limit)
    guard = rule.guard * k * u if rule.rule == "guarded" and u is not None else 0.0
    false_alarm = planned.level
    if planned.level is None and planned.expected is not None and limit.maximum is not None and u is not None:
        false_alarm = beyond(planned, planned.expected, limit.maximum - guard)
    twice = None
    if u is not None and width > 0.0:
        twice = beyond(planned, 2.0 * width, width - guard)
    return LimitPreview(
        planned.check,
        limit.unit,
        limit.minimum,
        limit.maximum,
        limit.source,
        u,
        None if u is None else k * u,
        k,
        planned.degrees_of_freedom,
        None if u is None else k * u <= width,
        planned.expected,
        false_alarm,
        twice,
        planned.level,
    )


def beyond(planned: PlannedCheck, true: float, limit: float) -> float:
    """Probability that the measured value lies above a limit where the true one is `true`, both ≥ 0.

    An estimate: ``Φ((true − limit)/u)``.
    A root mean square of ν degrees of freedom: ``P(χ²_ν > ν·limit²/(true² + u²))``.
    """
    with IMPORTING:
        from scipy.special import gammaincc, ndtr  # a start does without it

    u = planned.standard_uncertainty or 0.0
    if limit <= 0.0:
        return 1.0
    if planned.degrees_of_freedom is None:
        return float(ndtr((true - limit) / u)) if u > 0.0 else float(true > limit)
    spread = true**2 + u**2
    freedom = planned.degrees_of_freedom
    return float(gammaincc(0.5 * freedom, 0.5 * freedom * limit**2 / spread)) if spread > 0.0 else 0.0


def smallest_step(planned: PlannedCheck, power: float, of: int) -> float:
    """Smallest step of one of `of` launches that the limit on their scatter finds with the probability `power`.

    The scatter s² of n values, of which one lies δ away from the rest, is noncentral: ``(n − 1)·s²/σ²`` has the
    noncentrality ``δ²(n − 1)/(n·σ²)``, σ² = expected² + u². The step is found by bisection, in the limit's unit.
    """
    with IMPORTING:
        from scipy.special import chndtr

    sigma2 = (planned.expected or 0.0) ** 2 + (planned.standard_uncertainty or 0.0) ** 2
    freedom, limit = of - 1.0, planned.limit.maximum or 0.0

    def found(step: float) -> float:
        return 1.0 - float(chndtr(freedom * limit**2 / sigma2, freedom, step**2 * freedom / (of * sigma2)))

    low, high = 0.0, limit + sqrt(sigma2)
    while found(high) < power:
        high *= 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if found(middle) < power else (low, middle)
    return high


def half_width(limit: Limit) -> float:
    """Return half of the allowed range; of a limit on one side its size."""
    if limit.maximum is not None and limit.minimum is not None:
        return 0.5 * (limit.maximum - limit.minimum)
    return abs(limit.maximum if limit.maximum is not None else limit.minimum or 0.0)


def _bounds(found: LimitPreview) -> str:
    return bounds(found.minimum, found.maximum, found.unit)
