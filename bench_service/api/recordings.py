"""Routes of recordings: list them, export samples, and import a recorded file."""

from datetime import datetime
from typing import Annotated, Any

from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter, File, Form, Query, Request, Response, UploadFile
from fastapi.exceptions import RequestValidationError
from fastapi.responses import StreamingResponse
from pydantic import BaseModel, Field, ValidationError

from bench_service.api.http.bodies import refuse_unfit
from bench_service.api.http.dependencies import After, IdempotencyKey, Limit, Service
from bench_service.api.http.errors import made, problems
from bench_service.api.http.queries import Searched
from bench_service.formats.description import ImportDescription
from bench_service.formats.export import ExportFormat, export, extract
from bench_service.formats.import_file import ImportFile
from bench_service.formats.plain_json import shown
from bench_service.mapping import copied
from bench_service.model.records import RecordingState, StoredRecording
from bench_service.service import BenchService
from procedures.core.errors import BadParameter
from procedures.core.measured import Measured
from procedures.core.recording import Channel, Station

router = APIRouter(prefix="/api/v1/recordings", tags=["recordings"])


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
    measured: Measured | None = Field(description="Means of encoders and supply meanwhile; null: they were not read")
    content_hash: str = Field(description="SHA-256 of samples and channel description, whatever the chunks")
    simulated: bool
    stored_bytes: int
    chunks: int
    created_at: datetime
    source: dict[str, Any] = Field(
        description="Of an import: files, description, and `clock`, what its stamps say. Of a bench with a bench file: "
        "`origin` (real, mixed or simulated) and `devices`, with identities and certificates"
    )
    warnings: list[str] = Field(description="Of an import: what was found in the file that a person should know")
    results: list[str] | None = Field(None, description="Results that used it; only where one recording is asked for")

    @classmethod
    def of(cls, stored: StoredRecording, results: tuple[str, ...] | None = None) -> "RecordingView":
        warnings = [str(warning) for warning in stored.source.get("warnings", ())]
        return copied(cls, stored, stored.info, job=stored.job_id, warnings=warnings, results=results)


class RecordingPage(BaseModel):
    """One page of recordings, newest first."""

    items: list[RecordingView]
    next: str | None


BYTES = {"type": "string", "format": "binary"}
DATA: dict[int | str, dict[str, object]] = {
    200: {
        "description": "The raw samples; scale, offset and unit of each channel travel with them",
        "content": {
            form.media_type.split(";")[0]: {"schema": {"type": "string", "format": "binary"}} for form in ExportFormat
        },
    }
}


@router.get("", responses=problems())
def list_recordings(
    service: Service,
    search: Searched,
    job: Annotated[str | None, Query(max_length=100)] = None,
    unit: Annotated[str | None, Query(max_length=100)] = None,
    simulated: bool | None = None,
    after: After = None,
    limit: Limit = 50,
) -> RecordingPage:
    """List the recordings, newest first."""
    page = service.stores.recordings.list(
        job_id=job, unit=unit, simulated=simulated, search=search, after=after, limit=limit
    )
    return RecordingPage(items=[RecordingView.of(r) for r in page.items], next=page.next)


@router.get("/{recording_id}", responses=problems(404))
def read_recording(recording_id: str, service: Service) -> RecordingView:
    """Read one recording with its channels, its hash and the results that used it."""
    stored = service.stores.recordings.get(recording_id)
    return RecordingView.of(stored, service.stores.results.of_recording(recording_id))


@router.get("/{recording_id}/data", response_class=StreamingResponse, responses={**problems(404), **DATA})
def read_data(
    recording_id: str,
    service: Service,
    form: Annotated[ExportFormat, Query(alias="format")] = ExportFormat.ARROW,
    channels: Annotated[str | None, Query(max_length=4000, description="Names, separated by commas")] = None,
    start_s: Annotated[float | None, Query(ge=0, allow_inf_nan=False, description="From the first sample")] = None,
    stop_s: Annotated[float | None, Query(ge=0, allow_inf_nan=False, description="Not included")] = None,
) -> StreamingResponse:
    """Stream the raw samples, whole or by channel and time; none are held in memory, however long the recording."""
    recordings = service.stores.recordings
    stored = recordings.get(recording_id)
    names = None if channels is None else channels.split(",")
    part = extract(stored.info, stored.dtype, names, start_s, stop_s)
    blocks = recordings.read(recording_id, [c.name for c in part.info.channels], part.start, part.stop)
    file_name = f"{recording_id}.{form.value}"
    return StreamingResponse(
        export(part, blocks, form),
        media_type=form.media_type,
        headers={"Content-Disposition": f'attachment; filename="{file_name}"'},
    )


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
        list[UploadFile], File(description="CSV or other delimited text, gzipped or not, Parquet or Arrow")
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
    limit: int = request.app.state.max_import_bytes
    size = sum(file.size or 0 for file in files)
    if size > limit:
        raise BadParameter("files", f"{size} bytes", f"at most {limit} bytes (BENCH_MAX_IMPORT_MB)")
    parts = [ImportFile(shown(file.filename or f"file {number}"), file.file) for number, file in enumerate(files)]
    # Readers of files wait for one another in threads of their own: those that answer everything else stay free.
    limiter: CapacityLimiter = request.app.state.import_threads
    stored = await to_thread.run_sync(_imported, service, parts, wanted, key, limiter=limiter)
    response.headers["Location"] = f"/api/v1/recordings/{stored.info.id}"
    return RecordingView.of(stored)


def _imported(
    service: BenchService, files: list[ImportFile], description: ImportDescription, key: str | None
) -> StoredRecording:
    info = service.imports.import_recording(files, description, key)
    return service.stores.recordings.get(info.id)
