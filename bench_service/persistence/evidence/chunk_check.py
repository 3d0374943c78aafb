"""Check of a recording's stored chunks against the hashes that they were stored with, without decoding a sample."""

import hashlib
from collections.abc import Iterator

from sqlalchemy import select

from bench_service.evidence.recordings import DamagedChunk
from bench_service.model.errors import DamagedDatabase, DamagedRecording
from bench_service.persistence.database import Database
from bench_service.persistence.evidence.raw_places import payload_elsewhere
from bench_service.persistence.tables.evidence import ChunkRow

ALTERED = "its bytes do not have the hash that they were stored with"
MISSING = "it is missing"


def damaged_chunks(
    database: Database, recording_id: str, chunk_rows: int, start: int, stop: int
) -> Iterator[DamagedChunk]:
    """Yield the damaged chunks that hold samples start…stop (half open); each chunk is a short transaction.

    All chunks but the last have `chunk_rows` samples.
    """
    if stop <= start:
        return
    for number in range(start // chunk_rows, (stop - 1) // chunk_rows + 1):
        why = _fault(database, recording_id, number)
        if why:
            yield DamagedChunk(number, number * chunk_rows, min(stop, (number + 1) * chunk_rows), why)


def _fault(database: Database, recording_id: str, number: int) -> str:
    query = select(ChunkRow.payload, ChunkRow.sha256).where(
        ChunkRow.recording_id == recording_id, ChunkRow.number == number
    )
    try:
        with database.read() as session:
            row = session.execute(query).one_or_none()
    except DamagedDatabase as error:
        return str(error)
    if row is None:
        return MISSING
    if not row.payload:
        try:
            payload_elsewhere(database, recording_id, number, row.sha256)
        except DamagedRecording as error:
            return str(error)
        return ""
    return "" if hashlib.sha256(row.payload).hexdigest() == row.sha256 else ALTERED
