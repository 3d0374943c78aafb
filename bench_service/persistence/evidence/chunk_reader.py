"""Reading the chunks of one recording again, each checked against the hash it was stored with.

Knows where a sample lies: all chunks but the last have the same number of samples. Must not know what samples mean.
"""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

from sqlalchemy import select

from bench_service.formats.chunk import UnreadableChunk, decode_chunk
from bench_service.model.errors import DamagedRecording
from bench_service.persistence.database import Database, connect
from bench_service.persistence.evidence.raw_places import payload_elsewhere
from bench_service.persistence.tables.evidence import ChunkRow
from procedures.core.recording import RawArray


@dataclass(frozen=True)
class ChunkReader:
    """Reads the chunks of one recording; each is a short transaction of its own, and checked against its hash."""

    database: Database
    recording_id: str
    chunk_rows: int

    def __reduce__(self) -> tuple[object, tuple[str, str, int]]:
        """On its way to another process of the service a reader has the database's address, not its connections."""
        url = self.database.engine.url.render_as_string(hide_password=False)
        return _reopened, (url, self.recording_id, self.chunk_rows)

    def blocks(self, names: Sequence[str], start: int, stop: int) -> Iterator[RawArray]:
        """Yield samples start…stop (half open) of the named channels, a chunk at a time, in shape (n, channels). Raises
        `DamagedRecording`, naming the chunk.
        """
        if stop <= start:
            return
        for number in range(start // self.chunk_rows, (stop - 1) // self.chunk_rows + 1):
            first = number * self.chunk_rows
            block = self._block(number, names)
            expected = min(self.chunk_rows, stop - first)
            if len(block) < expected:
                raise self._failure(number, f"has {len(block)} samples, {expected} at least are wanted")
            yield block[max(0, start - first) : expected]

    def _block(self, number: int, names: Sequence[str]) -> RawArray:
        query = select(ChunkRow.payload, ChunkRow.sha256).where(
            ChunkRow.recording_id == self.recording_id, ChunkRow.number == number
        )
        with self.database.read() as session:
            row = session.execute(query).one_or_none()
        if row is None:
            raise self._failure(number, "is missing")
        payload, sha256 = row
        if not payload:
            payload = payload_elsewhere(self.database, self.recording_id, number, sha256)
        elif hashlib.sha256(payload).hexdigest() != sha256:
            raise self._failure(number, "is damaged: its bytes do not have the hash they were stored with")
        try:
            return decode_chunk(payload, names)
        except UnreadableChunk as error:
            raise self._failure(number, f"cannot be read: {error}") from error

    def _failure(self, number: int, what: str) -> DamagedRecording:
        first, last = number * self.chunk_rows, (number + 1) * self.chunk_rows - 1
        return DamagedRecording(
            f"chunk {number} of recording {self.recording_id} {what}; its samples, {first} to {last} at the most, are "
            "lost here. Samples before and after it can be exported by start_s and stop_s; a copy of the database from "
            "before the damage has them all"
        )


def _reopened(url: str, recording_id: str, chunk_rows: int) -> ChunkReader:
    return ChunkReader(_opened(url), recording_id, chunk_rows)


@lru_cache(maxsize=1)
def _opened(url: str) -> Database:
    """The database, opened once; it is closed with the process."""
    return connect(url)
