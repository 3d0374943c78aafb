"""Routes of the HTML pages: benches with their activity, jobs, results, units."""

from contextlib import suppress
from typing import Any

from fastapi import Request
from fastapi.responses import HTMLResponse

from bench_service.bench.directory import certificates_due
from bench_service.formats.calibration_exports.forms import CalibrationForm
from bench_service.jobs.numbers import job_id_of
from bench_service.jobs.reservation import reservation_of_bench
from bench_service.model.errors import NotFound
from bench_service.model.job import FINAL, Event, Job, JobState
from bench_service.model.records import StoredResult
from bench_service.pages.corrections import correction_table
from bench_service.pages.images import SHELF
from bench_service.pages.rendering import service_of, templates
from bench_service.routing import Routes
from bench_service.service import BenchService
from bench_service.wall_clock import now
from procedures.core.imu_model import COEFFICIENT_NAMES
from procedures.core.recording import TRIADS
from procedures.core.report import Figure
from procedures.core.unit import Unit
from procedures.core.units import DISPLAY, NOISE_DISPLAY

router = Routes(include_in_schema=False, default_response_class=HTMLResponse)

SHOWN_EVENTS = 300
"""Number of a job's latest events that its page lists."""
SHOWN_UNITS = 20
"""Number of units that the first page lists, those that a bench has before the others."""
SHOWN_SOURCES = 20
"""Number of an analysis's recordings that its page lists by name."""
_VERBS = {
    JobState.QUEUED: (("pause", "Pause"), ("cancel", "Cancel")),
    JobState.RUNNING: (("pause", "Pause"), ("cancel", "Cancel")),
    JobState.PAUSED: (("resume", "Resume"), ("cancel", "Cancel")),
    JobState.INTERRUPTED: (("resume", "Resume"), ("cancel", "Cancel")),
}
"""Actions that a person can take on a job, by its state."""


def _page(request: Request, name: str, **context: Any) -> HTMLResponse:
    return templates.TemplateResponse(request, name, context)


def _reported(service: BenchService, result: StoredResult) -> dict[str, Any]:
    """Result with its report: tables as they are, figures with the address of their image."""
    report = service.catalogue.report(result)
    sections: list[dict[str, Any]] = []
    number = 0
    for section in report.sections:
        if isinstance(section, Figure):
            number += 1
            version = SHELF.put(section, service.code_version)
            sections.append(
                {"figure": section, "number": number, "image": f"/results/{result.id}/figures/{number}.svg?v={version}"}
            )
        else:
            sections.append({"table": section})
    return {"result": result, "report": report, "sections": sections, "sources": _sources(service, result)}


def _sources(service: BenchService, result: StoredResult) -> list[dict[str, Any]]:
    """Recordings of an analysis by the numbers that its report gives them, with their names; none of a job's result."""
    if result.job_id is not None:
        return []
    sources: list[dict[str, Any]] = []
    for number, (recording_id, _) in enumerate(result.recordings[:SHOWN_SOURCES], start=1):
        with suppress(NotFound):  # removed since
            stored = service.stores.recordings.get(recording_id)
            station = stored.info.station
            name = f"{station.index}: {station.label}" if station else stored.file_name
            sources.append({"number": number, "id": recording_id, "name": name})
    return sources


def _noise_rows(unit: Unit) -> list[list[str]]:
    """Noise coefficients, one row for each channel, in the units people read, a dash for what is absent."""
    rows: list[list[str]] = []
    for triad, rate_unit in (("gyro", "rad/s"), ("accelerometer", "m/s^2")):
        record = unit.triad(triad)
        found = zip(TRIADS[triad], record.observed_noise, strict=True) if record else ()
        for name, noise in found:
            cells = [
                f"{value / size:.4g} {label}" if (value := getattr(noise, process)) else "–"
                for process, (label, size) in NOISE_DISPLAY[rate_unit].items()
            ]
            rows.append([name, *cells, record.noise_origin if record else ""])
    return rows


def _explanation(job: Job) -> str:
    """Explain a job's state in a sentence for the page."""
    nothing = "The bench was made safe first: the table at rest, the unit off."
    if job.state is JobState.PAUSED:
        return (
            f"Put aside. {nothing} Other jobs may use it; resumed, this one goes on with station {job.stations_done}."
        )
    if job.state is JobState.INTERRUPTED:
        return (
            "The service could not go on with it. Its recordings are kept; resumed, it goes on. Whether the bench is "
            "safe now, the bench's own page says."
        )
    if job.state is JobState.RUNNING and job.cancel_requested:
        return "It is being cancelled: the bench is not free before it is safe."
    if job.state is JobState.RUNNING and job.pause_requested:
        return "It pauses before its next station."
    if job.state is JobState.RUNNING:
        return "It drives the bench."
    if job.state is JobState.QUEUED:
        return "It waits for the bench. Nothing of it moves."
    return ""


