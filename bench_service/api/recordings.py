"""Routes of recordings: list them, export samples, and import a recorded file."""

from datetime import datetime
from typing import Annotated, Any

from anyio import CapacityLimiter, to_thread
from fastapi import File, Form, Query, Request, Response, UploadFile
from fastapi.exceptions import RequestValidationError
from fastapi.responses import StreamingResponse
from pydantic import BaseModel, Field, ValidationError

from bench_service.api.http.admitted_stream import AdmittedStream, place_in_turn
from bench_service.api.http.bodies import refuse_unfit
from bench_service.api.http.dependencies import After, IdempotencyKey, Limit, Service
from bench_service.api.http.errors import made, problems
from bench_service.api.http.queries import Searched
from bench_service.evidence.admission import Places
from bench_service.evidence.recordings import require_undamaged
from bench_service.formats.description import ImportDescription
from bench_service.formats.export import ExportFormat, Extract, export, export_bytes, extract, require_samples
from bench_service.formats.import_request import ImportFile
from bench_service.formats.overview import overview
from bench_service.formats.plain_json import shown
from bench_service.formats.proposal.model import Proposal
from bench_service.formats.samples_out.naming import file_stem
from bench_service.jobs.numbers import job_id_of
from bench_service.mapping import copied
from bench_service.model.raw_data import RawState
from bench_service.model.records import RecordingState, StoredRecording
from bench_service.routing import Routes
from bench_service.service import BenchService
from procedures.core.errors import BadParameter
from procedures.core.measured import Measured
from procedures.core.recording import Channel, Station

router = Routes(prefix="/api/v1/recordings", tags=["recordings"])


class RecordingView(BaseModel):
    """A recording without its samples."""

    id: str
    unit: str
    job: str | None
    bench: str | None
    station: Station | None
    state: RecordingState
    channels: list[Channel]
    rate_hz: float
    count: int
    duration_s: float
    start_s: float
    launched_s: float | None = Field(description="Bench time at which the unit was switched on; null: not known")
    measured: Measured | None = Field(
        description="Means of encoders and supply during the recording; null: they were not read"
    )
    content_hash: str = Field(description="SHA-256 of samples and channel description, whatever the chunks")
    simulated: bool
    stored_bytes: int
    chunks: int
    created_at: datetime
    raw: RawState = Field(description="Where the raw samples are; `removed`: reading them answers 410")
    raw_changed_at: datetime | None = Field(description="When the samples were moved there; null: never moved")
    source: dict[str, Any] = Field(
        description="Import: files, description, and `clock`, what its stamps say. Bench with a bench file: "
        "`origin` (real, mixed or simulated) and `devices`, with identities and certificates"
    )
    warnings: list[str] = Field(description="Findings of the import that a person should know")
    results: list[str] | None = Field(None, description="Results that used it; only where one recording is asked for")

    @classmethod
    def of(cls, stored: StoredRecording, results: tuple[str, ...] | None = None) -> "RecordingView":
        warnings = [str(warning) for warning in stored.source.get("warnings", ())]
        return copied(cls, stored, stored.info, job=stored.job_id, warnings=warnings, results=results)


class RecordingPage(BaseModel):
    """One page of recordings, newest first."""

    items: list[RecordingView]
    next: str | None


EXPORTS = Places("exports", most=8, most_bytes=100_000_000)
"""Places for the exports under way: each holds a chunk of samples and its form in the file."""
BYTES = {"type": "string", "format": "binary"}
TYPES = [form.media_type.split(";")[0] for form in (ExportFormat.NPY, *ExportFormat)]
"""Media types of exports. Bytes come first: generators take the first type that they know, and CSV would be text."""
DATA: dict[int | str, dict[str, object]] = {
    200: {
        "description": "The raw samples; scale, offset and unit of each channel travel with them, but not with `npy`",
        "content": {media_type: {"schema": BYTES} for media_type in TYPES},
    }
}


