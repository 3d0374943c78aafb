"""Recordings: what there is, the samples out, and a recorded file in."""

from typing import Annotated

from fastapi import APIRouter, File, Form, Query, Request, Response, UploadFile
from fastapi.exceptions import RequestValidationError
from fastapi.responses import StreamingResponse
from pydantic import ValidationError

from bench_service.api.bodies import refuse_unfit
from bench_service.api.dependencies import After, IdempotencyKey, Limit, Service
from bench_service.api.errors import made, problems
from bench_service.api.schemas import RecordingPage, RecordingView
from bench_service.formats.description import ImportDescription
from bench_service.formats.export import ExportFormat, export, extract
from bench_service.formats.import_file import ImportFile
from bench_service.formats.plain_json import shown
from procedures.core.errors import BadParameter

router = APIRouter(prefix="/api/v1/recordings", tags=["recordings"])

DATA: dict[int | str, dict[str, object]] = {
    200: {
        "description": "The raw samples; scale, offset and unit of each channel travel with them",
        "content": {form.media_type.split(";")[0]: {"schema": {"type": "string"}} for form in ExportFormat},
    }
}


@router.get("", responses=problems())
def list_recordings(
    service: Service,
    job: Annotated[str | None, Query(max_length=100)] = None,
    unit: Annotated[str | None, Query(max_length=100)] = None,
    after: After = None,
    limit: Limit = 50,
) -> RecordingPage:
    """Recordings, newest first."""
    page = service.stores.recordings.list(job_id=job, unit=unit, after=after, limit=limit)
    return RecordingPage(items=[RecordingView.of(r) for r in page.items], next=page.next)


@router.get("/{recording_id}", responses=problems(404))
def read_recording(recording_id: str, service: Service) -> RecordingView:
    """One recording with its channels, its hash and the results that used it."""
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
    """The raw samples, whole or by channel and time, streamed: nothing is held in memory, however long it is."""
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
    "", status_code=201, responses={**problems(409, 507), **made(201, "recording_id", "read_recording", "read_data")}
)
def import_recording(
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
    info = service.analyses.import_recording(parts, wanted, key)
    response.headers["Location"] = f"/api/v1/recordings/{info.id}"
    return RecordingView.of(service.stores.recordings.get(info.id))
