"""The pages around campaigns: what there is, a run step by step, a quantity's trend."""

from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse

from bench_service.campaigns.run import CampaignRun, StepState
from bench_service.evidence.trend import Trend
from bench_service.model.job import JobState
from bench_service.model.quantities import quantities
from bench_service.pages.figures import svg
from bench_service.pages.routes import service_of, templates
from procedures.core.report import Figure, Series
from procedures.core.units import DISPLAY

router = APIRouter(include_in_schema=False, default_response_class=HTMLResponse)


def _explanation(run: CampaignRun) -> str:
    """What a run's state means to a person."""
    if run.waiting:
        return f"It waits: {run.waiting}."
    if run.state is JobState.QUEUED:
        return "It begins as soon as a process that drives the bench looks at it."
    if run.cancel_requested and run.open:
        return "It is being cancelled: its job ends first, and the bench is not free before it is safe."
    return run.reason


def trend_figure(trend: Trend) -> Figure | None:
    """The chart: values with their uncertainty, centre, limits, and the points that break a rule; None without any."""
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


@router.get("/campaigns")
def campaigns_page(request: Request) -> HTMLResponse:
    """Campaigns, schedules, the latest runs."""
    service = service_of(request)
    return templates.TemplateResponse(
        request,
        "campaigns.html",
        {
            "campaigns": service.campaigns.campaigns(limit=200).items,
            "schedules": service.campaigns.schedules.list(limit=200).items,
            "runs": service.stores.campaigns.runs(limit=50).items,
        },
    )


@router.get("/campaign-runs/{run_id}")
def campaign_run_page(run_id: str, request: Request) -> HTMLResponse:
    """A run: its steps, what each said, what it waits for."""
    run = service_of(request).stores.campaigns.run(run_id)
    missed = {step.name: [c for c in step.checks if not c.passed] for step in run.steps}
    done = sum(s.finished_at is not None or s.state is StepState.SKIPPED for s in run.steps)
    context = {"run": run, "missed": missed, "explanation": _explanation(run), "done": done}
    return templates.TemplateResponse(request, "campaign_run.html", context)


@router.get("/units/{serial}/trend")
def trend_page(
    serial: str,
    request: Request,
    procedure: Annotated[str, Query(max_length=100)] = "calibration_12_orientations",
    quantity: Annotated[str, Query(max_length=200)] = "",
    simulated: bool | None = None,
    limit: Annotated[int, Query(ge=2, le=500)] = 100,
) -> HTMLResponse:
    """A quantity over the unit's results; without one, what there is to choose from."""
    service = service_of(request)
    service.stores.units.unit(serial)
    kind = service.benches.description(service.benches.default()).simulated if simulated is None else simulated
    newest = service.stores.results.newest_verdict(serial, procedure, simulated=kind)
    names = list(quantities(newest.document)) if newest is not None else []
    chosen = quantity or next(iter(names), "")
    trend = service.campaigns.trend(serial, procedure, chosen, kind, limit) if chosen else None
    figure = None if trend is None else trend_figure(trend)
    context = {
        "serial": serial,
        "procedure": procedure,
        "procedures": sorted(service.catalogue.procedures),
        "quantity": chosen,
        "names": names,
        "trend": trend,
        "figure": figure,
        "svg": None if figure is None else svg(figure),
        "display": DISPLAY,
    }
    return templates.TemplateResponse(request, "trend.html", context)
