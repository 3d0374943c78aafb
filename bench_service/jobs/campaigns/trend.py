"""How a quantity of a unit went over its results, and whether it is still what it was."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from bench_service.jobs.campaigns.quantities import Quantity, quantity
from bench_service.jobs.errors import NotFound
from bench_service.jobs.store import ResultStore
from bench_service.jobs.stored import StoredResult
from procedures.analysis.control_chart import LEAST_POINTS, ControlLimits, Signal, control_limits, signals


@dataclass(frozen=True)
class TrendPoint:
    """One result's value."""

    result: str
    job: str | None
    at: datetime
    value: float
    standard_uncertainty: float | None
    simulated: bool
    code_version: str


@dataclass(frozen=True)
class Trend:
    """A quantity over a unit's results, oldest first, on an individuals control chart."""

    unit_serial: str
    procedure: str
    quantity: str
    unit: str
    """Of the values; empty where the result does not say."""
    points: tuple[TrendPoint, ...]
    limits: ControlLimits | None
    """None with fewer than two points."""
    signals: tuple[Signal, ...]
    without: int
    """Results of that procedure that lack the quantity."""


def trend_of(results: Sequence[StoredResult], unit: str, procedure: str, name: str, baseline: int | None) -> Trend:
    """A chart of results, oldest first; the limits rest on the first `baseline` of them, or on all.

    Raises `NotFound` where there are results and none has the quantity.
    """
    found: list[tuple[StoredResult, Quantity]] = []
    refusal: NotFound | None = None
    for result in results:
        try:
            found.append((result, quantity(result.document, name)))
        except NotFound as missing:
            refusal = missing
    if not found and refusal is not None:
        raise refusal
    unit_of = found[-1][1].unit if found else ""
    points = tuple(_point(result, q) for result, q in found if q.unit == unit_of)
    values = [p.value for p in points]
    base = values[:baseline]
    limits = control_limits(base) if len(base) >= LEAST_POINTS else None
    broken = () if limits is None else signals(values, limits)
    return Trend(unit, procedure, name, unit_of, points, limits, broken, len(results) - len(points))


def history(
    results: ResultStore,
    unit: str,
    procedure: str,
    simulated: bool,
    last: int,
    parameters: dict[str, Any] | None = None,
) -> list[StoredResult]:
    """The latest results that gave a job of the unit its verdict, oldest first; real and simulated ones apart.

    With `parameters` only those of the same plan: another dwell has another spread.
    """
    found = results.of_verdicts(unit, procedure, simulated=simulated, limit=last)
    return [result for result in found[::-1] if parameters is None or result.parameters == parameters]


def _point(result: StoredResult, q: Quantity) -> TrendPoint:
    return TrendPoint(
        result.id,
        result.job_id,
        result.created_at,
        q.value,
        q.standard_uncertainty,
        result.simulated,
        result.code_version,
    )
