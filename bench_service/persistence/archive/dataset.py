"""The archive as a Parquet dataset: copies of chunks, and tables of units, recordings, results and quantities.

`samples/recording=ID/chunk-N.parquet` has the raw counts, one column a channel; `tables/NAME/*.parquet` what they mean.
Rows that never change are added in parts, each named by its last id; units and recordings are written again.
"""

import hashlib
import io
import json
from collections.abc import Callable, Sequence
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from bench_service.model.errors import ArchiveAway, DamagedRecording, NotFound
from bench_service.model.raw_data import RawState
from bench_service.persistence.archive.chunks import archived_chunk, chunk_name
from bench_service.persistence.archive.places import place_at
from bench_service.persistence.database import Database
from bench_service.persistence.slices import in_parts
from bench_service.persistence.tables.evidence import (
    ChunkRow,
    RecordingRow,
    ResultQuantityRow,
    ResultRecordingRow,
    ResultRow,
    UnitRow,
)
from bench_service.persistence.tables.jobs import JobRow

PART = 20_000
"""Results in one part of a table."""
TEXT, NUMBER, INTEGER, TRUTH, MOMENT = "string", "float64", "int64", "bool", "moment"
"""Types of columns."""
UNITS = {"serial": TEXT, "updated_at": MOMENT, "document": TEXT}
RECORDINGS = {
    "id": TEXT, "unit": TEXT, "bench": TEXT, "job": TEXT, "procedure": TEXT, "verdict": TEXT, "station": TEXT,
    "rate_hz": NUMBER, "start_s": NUMBER, "samples": INTEGER, "sample_type": TEXT, "chunks": INTEGER,
    "content_hash": TEXT, "simulated": TRUTH, "created_at": MOMENT, "raw": TEXT, "channels": TEXT, "source": TEXT,
}  # fmt: skip
CHUNKS = {
    "recording": TEXT,
    "number": INTEGER,
    "start_sample": INTEGER,
    "samples": INTEGER,
    "sha256": TEXT,
    "file": TEXT,
}
RESULTS = {
    "id": TEXT, "kind": TEXT, "name": TEXT, "version": TEXT, "verdict": TEXT, "unit": TEXT, "job": TEXT,
    "code_version": TEXT, "simulated": TRUTH, "created_at": MOMENT, "parameters": TEXT, "document": TEXT,
}  # fmt: skip
QUANTITIES = {"result": TEXT, "name": TEXT, "value": NUMBER, "unit": TEXT, "standard_uncertainty": NUMBER}
LINEAGE = {"result": TEXT, "position": INTEGER, "recording": TEXT, "content_hash": TEXT}
Rows = list[dict[str, Any]]


class ParquetArchive:
    """Archive as a Parquet dataset in a folder or an S3-compatible store. Implements
    `bench_service.evidence.raw_data.store.Archive`.
    """

    def __init__(self, database: Database, address: str) -> None:
        self._database = database
        self.place = address

    def copy(self, recording_id: str) -> None:
        place = place_at(self.place)
        query = select(ChunkRow.number, ChunkRow.sha256).where(ChunkRow.recording_id == recording_id)
        with self._database.read() as session:
            wanted = session.scalar(select(RecordingRow.chunks).where(RecordingRow.id == recording_id))
            chunks = session.execute(query.order_by(ChunkRow.number)).all()
        if wanted is None:
            raise NotFound("recording", recording_id)
        if len(chunks) != wanted:
            raise DamagedRecording(f"recording {recording_id} has {len(chunks)} of its {wanted} chunks: not archived")
        for number, sha256 in chunks:
            with self._database.read() as session:
                payload = session.scalar(
                    select(ChunkRow.payload).where(ChunkRow.recording_id == recording_id, ChunkRow.number == number)
                )
            if payload is None or hashlib.sha256(payload).hexdigest() != sha256:
                raise DamagedRecording(f"chunk {number} of recording {recording_id} is damaged: it is not archived")
            place.write(chunk_name(recording_id, number), payload)
            archived_chunk(self.place, recording_id, number, sha256)  # read back, before anything here is emptied

    def write_tables(self) -> None:
        with self._database.read() as session:
            self._write("units/all", UNITS, [_unit(row) for row in session.scalars(select(UnitRow))])
        self._archived()
        self._added("results", RESULTS, _results)
        self._added("quantities", QUANTITIES, _quantities)
        self._added("result_recordings", LINEAGE, _lineage)

    def _archived(self) -> None:
        """Write recordings and chunks whose samples are here: a part for each that has none yet."""
        states = (RawState.ARCHIVING.value, RawState.ARCHIVED.value)
        archived = select(RecordingRow.id).where(RecordingRow.raw.in_(states), RecordingRow.archive == self.place)
        with self._database.read() as session:
            ids = session.scalars(archived.order_by(RecordingRow.id)).all()
            known = {name.removesuffix(".parquet") for name in place_at(self.place).names("tables/recordings")}
        written = {one for name in known for one in _ids_of(self.place, name)}
        new = [one for one in ids if one not in written]
        for first in range(0, len(new), PART):
            part = new[first : first + PART]
            with self._database.read() as session:
                self._write(f"chunks/{part[-1]}", CHUNKS, _chunks(session, part))
                self._write(f"recordings/{part[-1]}", RECORDINGS, _recordings(session, part))

    def _added(self, table: str, columns: dict[str, str], rows: Callable[[Session, Sequence[str]], Rows]) -> None:
        """Add the rows of results that are newer than the newest part."""
        key = ResultRow.id
        names = place_at(self.place).names(f"tables/{table}")
        after = names[-1].removesuffix(".parquet") if names else ""
        while True:
            with self._database.read() as session:
                ids = session.scalars(select(key).where(key > after).order_by(key).limit(PART)).all()
                if not ids:
                    return
                self._write(f"{table}/{ids[-1]}", columns, rows(session, ids))
            after = ids[-1]

    def _write(self, name: str, columns: dict[str, str], rows: Rows) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        schema = pa.schema([(column, _type(kind)) for column, kind in columns.items()])
        sink = io.BytesIO()
        pq.write_table(pa.Table.from_pylist(rows, schema=schema), sink, compression="zstd")
        place_at(self.place).write(f"tables/{name}.parquet", sink.getvalue())


