"""A recording as a row and back. Knows the two shapes only; no transaction begins here."""

from datetime import datetime

import numpy as np
from pydantic import TypeAdapter

from bench_service.mapping import copied
from bench_service.model.raw_data import RawState
from bench_service.model.records import NewRecording, RecordingState, StoredRecording
from bench_service.persistence.tables.evidence import NAMES_JOIN, RecordingRow
from procedures.core.measured import Measured
from procedures.core.recording import Channel, RecordingInfo, Station

CHANNELS = TypeAdapter(tuple[Channel, ...])
STATION = TypeAdapter(Station)
MEASURED = TypeAdapter(Measured)


def station_of_row(row: RecordingRow) -> Station | None:
    """Return the station of a recording from its row; None for a recording without one."""
    return None if row.station is None else STATION.validate_python(row.station)


def info_of_row(row: RecordingRow) -> RecordingInfo:
    """Return the description of a recording from its row; an imported one is named by its first file."""
    return copied(
        RecordingInfo,
        row,
        name=(row.file_names or "").partition(NAMES_JOIN)[0],
        channels=CHANNELS.validate_python(row.channels),
        count=row.samples,
        station=station_of_row(row),
        measured=None if row.measured is None else MEASURED.validate_python(row.measured),
    )


def stored_of_row(row: RecordingRow) -> StoredRecording:
    """Convert a row to its recording."""
    info, state = info_of_row(row), RecordingState(row.state)
    return copied(StoredRecording, row, info=info, state=state, dtype=row.sample_type, raw=RawState(row.raw))


def row_of_new(new: NewRecording, recording_id: str, created_at: datetime, chunk_rows: int) -> RecordingRow:
    """Return the row of a recording before its first sample."""
    return copied(
        RecordingRow,
        new,
        id=recording_id,
        state=RecordingState.OPEN.value,
        created_at=created_at,
        chunk_rows=chunk_rows,
        station_index=None if new.station is None else new.station.index,
        station=None if new.station is None else STATION.dump_python(new.station, mode="json"),
        station_label=None if new.station is None else new.station.label,
        file_names=NAMES_JOIN.join(file["name"] for file in new.source.get("files", ())) or None,
        channels=CHANNELS.dump_python(new.channels, mode="json"),
        sample_type=np.dtype(new.dtype).name,
        samples=0,
        chunks=0,
        stored_bytes=0,
        content_hash="",
        checkpoint=None,
        raw=RawState.STORED.value,
        raw_changed_at=None,
        archive=None,
        measured=None,
    )