@router.get("", responses=problems(404))
def list_recordings(
    service: Service,
    search: Searched,
    job: Annotated[
        str | None, Query(max_length=100, description="Only recordings of this job, by id or number")
    ] = None,
    unit: Annotated[str | None, Query(max_length=100)] = None,
    simulated: bool | None = None,
    after: After = None,
    limit: Limit = 50,
) -> RecordingPage:
    """List the recordings, newest first."""
    job_id = None if job is None else job_id_of(service.stores, job)
    page = service.stores.recordings.list(
        job_id=job_id, unit=unit, simulated=simulated, search=search, after=after, limit=limit
    )
    return RecordingPage(items=[RecordingView.of(r) for r in page.items], next=page.next)


@router.get("/{recording_id}", responses=problems(404))
def read_recording(recording_id: str, service: Service) -> RecordingView:
    """Read one recording with its channels, its hash and the results that used it."""
    stored = service.stores.recordings.get(recording_id)
    return RecordingView.of(stored, service.stores.results.of_recording(recording_id))


@router.get("/{recording_id}/data", response_class=StreamingResponse, responses={**problems(404, 409, 410), **DATA})
async def read_data(
    recording_id: str,
    service: Service,
    form: Annotated[ExportFormat, Query(alias="format")] = ExportFormat.ARROW,
    channels: Annotated[str | None, Query(max_length=4000, description="Names, separated by commas")] = None,
    start_s: Annotated[
        float | None, Query(ge=0, allow_inf_nan=False, description="Time from the first sample [s]")
    ] = None,
    stop_s: Annotated[
        float | None, Query(ge=0, allow_inf_nan=False, description="Time from the first sample [s], not included")
    ] = None,
) -> StreamingResponse:
    """Stream the raw samples, whole or by channel and time; none are held in memory, however long the recording.

    Refused with 409 where a stored sample of that part is damaged, and with 503 where too many others wait.
    """
    names = None if channels is None else channels.split(",")
    part = await to_thread.run_sync(_part, service, recording_id, names, start_s, stop_s)
    give_back = await place_in_turn(EXPORTS, export_bytes(form))
    try:
        stream = await to_thread.run_sync(_exported, service, part, form)
    except BaseException:
        give_back()
        raise
    stream.give_back = give_back
    return stream


def _part(
    service: BenchService, recording_id: str, names: list[str] | None, start_s: float | None, stop_s: float | None
) -> Extract:
    stored = service.stores.recordings.get(recording_id)
    part = extract(stored.info, stored.dtype, names, start_s, stop_s, stored.origin)
    require_samples(part, start_s, stop_s)
    return part


def _exported(service: BenchService, part: Extract, form: ExportFormat) -> AdmittedStream:
    recordings, recording_id = service.stores.recordings, part.info.id
    require_undamaged(recordings, recording_id, part.start, part.stop)
    blocks = recordings.read(recording_id, [c.name for c in part.info.channels], part.start, part.stop)
    file_name = f"{file_stem(part)}.{form.value}"
    return AdmittedStream(
        export(part, blocks, form),
        media_type=form.media_type,
        headers={"Content-Disposition": f'attachment; filename="{file_name}"'},
    )


class OverviewChannel(BaseModel):
    """One channel of an overview, one number for each bin."""

    name: str
    unit: str
    minimum: list[float]
    mean: list[float]
    maximum: list[float]


class OverviewView(BaseModel):
    """A stretch of a recording as a plot needs it: values in nominal rate units, in bins of equal length."""

    edges_s: list[float] = Field(description="Edges of the bins since the first sample, one more than there are bins")
    channels: list[OverviewChannel]


