"""Chart of a quantity of a unit over its results, for pages and images."""

from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Query

from bench_service.evidence.trend import Trend
from bench_service.model.quantities import quantities
from bench_service.service import BenchService
from procedures.core.report import Figure, Series
from procedures.core.units import DISPLAY


@dataclass(frozen=True)
class WantedTrend:
    """Choice of a quantity as the query of a page's address has it."""

    procedure: Annotated[str, Query(max_length=100)] = "calibration_12_orientations"
    quantity: Annotated[str, Query(max_length=200)] = ""
    simulated: bool | None = None
    limit: Annotated[int, Query(ge=2, le=500)] = 100


TrendQuery = Annotated[WantedTrend, Depends(WantedTrend)]


@dataclass(frozen=True)
class TrendChoice:
    """A quantity that exists, with the names of the others of the same result."""

    quantity: str
    names: tuple[str, ...]
    simulated: bool
    query: WantedTrend


@dataclass(frozen=True)
class TrendChart:
    """A trend with its figure; both None where no result has the quantity."""

    trend: Trend | None
    figure: Figure | None


def wanted_trend(service: BenchService, serial: str, query: WantedTrend) -> TrendChoice:
    """Return the requested quantity, or else the first of the newest result. Raises `NotFound` for an unknown unit."""
    service.stores.units.unit(serial)
    kind = service.benches.description(service.benches.default()).simulated
    simulated = kind if query.simulated is None else query.simulated
    newest = service.stores.results.newest_verdict(serial, query.procedure, simulated=simulated)
    names = tuple(quantities(newest.document)) if newest is not None else ()
    return TrendChoice(query.quantity or next(iter(names), ""), names, simulated, query)


def trend_of(service: BenchService, serial: str, choice: TrendChoice) -> TrendChart:
    """Return the trend of a chosen quantity, with its figure."""
    if not choice.quantity:
        return TrendChart(None, None)
    query = choice.query
    trend = service.campaigns.trend(serial, query.procedure, choice.quantity, choice.simulated, query.limit)
    return TrendChart(trend, trend_figure(trend))


def trend_figure(trend: Trend) -> Figure | None:
    """Return the figure of values with their uncertainty, centre, limits, and the points that break a rule; None
    without points.
    """
    if not trend.points:
        return None
    unit, size = DISPLAY.get(trend.unit, (trend.unit, 1.0))
    x = tuple(float(k) for k in range(1, len(trend.points) + 1))
    y = tuple(p.value / size for p in trend.points)
    error = tuple((p.standard_uncertainty or 0.0) / size for p in trend.points)
    series = [Series("value ± standard uncertainty", x, y, error if any(error) else (), "line_points")]
    if trend.limits is not None:
        ends = (0.5, len(x) + 0.5)
        lines = {"centre": trend.limits.centre, "lower limit": trend.limits.lower, "upper limit": trend.limits.upper}
        series += [Series(name, ends, (v / size, v / size), style="reference") for name, v in lines.items()]
        broken = sorted({s.index for s in trend.signals})
        if broken:
            series.append(Series("signal", tuple(x[k] for k in broken), tuple(y[k] for k in broken)))
    title = f"{trend.quantity} of {trend.unit_serial}"
    note = "Limits: mean ± 2.66 mean moving ranges. Signals: Western Electric rules."
    return Figure(title, "result, oldest first", f"{trend.quantity}, {unit or 'as stored'}", tuple(series), note=note)
