"""The place of a recording's raw data, looked up where a chunk is not in the database."""

from sqlalchemy import select

from bench_service.model.errors import DamagedRecording, NotFound, RawDataRemoved
from bench_service.model.raw_data import GONE, RawState
from bench_service.persistence.archive.chunks import archived_chunk
from bench_service.persistence.database import Database
from bench_service.persistence.tables.evidence import RecordingRow


def require_raw(row: RecordingRow) -> None:
    """Check that the raw data of a recording were not removed. Raises `RawDataRemoved`."""
    if RawState(row.raw) in GONE:
        at = "" if row.raw_changed_at is None else f" on {row.raw_changed_at.date().isoformat()}"
        raise RawDataRemoved(
            f"the raw data of recording {row.id} were removed by a retention rule{at}; its description, its content "
            f"hash ({row.content_hash}) and the results made from it stay: GET /api/v1/recordings/{row.id}"
        )


def payload_elsewhere(database: Database, recording_id: str, number: int, sha256: str) -> bytes:
    """Return the bytes of a chunk that is empty in the database, from the archive and checked against its hash.

    The place is looked up now, not when the reader was opened: the data may have moved meanwhile. Raises `NotFound`,
    `RawDataRemoved`, `ArchiveAway`, `DamagedRecording`.
    """
    with database.read() as session:
        row = session.scalar(select(RecordingRow).where(RecordingRow.id == recording_id))
        if row is None:
            raise NotFound("recording", recording_id)
        require_raw(row)
        place = row.archive
    if place is None:
        raise DamagedRecording(f"chunk {number} of recording {recording_id} is empty, and no archive has it")
    return archived_chunk(place, recording_id, number, sha256)
