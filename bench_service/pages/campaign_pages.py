"""Routes of the campaign pages: the overview, a run step by step, a quantity's trend."""

from urllib.parse import quote, urlencode

from fastapi import Request
from fastapi.responses import HTMLResponse

from bench_service.campaigns.run import CampaignRun, StepState
from bench_service.model.job import JobState
from bench_service.pages.images import SHELF
from bench_service.pages.rendering import service_of, templates
from bench_service.pages.trend_chart import TrendQuery, trend_of, wanted_trend
from bench_service.routing import Routes
from procedures.core.units import DISPLAY

router = Routes(include_in_schema=False, default_response_class=HTMLResponse)


def _explanation(run: CampaignRun) -> str:
    """Explain a run's state in a sentence for the page."""
    if run.waiting:
        return f"It waits: {run.waiting}."
    if run.state is JobState.QUEUED:
        return "It begins as soon as a process that drives the bench looks at it."
    if run.cancel_requested and run.open:
        return "It is being cancelled: its job ends first, and the bench is not free before it is safe."
    return run.reason


@router.get("/campaigns")
def campaigns_page(request: Request) -> HTMLResponse:
    """Return the HTML page of campaigns, schedules and the latest runs."""
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
    """Return the HTML page of a campaign run: its steps, their results, and the reason that it waits for."""
    stores = service_of(request).stores
    run = stores.campaigns.run(run_id)
    jobs = [job for step in run.steps for job in (step.job_id, *step.earlier_jobs) if job]
    missed = {step.name: [c for c in step.checks if not c.passed] for step in run.steps}
    done = sum(s.finished_at is not None or s.state is StepState.SKIPPED for s in run.steps)
    context = {
        "run": run,
        "missed": missed,
        "explanation": _explanation(run),
        "done": done,
        "numbers": stores.jobs.numbers(jobs),
    }
    return templates.TemplateResponse(request, "campaign_run.html", context)


@router.get("/units/{serial}/trend")
def trend_page(serial: str, request: Request, query: TrendQuery) -> HTMLResponse:
    """Return the HTML page of a quantity's trend over the unit's results; without a quantity, the list of those to
    choose from.
    """
    service = service_of(request)
    choice = wanted_trend(service, serial, query)
    chart = trend_of(service, serial, choice)
    image = None
    if chart.figure is not None:
        version = SHELF.put(chart.figure, service.code_version)
        asked = {"procedure": query.procedure, "quantity": choice.quantity, "limit": query.limit}
        asked |= {"simulated": str(choice.simulated).lower(), "v": version}
        image = f"/units/{quote(serial, safe='')}/trend.svg?{urlencode(asked)}"
    context = {
        "serial": serial,
        "procedure": query.procedure,
        "procedures": sorted(service.catalogue.procedures),
        "quantity": choice.quantity,
        "names": choice.names,
        "trend": chart.trend,
        "figure": chart.figure,
        "image": image,
        "display": DISPLAY,
    }
    return templates.TemplateResponse(request, "trend.html", context)