def _notes(events: tuple[Event, ...]) -> list[dict[str, Any]]:
    """Remarks of people about a job, and who cancelled it and why."""
    notes: list[dict[str, Any]] = []
    for event in events:
        said = event.data
        if event.kind == "note" and (said.get("cancel_requested") or "text" in said):
            text = said.get("reason", said.get("text", ""))
            cancel = bool(said.get("cancel_requested"))
            notes.append({"at": event.at, "by": said.get("by", ""), "text": text, "cancel": cancel})
        elif event.kind == "answer" and not said.get("done", True):
            notes.append({"at": event.at, "by": said.get("by", ""), "text": said.get("remark", ""), "cancel": True})
    return notes


@router.get("/")
def home(request: Request) -> HTMLResponse:
    """Return the HTML page of the benches, their units and the latest jobs."""
    service = service_of(request)
    queued = service.stores.queue.lengths()
    serials = service.stores.units.serials()
    testable = service.benches.testable(serials)
    first = sorted(serials, key=lambda serial: serial not in testable)[:SHOWN_UNITS]
    return _page(
        request,
        "home.html",
        benches=[
            {
                "bench": service.benches.description(bench_id),
                "running": service.jobs.running_job(bench_id),
                "safety": service.safety.known(bench_id),
                "stops": service.stores.benches.standing_stops(bench_id),
                "driven": service.benches.driven(bench_id),
                "queued": queued.get(bench_id, 0),
                "reserved": reservation_of_bench(service.stores.reservations, bench_id, now()),
                "certificates": certificates_due(service.benches.description(bench_id), now()),
            }
            for bench_id in service.benches.ids()
        ],
        jobs=service.stores.jobs.list(limit=20).items,
        units=sorted(service.stores.units.units(first), key=lambda unit: unit.serial not in testable),
        unit_count=len(serials),
        testable=testable,
    )


@router.get("/jobs/{job_id}")
def job_page(job_id: str, request: Request) -> HTMLResponse:
    """Return the HTML page of a job: progress, stations, recordings, and its result once there is one. Raises
    `NotFound`.
    """
    service = service_of(request)
    job_id = job_id_of(service.stores, job_id)
    last_event, _ = service.stores.jobs.last_event(job_id)  # before the job: what comes later reloads the page
    job = service.stores.jobs.get(job_id)
    live = service.live.of_job(job)
    with suppress(NotFound):  # left out of the catalogue: the page shows its name
        service.catalogue.procedure(job.procedure)
    stations = max(1, len(job.stations))
    result = service.stores.results.get(job.result_id) if job.result_id else None
    events = service.stores.jobs.events(job_id, max(0, last_event - SHOWN_EVENTS), SHOWN_EVENTS)
    return _page(
        request,
        "job.html",
        job=job,
        open=job.state not in FINAL or job.resumable,
        verbs=(("resume", "Resume"),) if job.state is JobState.FAILED and job.resumable else _VERBS.get(job.state, ()),
        explanation=_explanation(job),
        standing=service.queues.standing([job])[job.id],
        last_event=last_event,
        events=events,
        notes=_notes(events),
        live=live,
        fraction=job.stations_done / stations if live is None else live.fraction,
        recordings=service.stores.recordings.of_job(job_id),
        **(_reported(service, result) if result else {"result": None}),
    )


@router.get("/results/{result_id}")
def result_page(result_id: str, request: Request) -> HTMLResponse:
    """Return the HTML page of a result: verdict, checks, tables, plots, lineage. Raises `NotFound`."""
    service = service_of(request)
    result = service.stores.results.get(result_id)
    numbers = service.stores.jobs.numbers([result.job_id] if result.job_id else [])
    return _page(request, "result.html", numbers=numbers, **_reported(service, result))


@router.get("/units/{serial}")
def unit_page(serial: str, request: Request) -> HTMLResponse:
    """Return the HTML page of a unit: its record, its calibrations and its correction sets. Raises `NotFound`."""
    service = service_of(request)
    unit = service.stores.units.unit(serial)
    return _page(
        request,
        "unit.html",
        unit=unit,
        testable=serial in service.benches.testable([serial]),
        noise=_noise_rows(unit),
        calibrations=service.stores.calibrations.list(serial).items,
        corrections=[(c, correction_table(c.correction)) for c in service.stores.corrections.list(serial).items],
        jobs=service.stores.jobs.list(unit=serial).items,
        notes=service.stores.unit_notes.list(serial).items,
        imports=[r for r in service.stores.recordings.list(unit=serial).items if r.job_id is None],
        names=COEFFICIENT_NAMES,
        display=DISPLAY,
        forms=[form.value for form in CalibrationForm],
    )
