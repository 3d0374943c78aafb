"""A recording while it is made: samples gather to chunks, each committed when it is full and never changed.

Knows when something is committed and what remains when it cannot be. Must not know how chunks are read again.

* Before the first full chunk nothing is in the database. A short dwell is one transaction, at `seal`.
* With the first chunk comes the row, `open`, which no list shows.
* A full chunk is hashed, encoded and committed in a thread, while the next one fills; there is one on its way at most.
  Its failure is raised by the next call. `seal` and `abandon` wait for it: what they leave does not depend on it.
* After a failed `write` the writer can only be abandoned: what a job had committed is then kept as interrupted, an
  import leaves nothing.
* A failed `seal` may be tried again.
"""

import hashlib
import logging
from concurrent.futures import Future
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import delete, insert, select
from sqlalchemy.orm import Session

from bench_service import wall_clock
from bench_service.background import in_background
from bench_service.formats.chunk import ChunkPlace, SampleType, encode_chunk, rows_per_chunk, sample_type
from bench_service.formats.content_hash import ContentHash
from bench_service.model.errors import StorageFailure, StorageFull
from bench_service.model.records import NewRecording, RecordingState
from bench_service.persistence.database import Conflict, Database
from bench_service.persistence.evidence.recording_rows import MEASURED, info_of_row, row_of_new
from bench_service.persistence.idempotency import made_before, remember
from bench_service.persistence.tables.evidence import ChunkRow, RecordingRow
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.measured import Measured
from procedures.core.recording import RawArray, RecordingInfo

log = logging.getLogger(__name__)


