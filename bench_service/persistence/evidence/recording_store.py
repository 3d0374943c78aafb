"""Raw samples in SQL: rows that describe a recording, chunks that hold it. Must not know which job records, or why."""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import bindparam, delete, select
from sqlalchemy.orm import Session

from bench_service.evidence.recordings import DamagedChunk
from bench_service.formats.chunk import sample_type
from bench_service.formats.content_hash import hash_of_blocks
from bench_service.model.errors import DamagedRecording, NotFound
from bench_service.model.records import NewRecording, Page, RecordingState, StoredRecording
from bench_service.model.search import EVERYTHING, Search
from bench_service.persistence.database import Database
from bench_service.persistence.evidence.chunk_check import damaged_chunks
from bench_service.persistence.evidence.chunk_reader import ChunkReader
from bench_service.persistence.evidence.raw_places import require_raw
from bench_service.persistence.evidence.recording_rows import info_of_row, stored_of_row
from bench_service.persistence.evidence.recording_writer import SqlRecordingWriter
from bench_service.persistence.paging import page
from bench_service.persistence.searching import find_recordings
from bench_service.persistence.tables.evidence import ChunkRow, RecordingRow
from bench_service.persistence.text_search import ways_to_recordings
from procedures.core.recording import RawArray, RecordingInfo

log = logging.getLogger(__name__)

_OPEN = RecordingState.OPEN.value
_COMPLETE = RecordingState.COMPLETE.value
_OF_JOB = (
    select(RecordingRow)
    .where(RecordingRow.job_id == bindparam("job"), RecordingRow.state == _COMPLETE)
    .order_by(RecordingRow.station_index, RecordingRow.id)
)


@dataclass(frozen=True)
class StoredSamples:
    """Implementation of `procedures.core.recording.Recording` over the database: each pass reads the chunks again."""

    info: RecordingInfo
    _reader: ChunkReader

    def blocks(self) -> Iterator[RawArray]:
        """Yield the raw samples in order, a chunk at a time."""
        return self.since(0)

    def only(self, names: Sequence[str]) -> "StoredSamples":
        """Return some of the channels, in that order; the others are not decoded. Raises `MissingChannel`."""
        return StoredSamples(self.info.only(names), self._reader)

    def since(self, start: int) -> Iterator[RawArray]:
        """Yield the raw samples from sample `start` on, in order, a chunk at a time."""
        return self._reader.blocks([c.name for c in self.info.channels], start, self.info.count)


