"""The trend of a quantity over a unit's results, judged on a control chart."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from math import isfinite

from bench_service.mapping import copied
from bench_service.model.errors import NotFound
from bench_service.model.quantities import Quantity, quantity
from bench_service.model.records import ResultValue, StoredResult
from procedures.analysis.control_chart import LEAST_POINTS, ControlLimits, Signal, control_limits, signals


@dataclass(frozen=True)
class TrendPoint:
    """The value of the quantity in one result, with its uncertainty, time and code version."""

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
    """Unit of the values; empty where the result does not give it."""
    points: tuple[TrendPoint, ...]
    limits: ControlLimits | None
    """Control limits of the chart; None with fewer than two points."""
    signals: tuple[Signal, ...]
    without: int
    """Number of results of that procedure that lack the quantity."""


def trend_of(values: Sequence[ResultValue], unit: str, procedure: str, name: str, judged: int = 0) -> Trend:
    """Return the control chart of results, given oldest first; its limits rest on all points but the last `judged`.

    Points have the newest one's unit: where a version of the procedure changed the unit, the chart starts there.
    """
    found = [(value, value.quantity) for value in values if value.quantity is not None]
    unit_of = found[-1][1].unit if found else ""
    points = tuple(_point(value, q) for value, q in found if q.unit == unit_of)
    numbers = [p.value for p in points]
    base = numbers[: len(numbers) - judged]
    limits = control_limits(base) if len(base) >= LEAST_POINTS else None
    broken = () if limits is None else signals(numbers, limits)
    return Trend(unit, procedure, name, unit_of, points, limits, broken, len(values) - len(points))


def value_of(result: StoredResult, name: str) -> ResultValue:
    """Return the value of a quantity from one result. Raises `NotFound`, naming the known quantities, and for one that
    nothing bounds.
    """
    found = quantity(result.document, name)
    if not isfinite(found.value):
        raise NotFound("quantity", name, "it was not observed and is unbounded in this result: there is no value")
    about = {"result": result.id, "job": result.job_id, "at": result.created_at}
    return copied(ResultValue, result, **about, quantity=found)


def _point(of: ResultValue, q: Quantity) -> TrendPoint:
    return copied(TrendPoint, of, q)
