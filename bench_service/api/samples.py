"""Routes that export samples for other tools: those of one recording, and those of a whole job as one zip."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from enum import StrEnum
from typing import Annotated, Any

from anyio import to_thread
from fastapi import Query
from fastapi.responses import StreamingResponse

from bench_service.api.http.admitted_stream import AdmittedStream, place_in_turn
from bench_service.api.http.dependencies import Service
from bench_service.api.http.errors import binary, problems
from bench_service.api.http.job_numbers import JobByNumber
from bench_service.api.recordings import EXPORTS
from bench_service.evidence.recordings import require_undamaged
from bench_service.evidence.samples import treatment_of
from bench_service.formats.chunk import RAW_BYTES
from bench_service.formats.export import Extract, extract, require_samples
from bench_service.formats.samples_out.archive import archived
from bench_service.formats.samples_out.mcap_file import BEGAN
from bench_service.formats.samples_out.naming import file_stem
from bench_service.formats.samples_out.sheet import LARGEST_FACTOR, Sheet, Treatment, physical_sheet, raw_sheet
from bench_service.formats.samples_out.sheet_files import SheetFormat, written
from bench_service.model.errors import NotFound
from bench_service.model.records import StoredRecording
from bench_service.routing import Routes
from bench_service.service import BenchService
from procedures.core.errors import BadParameter

router = Routes(prefix="/api/v1", tags=["recordings"])

HELD = {SheetFormat.MATLAB: 32}
"""Memory that an export holds, by format, in raw bytes of a chunk; a .mat file is held as a whole."""
BYTES: dict[str, object] = {"schema": {"type": "string", "format": "binary"}}
DATA: dict[int | str, dict[str, object]] = {
    200: {"description": "A file in the format that was asked for", "content": {"application/octet-stream": BYTES}}
}
ZIP: dict[int | str, dict[str, object]] = {
    200: {"description": "A zip with a file a recording and manifest.json", "content": binary("application/zip")}
}


class Values(StrEnum):
    """Kind of exported values: in SI units, or raw as they are stored."""

    PHYSICAL = "physical"
    RAW = "raw"


FileForm = Annotated[SheetFormat, Query(alias="format", description="feather is Arrow's file, arrow its stream")]
Wanted = Annotated[Values, Query(description="physical: SI, increments over the sample period; raw: as stored")]
CorrectedBy = Annotated[
    str | None,
    Query(
        max_length=300,
        description="Ids of calibrations, at most one a triad, and of temperature corrections, at most one of each "
        "kind, which come first; separated by commas",
    ),
]
Decimate = Annotated[int, Query(ge=1, le=LARGEST_FACTOR, description="Samples that one mean is taken over")]


@router.get(
    "/recordings/{recording_id}/samples", response_class=StreamingResponse, responses={**problems(404, 409), **DATA}
)
async def read_samples(
    recording_id: str,
    service: Service,
    form: FileForm = SheetFormat.CSV,
    values: Wanted = Values.PHYSICAL,
    corrected_by: CorrectedBy = None,
    decimate: Decimate = 1,
    channels: Annotated[str | None, Query(max_length=4000, description="Names, separated by commas")] = None,
    start_s: Annotated[
        float | None, Query(ge=0, allow_inf_nan=False, description="Time from the first sample [s]")
    ] = None,
    stop_s: Annotated[
        float | None, Query(ge=0, allow_inf_nan=False, description="Time from the first sample [s], not included")
    ] = None,
) -> StreamingResponse:
    """Stream a recording's samples with a column of time, in SI with units in the names, or raw.

    Refused with 409 where a stored sample of that part is damaged, and with 503 where too many others wait.
    """
    names = None if channels is None else channels.split(",")

    def begun() -> tuple[str, Iterator[bytes]]:
        stored = service.stores.recordings.get(recording_id)
        treatment = treatment_of(service.stores, stored.info.unit, corrected_by, decimate)
        part = extract(stored.info, stored.dtype, names, start_s, stop_s, stored.origin)
        require_samples(part, start_s, stop_s)
        file_name = f"{_stem(part, values, treatment)}.{form.value}"
        return file_name, written(_dated(stored, _sheet(service, part, values, treatment)), form)

    return await _admitted(begun, form, "application/octet-stream")


@router.get(
    "/jobs/{job_id}/samples",
    response_class=StreamingResponse,
    responses={**problems(404, 409), **ZIP},
    dependencies=[JobByNumber],
)
async def read_samples_of_job(
    job_id: str,
    service: Service,
    form: FileForm = SheetFormat.CSV,
    values: Wanted = Values.PHYSICAL,
    corrected_by: CorrectedBy = None,
    decimate: Decimate = 1,
) -> StreamingResponse:
    """Stream all complete recordings of a job as one zip, with a manifest that has the SHA-256 of each file."""

    def begun() -> tuple[str, Iterator[bytes]]:
        job = service.stores.jobs.get(job_id)
        stored = service.stores.recordings.of_job(job_id)
        if not stored:
            raise NotFound("recording", job_id, "the job has no complete recording")
        parts = [extract(one.info, one.dtype, origin=one.origin) for one in stored]
        treatments = [treatment_of(service.stores, part.info.unit, corrected_by, decimate) for part in parts]
        asked = zip(stored, parts, treatments, strict=True)
        made = [_dated(one, _sheet(service, part, values, how)) for one, part, how in asked]
        files = [
            (f"{number:03d}-{_stem(part, values, how)}.{form.value}", written(sheet, form), _facts(one, sheet))
            for number, (one, part, how, sheet) in enumerate(zip(stored, parts, treatments, made, strict=True), start=1)
        ]
        about = {"job": job.id, "procedure": job.procedure, "unit": job.unit, "values": values.value}
        return f"{job_id}-{values.value}.zip", archived(files, about)

    return await _admitted(begun, form, "application/zip")


def _stem(part: Extract, values: Values, treatment: Treatment) -> str:
    """Name of a file of samples without its ending, which tells how they were treated."""
    how = [values.value, *(["corrected"] if treatment.calibrations or treatment.corrections else [])]
    return file_stem(part, *how, *([f"means{treatment.decimate}"] if treatment.decimate > 1 else []))


def _sheet(service: BenchService, part: Extract, values: Values, treatment: Treatment) -> Sheet:
    """The sheet of a part. Raises `DamagedRecording`, `BadParameter`."""
    recordings, recording_id = service.stores.recordings, part.info.id
    require_undamaged(recordings, recording_id, part.start, part.stop)
    blocks = recordings.read(recording_id, [c.name for c in part.info.channels], part.start, part.stop)
    if values is Values.PHYSICAL:
        return physical_sheet(part, blocks, treatment)
    if treatment != Treatment():
        raise BadParameter("values", values.value, "physical: raw samples are neither corrected nor decimated")
    return raw_sheet(part, blocks)


def _dated(one: StoredRecording, sheet: Sheet) -> Sheet:
    """The sheet with the moment at which the service began to record, where that is the time of a real bench."""
    if one.job_id is None or one.info.simulated:
        return sheet
    return replace(sheet, about={**sheet.about, BEGAN: one.created_at.isoformat()})


def _facts(one: StoredRecording, sheet: Sheet) -> dict[str, Any]:
    """Facts of a file in a manifest: those of the recording, its columns, and the unit of each column's numbers."""
    units = {column.name: column.unit_of_numbers for column in sheet.columns}
    return {
        "recording_facts": dict(sheet.about),
        "rows": sheet.rows,
        "units": units,
        "columns": [{"name": column.name, **column.attributes} for column in sheet.columns],
        "channels": len(one.info.channels),
    }


async def _admitted(
    begun: Callable[[], tuple[str, Iterator[bytes]]], form: SheetFormat, media_type: str
) -> StreamingResponse:
    """A stream that has its place among heavy requests; what is refused is refused before its first byte.

    `begun`: returns the name of the file and its bytes.
    """
    give_back = await place_in_turn(EXPORTS, RAW_BYTES * HELD.get(form, 8))
    try:
        name, content = await to_thread.run_sync(begun)
        stream = AdmittedStream(
            content,
            media_type=media_type,
            headers={"Content-Disposition": f'attachment; filename="{name}"'},
        )
    except BaseException:
        give_back()
        raise
    stream.give_back = give_back
    return stream
