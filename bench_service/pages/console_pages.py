"""Routes of the pages that are made by scripts over the public API: start, queue, search, recordings, accounts."""

from fastapi import Request
from fastapi.responses import HTMLResponse

from bench_service.pages.rendering import service_of, templates
from bench_service.routing import Routes

router = Routes(include_in_schema=False, default_response_class=HTMLResponse)


def _page(request: Request, name: str, **context: object) -> HTMLResponse:
    return templates.TemplateResponse(request, name, context)


@router.get("/start")
def start_page(request: Request) -> HTMLResponse:
    """Return the HTML page where a job is chosen, previewed and started."""
    return _page(request, "start.html")


@router.get("/jobs")
def jobs_page(request: Request) -> HTMLResponse:
    """Return the HTML page where the history of jobs, recordings and results is searched."""
    return _page(request, "search.html")


@router.get("/queue")
def queue_page(request: Request) -> HTMLResponse:
    """Return the HTML page of the queues: order, priority, and why each job waits."""
    return _page(request, "queue.html", benches=service_of(request).benches.ids())


@router.get("/units")
def units_page(request: Request) -> HTMLResponse:
    """Return the HTML page of all units, with what is known of each."""
    service = service_of(request)
    units = service.stores.units.units()
    return _page(request, "units.html", units=units, testable=service.benches.testable(unit.serial for unit in units))


@router.get("/recordings")
def recordings_page(request: Request) -> HTMLResponse:
    """Return the HTML page of recordings: search, import of files, and methods run on chosen ones."""
    return _page(request, "recordings.html")


@router.get("/recordings/{recording_id}")
def recording_page(recording_id: str, request: Request) -> HTMLResponse:
    """Return the HTML page of a recording: its description, and its samples over any stretch."""
    stores = service_of(request).stores
    stored = stores.recordings.get(recording_id)
    numbers = stores.jobs.numbers([stored.job_id] if stored.job_id else [])
    return _page(request, "recording.html", recording=stored, numbers=numbers)


@router.get("/audit")
def audit_page(request: Request) -> HTMLResponse:
    """Return the HTML page of the audit trail, newest entries first."""
    return _page(request, "audit.html")


@router.get("/accounts")
def accounts_page(request: Request) -> HTMLResponse:
    """Return the HTML page of accounts, tokens and approved procedures."""
    return _page(request, "accounts.html")


@router.get("/certificate")
def certificate_page(request: Request) -> HTMLResponse:
    """Return the HTML page where a calibration certificate is checked."""
    return _page(request, "certificate.html")


@router.get("/units/{serial}/calibrations/new")
def enter_calibration_page(serial: str, request: Request) -> HTMLResponse:
    """Return the HTML page where a known calibration is entered. Raises `NotFound` for an unknown unit."""
    return _page(request, "enter_calibration.html", unit=service_of(request).stores.units.unit(serial))