def _type(kind: str) -> Any:
    """The type of pyarrow by its name."""
    import pyarrow as pa

    return pa.timestamp("us", tz="UTC") if kind == MOMENT else getattr(pa, "bool_" if kind == TRUTH else kind)()


def _ids_of(address: str, part: str) -> list[str]:
    """Ids of the recordings in a part of their table. Raises `ArchiveAway`."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    content = place_at(address).read(f"tables/recordings/{part}.parquet")
    try:
        return pq.read_table(pa.BufferReader(content), columns=["id"]).column("id").to_pylist()
    except (OSError, pa.ArrowException) as error:
        raise ArchiveAway(f"{address}: tables/recordings/{part}.parquet cannot be read: {error}") from error


def _unit(row: UnitRow) -> dict[str, Any]:
    return {"serial": row.serial, "updated_at": row.updated_at, "document": json.dumps(row.document)}


def _recordings(session: Session, ids: Sequence[str]) -> Rows:
    rows: Rows = []
    for part in in_parts(ids):
        query = select(RecordingRow, JobRow.procedure, JobRow.verdict).outerjoin(
            JobRow, JobRow.id == RecordingRow.job_id
        )
        for row, procedure, verdict in session.execute(query.where(RecordingRow.id.in_(part))):
            station = None if row.station is None else row.station.get("label")
            given = {"job": row.job_id, "procedure": procedure, "verdict": verdict, "station": station}
            documents = {"channels": json.dumps(row.channels), "source": json.dumps(row.source)}
            rows.append({name: getattr(row, name, None) for name in RECORDINGS} | given | documents)
    return rows


def _chunks(session: Session, ids: Sequence[str]) -> Rows:
    columns = (ChunkRow.recording_id, ChunkRow.number, ChunkRow.start_sample, ChunkRow.samples, ChunkRow.sha256)
    return [
        dict(zip(CHUNKS, (*row, chunk_name(row.recording_id, row.number)), strict=True))
        for part in in_parts(ids)
        for row in session.execute(select(*columns).where(ChunkRow.recording_id.in_(part)))
    ]


def _results(session: Session, ids: Sequence[str]) -> Rows:
    rows: Rows = []
    for part in in_parts(ids):
        for row in session.scalars(select(ResultRow).where(ResultRow.id.in_(part))):
            documents = {"parameters": json.dumps(row.parameters), "document": json.dumps(row.document)}
            rows.append({name: getattr(row, name, None) for name in RESULTS} | {"job": row.job_id} | documents)
    return rows


def _quantities(session: Session, ids: Sequence[str]) -> Rows:
    kept = ResultQuantityRow
    columns = (kept.result_id, kept.name, kept.value, kept.unit, kept.standard_uncertainty)
    return [
        dict(zip(QUANTITIES, row, strict=True))
        for part in in_parts(ids)
        for row in session.execute(select(*columns).where(kept.result_id.in_(part)))
    ]


def _lineage(session: Session, ids: Sequence[str]) -> Rows:
    used = ResultRecordingRow
    columns = (used.result_id, used.position, used.recording_id, used.content_hash)
    return [
        dict(zip(LINEAGE, row, strict=True))
        for part in in_parts(ids)
        for row in session.execute(select(*columns).where(used.result_id.in_(part)))
    ]