class SqlRecordingStore:
    """SQL implementation of `bench_service.evidence.recordings.RecordingStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def open(self, new: NewRecording) -> SqlRecordingWriter:
        return SqlRecordingWriter(self._database, new)

    def get(self, recording_id: str) -> StoredRecording:
        with self._database.read() as session:
            return stored_of_row(_found(session, recording_id))

    def list(
        self,
        *,
        job_id: str | None = None,
        unit: str | None = None,
        simulated: bool | None = None,
        search: Search = EVERYTHING,
        after: str | None = None,
        limit: int = 50,
    ) -> Page[StoredRecording]:
        query = find_recordings(select(RecordingRow).where(RecordingRow.state != _OPEN), search)
        if job_id is not None:
            query = query.where(RecordingRow.job_id == job_id)
        if unit is not None:
            query = query.where(RecordingRow.unit == unit)
        if simulated is not None:
            query = query.where(RecordingRow.simulated == simulated)
        with self._database.read() as session:
            either = None if search.text is None else ways_to_recordings(session, search.text)
            return page(session, query, RecordingRow.id, after, limit, stored_of_row, either)

    def of_job(self, job_id: str) -> tuple[StoredRecording, ...]:
        with self._database.read() as session:
            return tuple(stored_of_row(row) for row in session.scalars(_OF_JOB, {"job": job_id}))

    def load(self, recording_id: str, name: str = "") -> StoredSamples:
        with self._database.read() as session:
            row = _found(session, recording_id)
            require_raw(row)
            info = info_of_row(row)
            return StoredSamples(replace(info, name=name) if name else info, self._reader(row))

    def read(
        self, recording_id: str, channels: Sequence[str] | None, start: int, stop: int
    ) -> Iterator[NDArray[np.int32] | NDArray[np.float64]]:
        """Yield samples of the named channels (None: all), see `RecordingStore.read`; `start` and `stop` beyond the
        ends are taken as the ends.
        """
        with self._database.read() as session:
            row = _found(session, recording_id)
            require_raw(row)
            info = info_of_row(row)
            reader = self._reader(row)
        names = [c.name for c in info.channels] if channels is None else list(channels)
        for name in names:
            info.column(name)
        return reader.blocks(names, max(0, start), min(stop, info.count))

    def so_far(self, job_id: str) -> StoredSamples | None:
        query = select(RecordingRow).where(RecordingRow.job_id == job_id, RecordingRow.state == _OPEN)
        with self._database.read() as session:
            row = session.scalars(query.order_by(RecordingRow.created_at.desc()).limit(1)).first()
            return None if row is None or not row.samples else StoredSamples(info_of_row(row), self._reader(row))

    def damage(self, recording_id: str, start: int, stop: int) -> Iterator[DamagedChunk]:
        with self._database.read() as session:
            row = _found(session, recording_id)
            require_raw(row)
            rows, count = row.chunk_rows, row.samples
        return damaged_chunks(self._database, recording_id, rows, max(0, start), min(stop, count))

    def checkpoint(self, job_id: str) -> dict[str, Any] | None:
        query = (
            select(RecordingRow.checkpoint)
            .where(RecordingRow.job_id == job_id, RecordingRow.state == _COMPLETE)
            .order_by(RecordingRow.station_index.desc())  # ids follow the clock, which may have been set back
            .limit(1)
        )
        with self._database.read() as session:
            return session.scalar(query)

    def interrupt_open(self, job_id: str) -> int:
        query = select(RecordingRow.id).where(RecordingRow.job_id == job_id, RecordingRow.state == _OPEN)
        with self._database.read() as session:
            left_open = tuple(session.scalars(query))
        for recording_id in left_open:
            self._interrupt(recording_id)
        return len(left_open)

    def discard_open_imports(self, before: datetime) -> int:
        """Delete open recordings of crashed imports, begun before a moment and without a job. Return their number."""
        query = select(RecordingRow.id).where(
            RecordingRow.job_id.is_(None), RecordingRow.state == _OPEN, RecordingRow.created_at < before
        )
        with self._database.write() as session:
            left_open = tuple(session.scalars(query))
            session.execute(delete(ChunkRow).where(ChunkRow.recording_id.in_(left_open)))
            session.execute(delete(RecordingRow).where(RecordingRow.id.in_(left_open)))
        return len(left_open)

    def _interrupt(self, recording_id: str) -> None:
        """Close a recording whose writer is gone; the hash is made from the chunks, the writer took its own along.

        A damaged recording gets no hash: the damage must not keep its job from ending.
        """
        with self._database.read() as session:
            row = _found(session, recording_id, with_open=True)
            info, reader, dtype = info_of_row(row), self._reader(row), sample_type(row.sample_type)
        blocks = reader.blocks([c.name for c in info.channels], 0, info.count)
        try:
            content_hash = hash_of_blocks(info.channels, info.rate_hz, dtype, blocks)
        except DamagedRecording as damage:
            log.error("recording %s is closed without a hash: %s", recording_id, damage)
            content_hash = ""
        with self._database.write() as session:
            row = _found(session, recording_id, with_open=True)
            if row.state == _OPEN:
                row.content_hash = content_hash
                row.state = RecordingState.INTERRUPTED.value

    def _reader(self, row: RecordingRow) -> ChunkReader:
        return ChunkReader(self._database, row.id, row.chunk_rows)


def _found(session: Session, recording_id: str, *, with_open: bool = False) -> RecordingRow:
    row = session.get(RecordingRow, recording_id)
    if row is None or (row.state == _OPEN and not with_open):
        raise NotFound("recording", recording_id)
    return row
