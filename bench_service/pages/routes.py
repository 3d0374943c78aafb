"""The pages: what the bench is doing, a job, a result, a unit."""

from pathlib import Path
from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse
from fastapi.templating import Jinja2Templates

from bench_service.jobs.job import FINAL, JobState
from bench_service.jobs.service import BenchService
from bench_service.pages.figures import svg
from procedures.core.imu_model import COEFFICIENT_NAMES
from procedures.core.report import Figure, Report
from procedures.core.units import DISPLAY

router = APIRouter(include_in_schema=False, default_response_class=HTMLResponse)
templates = Jinja2Templates(Path(__file__).parent / "templates")


def number(value: Any) -> str:
    """A cell as a reader wants it: six significant digits, a dash for what is absent."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


templates.env.filters["number"] = number


def _service(request: Request) -> BenchService:
    return request.app.state.service


def _page(request: Request, name: str, **context: Any) -> HTMLResponse:
    return templates.TemplateResponse(request, name, context)


def _sections(report: Report) -> list[dict[str, Any]]:
    """Tables as they are, figures with their drawing."""
    return [
        {"figure": section, "svg": svg(section)} if isinstance(section, Figure) else {"table": section}
        for section in report.sections
    ]


@router.get("/")
def home(request: Request) -> HTMLResponse:
    """The bench, its units, the latest jobs."""
    service = _service(request)
    return _page(
        request,
        "home.html",
        bench=service.driver.description,
        running=service.running_job(),
        jobs=service.stores.jobs.list(limit=50).items,
        units=service.stores.units.units(),
    )


@router.get("/jobs/{job_id}")
def job_page(job_id: str, request: Request) -> HTMLResponse:
    """A job: progress, stations, recordings, and its result once there is one."""
    service = _service(request)
    job = service.stores.jobs.get(job_id)
    result = service.stores.results.get(job.result_id) if job.result_id else None
    return _page(
        request,
        "job.html",
        job=job,
        open=job.state not in FINAL and job.state is not JobState.INTERRUPTED,
        recordings=service.stores.recordings.of_job(job_id),
        result=result,
        sections=_sections(service.report(result)) if result else [],
        report=service.report(result) if result else None,
    )


@router.get("/results/{result_id}")
def result_page(result_id: str, request: Request) -> HTMLResponse:
    """A result: verdict, checks, tables, plots, lineage."""
    service = _service(request)
    result = service.stores.results.get(result_id)
    report = service.report(result)
    return _page(request, "result.html", result=result, report=report, sections=_sections(report))


@router.get("/units/{serial}")
def unit_page(serial: str, request: Request) -> HTMLResponse:
    """A unit: its record and its calibrations."""
    service = _service(request)
    return _page(
        request,
        "unit.html",
        unit=service.stores.units.unit(serial),
        calibrations=service.stores.results.calibrations(serial).items,
        jobs=service.stores.jobs.list(unit=serial).items,
        names=COEFFICIENT_NAMES,
        display=DISPLAY,
    )