class SqlRecordingWriter:
    """SQL implementation of `bench_service.evidence.recordings.RecordingWriter`. It holds two chunks in memory at
    most.
    """

    def __init__(self, database: Database, new: NewRecording) -> None:
        _check(new)
        self.id = wall_clock.new_id()
        self._database = database
        self._new = new
        self._names = tuple(channel.name for channel in new.channels)
        self._dtype: SampleType = sample_type(np.dtype(new.dtype).name)
        self._gaps = new.gaps
        self._created_at = wall_clock.now()
        self._rows = rows_per_chunk(len(self._names), self._dtype)
        self._buffer = _empty(self._rows, len(self._names), self._dtype)
        self._spare: RawArray | None = None
        self._under_way: Future[None] | None = None
        """The chunk that is on its way into the database. Until it is there, what is below it belongs to its thread."""
        self._filled = 0
        self._committed = 0
        self._chunks = 0
        self._hash = ContentHash(new.channels, new.rate_hz, self._dtype)
        self._sealed: RecordingInfo | None = None
        self._closed = False

    def write(self, block: RawArray) -> None:
        """Append samples, shape (n, channels). Raises `UnfitRecording`, and `StorageFull` or `StorageFailure` where
        a chunk before these samples could not be stored.
        """
        self._require_open()
        samples = self._checked(block)
        if self._under_way is not None and self._under_way.done():
            self._arrived()
        taken = 0
        while taken < len(samples):
            size = min(self._rows - self._filled, len(samples) - taken)
            self._buffer[self._filled : self._filled + size] = samples[taken : taken + size]
            self._filled += size
            taken += size
            if self._filled == self._rows:
                self._hand_over()

    def seal(self, checkpoint: dict[str, Any] | None = None, measured: Measured | None = None) -> RecordingInfo:
        """Write the rest and complete the recording. Where the job's station has a complete recording already, its
        description is returned. Raises `UnfitRecording` without a sample, `StorageFull`, `StorageFailure`.

        The second happens when a step is repeated because the process died between its last commit and its note that it
        was done: the first recording stands, this one leaves nothing.
        """
        if self._sealed is not None:
            return self._sealed
        self._require_open()
        self._arrived()
        if self._committed + self._filled == 0:
            raise UnfitRecording("a recording without samples cannot be sealed")
        try:
            self._sealed = self._complete(checkpoint, measured)
        except Conflict:
            first = self._complete_before()
            if first is None:
                raise
            self._discard()
            self._sealed = first
        self._closed = True
        return self._sealed

    def abandon(self) -> None:
        """Close the recording without sealing it. Does not raise: it is called when something failed already."""
        if self._sealed is not None:
            return
        self._closed = True
        if self._under_way is not None:
            self._under_way.exception()
        if not self._chunks:
            return
        try:
            if self._new.job_id is None:
                self._discard()
            else:
                self._interrupt()
        except (StorageFull, StorageFailure) as error:
            log.warning("recording %s stays open and unlisted until it is removed: %s", self.id, error)

    def _require_open(self) -> None:
        if self._closed:
            raise StorageFailure("this recording was closed: after a failed write it can only be abandoned")

    def _hand_over(self) -> None:
        """Begin to store the full buffer, once the chunk before it is stored, and continue in the other buffer."""
        self._arrived()
        full = self._buffer
        self._buffer = _empty(*full.shape, self._dtype) if self._spare is None else self._spare
        self._spare, self._filled = full, 0
        self._under_way = in_background("chunk", partial(self._commit_chunk, full))

    def _arrived(self) -> None:
        """Wait for the chunk that is on its way. Raises its error: after it the writer is closed."""
        under_way, self._under_way = self._under_way, None
        if under_way is not None:
            try:
                under_way.result()
            except BaseException:
                self._closed = True
                raise

    def _commit_chunk(self, samples: RawArray) -> None:
        payload = self._encoded(samples)
        with self._database.write() as session:
            self._add_chunk(session, self._row(session), payload, len(samples))
        self._hash.update(samples)
        self._committed += len(samples)
        self._chunks += 1

    def _complete(self, checkpoint: dict[str, Any] | None, measured: Measured | None) -> RecordingInfo:
        rest, last = self._hash.copy(), self._buffer[: self._filled]
        rest.update(last)
        payload = self._encoded(last) if len(last) else b""
        with self._database.write() as session:
            row = self._row(session)
            if payload:
                self._add_chunk(session, row, payload, len(last))
            row.content_hash = rest.hexdigest()
            row.checkpoint = checkpoint
            row.measured = None if measured is None else MEASURED.dump_python(measured, mode="json")
            row.state = RecordingState.COMPLETE.value
            remember(session, self._new.idempotency, "recording", self.id, self._created_at)
            session.flush()
            return info_of_row(row)

    def _interrupt(self) -> None:
        """Keep the committed chunks, and drop the samples that had not filled a chunk."""
        with self._database.write() as session:
            row = self._row(session)
            row.content_hash = self._hash.hexdigest()
            row.state = RecordingState.INTERRUPTED.value

    def _row(self, session: Session) -> RecordingRow:
        """Return this recording's row, made with its first chunk; still open, unless it was closed in between."""
        if not self._chunks:
            row = row_of_new(self._new, self.id, self._created_at, self._rows)
            session.add(row)
            session.flush()
            return row
        row = session.scalar(select(RecordingRow).where(RecordingRow.id == self.id).with_for_update())
        if row is None or row.state != RecordingState.OPEN.value:
            raise StorageFailure(f"recording {self.id} was closed while it was being written")
        return row

    def _encoded(self, samples: RawArray) -> bytes:
        return encode_chunk(samples, self._names, ChunkPlace(self.id, self._committed, self._new.rate_hz))

    def _add_chunk(self, session: Session, row: RecordingRow, payload: bytes, samples: int) -> None:
        session.execute(
            insert(ChunkRow).values(
                recording_id=self.id,
                number=self._chunks,
                start_sample=self._committed,
                samples=samples,
                sha256=hashlib.sha256(payload).hexdigest(),
                payload=payload,
            )
        )
        row.chunks = self._chunks + 1
        row.samples = self._committed + samples
        row.stored_bytes += len(payload)

    def _complete_before(self) -> RecordingInfo | None:
        """Find the complete recording of the same key, or of the same job and station, if there is one."""
        with self._database.read() as session:
            made = made_before(session, self._new.idempotency, "recording")
            row = None if made is None else session.get(RecordingRow, made)
            if row is not None:
                return info_of_row(row)
        if self._new.job_id is None or self._new.station is None:
            return None
        query = select(RecordingRow).where(
            RecordingRow.job_id == self._new.job_id,
            RecordingRow.station_index == self._new.station.index,
            RecordingRow.state == RecordingState.COMPLETE.value,
        )
        with self._database.read() as session:
            row = session.scalar(query)
            return None if row is None else info_of_row(row)

    def _discard(self) -> None:
        with self._database.write() as session:
            session.execute(delete(ChunkRow).where(ChunkRow.recording_id == self.id))
            session.execute(delete(RecordingRow).where(RecordingRow.id == self.id))

    def _checked(self, block: RawArray) -> RawArray:
        samples: NDArray[Any] = block
        if samples.ndim != 2 or samples.shape[1] != len(self._names):
            raise UnfitRecording(f"a block of shape {samples.shape} was given, (n, {len(self._names)}) is wanted")
        if not np.can_cast(samples.dtype, self._dtype, "safe"):
            raise UnfitRecording(f"samples of type {samples.dtype} do not fit a recording of {self._dtype}")
        if self._dtype.kind == "f":
            unfit = np.isinf(samples) if self._gaps else ~np.isfinite(samples)
            if np.any(unfit):
                raise UnfitRecording("a block has samples that are not finite numbers")
        return block


def _empty(rows: int, columns: int, dtype: SampleType) -> RawArray:
    return np.empty((rows, columns), np.int32) if dtype == np.int32 else np.empty((rows, columns), np.float64)


def _check(new: NewRecording) -> None:
    names = [channel.name for channel in new.channels]
    if not names or len(set(names)) != len(names):
        raise BadParameter("channels", names, "at least one, each with its own name")
    if not (np.isfinite(new.rate_hz) and new.rate_hz > 0):
        raise BadParameter("rate_hz", new.rate_hz, "a positive number")
    if np.dtype(new.dtype) not in (np.dtype(np.int32), np.dtype(np.float64)):
        raise BadParameter("dtype", str(new.dtype), "int32 or float64")