@router.get("/{recording_id}/overview", responses=problems(404, 410))
def read_overview(
    recording_id: str,
    service: Service,
    channels: Annotated[str | None, Query(max_length=4000, description="Names, separated by commas")] = None,
    start_s: Annotated[
        float | None, Query(ge=0, allow_inf_nan=False, description="Time from the first sample [s]")
    ] = None,
    stop_s: Annotated[
        float | None, Query(ge=0, allow_inf_nan=False, description="Time from the first sample [s], not included")
    ] = None,
    bins: Annotated[int, Query(ge=1, le=5000)] = 800,
) -> OverviewView:
    """Read least, mean and greatest values of a stretch in bins: what a plot needs, however long the recording."""
    recordings = service.stores.recordings
    stored = recordings.get(recording_id)
    part = extract(stored.info, stored.dtype, None if channels is None else channels.split(","), start_s, stop_s)
    blocks = recordings.read(recording_id, [c.name for c in part.info.channels], part.start, part.stop)
    made = overview(part, blocks, bins)
    shown = [
        OverviewChannel(
            name=channel.name,
            unit=channel.rate_unit,
            minimum=made.minimum[:, k].tolist(),
            mean=made.mean[:, k].tolist(),
            maximum=made.maximum[:, k].tolist(),
        )
        for k, channel in enumerate(part.info.channels)
    ]
    return OverviewView(edges_s=made.edges.tolist(), channels=shown)


@router.post(
    "",
    status_code=201,
    responses={**problems(409, 413, 507), **made(201, "recording_id", "read_recording", "read_data")},
)
async def import_recording(
    request: Request,
    response: Response,
    service: Service,
    files: Annotated[
        list[UploadFile], File(description="Delimited text, gzipped or not, Parquet, Arrow, or a log file")
    ],
    description: Annotated[str, Form(max_length=100_000, description="JSON of an ImportDescription")],
    key: IdempotencyKey = None,
) -> RecordingView:
    """Import recorded files as one recording: checked whole before the first sample is stored, refused with its row."""
    try:
        wanted = ImportDescription.model_validate_json(description)
    except ValidationError as error:
        raise RequestValidationError(
            [{**e, "loc": ("description", *e["loc"])} for e in error.errors(include_url=False, include_context=False)]
        ) from error
    refuse_unfit(wanted.model_dump(mode="json"), "description")
    _require_size(request, files)
    parts = [ImportFile(shown(file.filename or f"file {number}"), file.file) for number, file in enumerate(files)]
    # Readers of files wait for one another in threads of their own: those that answer everything else stay free.
    limiter: CapacityLimiter = request.app.state.import_threads
    stored = await to_thread.run_sync(_imported, service, parts, wanted, key, limiter=limiter)
    response.headers["Location"] = f"/api/v1/recordings/{stored.info.id}"
    return RecordingView.of(stored)


@router.post("/describe", responses=problems(413, 507))
async def describe_file(
    request: Request,
    service: Service,
    file: Annotated[UploadFile, File(description="A recorded file of any format that is read")],
    unit: Annotated[str | None, Form(max_length=100, description="Serial of the unit, where it is known")] = None,
    form: Annotated[
        str | None, Form(alias="format", max_length=40, description="Format, where it is not recognised")
    ] = None,
    table: Annotated[str | None, Form(max_length=1000, description="Table of a log file with several")] = None,
) -> Proposal:
    """Propose a description of a file: format, columns, units, clocks, and what a person has to decide.

    Nothing is stored. The description is one for `POST /api/v1/recordings` once `unknown` is settled.
    """
    _require_size(request, [file])
    limiter: CapacityLimiter = request.app.state.import_threads
    part = ImportFile(shown(file.filename or "file"), file.file)
    return await to_thread.run_sync(service.imports.describe, part, unit, form, table, limiter=limiter)


def _require_size(request: Request, files: list[UploadFile]) -> None:
    """Check the size of files together. Raises `BadParameter`."""
    limit: int = request.app.state.max_import_bytes
    size = sum(file.size or 0 for file in files)
    if size > limit:
        raise BadParameter("files", f"{size} bytes", f"at most {limit} bytes (BENCH_MAX_IMPORT_MB)")


def _imported(
    service: BenchService, files: list[ImportFile], description: ImportDescription, key: str | None
) -> StoredRecording:
    info = service.imports.import_recording(files, description, key)
    return service.stores.recordings.get(info.id)
