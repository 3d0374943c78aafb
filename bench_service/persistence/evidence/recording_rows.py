"""A recording as a row and back. Knows the two shapes only; no transaction begins here."""

import numpy as np
from pydantic import TypeAdapter

from bench_service.model.records import NewRecording, RecordingState, StoredRecording
from bench_service.persistence.tables.evidence import RecordingRow
from procedures.core.recording import Channel, RecordingInfo, Station

CHANNELS = TypeAdapter(tuple[Channel, ...])
STATION = TypeAdapter(Station)


def station_of_row(row: RecordingRow) -> Station | None:
    """The station that a recording was made at."""
    return None if row.station is None else STATION.validate_python(row.station)


def info_of_row(row: RecordingRow) -> RecordingInfo:
    """What a recording is, from its row."""
    return RecordingInfo(
        id=row.id,
        unit=row.unit,
        channels=CHANNELS.validate_python(row.channels),
        rate_hz=row.rate_hz,
        count=row.samples,
        start_s=row.start_s,
        station=station_of_row(row),
        content_hash=row.content_hash,
        simulated=row.simulated,
        launched_s=row.launched_s,
    )


def stored_of_row(row: RecordingRow) -> StoredRecording:
    """The recording that a row keeps."""
    return StoredRecording(
        info=info_of_row(row),
        state=RecordingState(row.state),
        created_at=row.created_at,
        job_id=row.job_id,
        bench=row.bench,
        stored_bytes=row.stored_bytes,
        chunks=row.chunks,
        dtype=row.sample_type,
        source=row.source,
    )


def fill_row(row: RecordingRow, new: NewRecording) -> None:
    """What is known of a recording before its first sample."""
    row.unit = new.unit
    row.bench = new.bench
    row.job_id = new.job_id
    row.station_index = None if new.station is None else new.station.index
    row.station = None if new.station is None else STATION.dump_python(new.station, mode="json")
    row.channels = list(CHANNELS.dump_python(new.channels, mode="json"))
    row.rate_hz = new.rate_hz
    row.start_s = new.start_s
    row.launched_s = new.launched_s
    row.sample_type = np.dtype(new.dtype).name
    row.simulated = new.simulated
    row.source = new.source
    row.samples = row.chunks = row.stored_bytes = 0
    row.content_hash = ""
    row.checkpoint = None
