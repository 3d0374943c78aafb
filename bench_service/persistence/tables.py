"""The tables. Knows SQL types only; what rows mean is written in the ports (`bench_service.jobs`).

Documents are JSON, not JSONB, on Postgres too: they come back with their own order of keys and spelling of numbers, the
same on both databases, and nothing searches inside them. Ids sort by time, so every list is an index walk.
"""

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import (
    JSON,
    BigInteger,
    DateTime,
    Dialect,
    Float,
    ForeignKey,
    Index,
    LargeBinary,
    MetaData,
    String,
    text,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column
from sqlalchemy.types import TypeDecorator


class UtcDateTime(TypeDecorator[datetime]):
    """A moment with its time zone, stored and returned as UTC on every database."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"{value!r} has no time zone")
        return value.astimezone(UTC)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


Document = JSON(none_as_null=True)
Id = String().with_variant(String(collation="C"), "postgresql")
"""Compared byte by byte, whatever the database's language."""


class Table(DeclarativeBase):
    """Root of all tables."""

    metadata = MetaData(
        naming_convention={
            "ix": "ix_%(table_name)s_%(column_0_N_name)s",
            "uq": "uq_%(table_name)s_%(column_0_N_name)s",
            "fk": "fk_%(table_name)s_%(column_0_N_name)s_%(referred_table_name)s",
            "pk": "pk_%(table_name)s",
        }
    )
    type_annotation_map = {  # noqa: RUF012  read once by SQLAlchemy
        datetime: UtcDateTime,
        dict[str, Any]: Document,
        list[Any]: Document,
    }


class UnitRow(Table):
    __tablename__ = "units"

    serial: Mapped[str] = mapped_column(Id, primary_key=True)
    document: Mapped[dict[str, Any]]
    updated_at: Mapped[datetime]


class BenchRow(Table):
    __tablename__ = "benches"

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    document: Mapped[dict[str, Any]]
    updated_at: Mapped[datetime]


class BenchStopRow(Table):
    """A bench that was stopped and not released yet."""

    __tablename__ = "bench_stops"

    bench: Mapped[str] = mapped_column(Id, primary_key=True)
    at: Mapped[datetime]
    reason: Mapped[str]
    safe_at: Mapped[datetime | None]
    safe_by: Mapped[str]


class JobRow(Table):
    __tablename__ = "jobs"
    __table_args__ = (
        Index("ix_jobs_state_id", "state", "id"),
        Index("ix_jobs_procedure_id", "procedure", "id"),
        Index("ix_jobs_unit_id", "unit", "id"),
        Index("ix_jobs_bench_state_priority_queued_at_id", "bench", "state", "priority", "queued_at", "id"),
        Index("ix_jobs_finished_at_id", "finished_at", "id"),
    )

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    procedure: Mapped[str]
    procedure_version: Mapped[str]
    unit: Mapped[str]
    bench: Mapped[str]
    state: Mapped[str]
    created_at: Mapped[datetime]
    requested_parameters: Mapped[dict[str, Any]]
    parameters: Mapped[dict[str, Any]]
    context: Mapped[dict[str, Any]]
    stations: Mapped[list[Any]]
    duration_s: Mapped[float] = mapped_column(Float(53))
    code_version: Mapped[str]
    simulated: Mapped[bool]
    seed: Mapped[int | None] = mapped_column(BigInteger)
    priority: Mapped[int]
    labels: Mapped[dict[str, Any]]
    verdict: Mapped[str | None]
    stations_done: Mapped[int]
    cancel_requested: Mapped[bool]
    pause_requested: Mapped[bool]
    attempt: Mapped[int]
    deadline_at: Mapped[datetime | None]
    queued_at: Mapped[datetime] = mapped_column(nullable=True)
    """Never NULL; to say so of a table that is there, SQLite would have to copy it."""
    not_before: Mapped[datetime | None]
    retries: Mapped[int]
    retries_left: Mapped[int]
    reservation: Mapped[str | None] = mapped_column(Id)
    requested_by: Mapped[str]
    prompt: Mapped[dict[str, Any] | None] = mapped_column(Document)
    started_at: Mapped[datetime | None]
    finished_at: Mapped[datetime | None]
    result_id: Mapped[str | None] = mapped_column(Id)
    failure: Mapped[dict[str, Any] | None] = mapped_column(Document)


class EventRow(Table):
    __tablename__ = "events"

    job_id: Mapped[str] = mapped_column(Id, ForeignKey("jobs.id"), primary_key=True)
    sequence: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    at: Mapped[datetime]
    kind: Mapped[str]
    data: Mapped[dict[str, Any]]


class RecordingRow(Table):
    __tablename__ = "recordings"
    __table_args__ = (
        Index("ix_recordings_job_id_id", "job_id", "id"),
        Index("ix_recordings_unit_id", "unit", "id"),
        Index("ix_recordings_state_stored_bytes", "state", "stored_bytes"),
        Index(
            "uq_recordings_complete_station",
            "job_id",
            "station_index",
            unique=True,
            sqlite_where=text("state = 'complete'"),
            postgresql_where=text("state = 'complete'"),
        ),
    )

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    unit: Mapped[str]
    bench: Mapped[str | None]
    job_id: Mapped[str | None] = mapped_column(Id, ForeignKey("jobs.id"))
    station_index: Mapped[int | None]
    station: Mapped[dict[str, Any] | None] = mapped_column(Document)
    channels: Mapped[list[Any]]
    rate_hz: Mapped[float] = mapped_column(Float(53))
    start_s: Mapped[float] = mapped_column(Float(53))
    launched_s: Mapped[float | None] = mapped_column(Float(53))
    sample_type: Mapped[str]
    samples: Mapped[int] = mapped_column(BigInteger)
    chunk_rows: Mapped[int]
    chunks: Mapped[int]
    stored_bytes: Mapped[int] = mapped_column(BigInteger)
    content_hash: Mapped[str]
    simulated: Mapped[bool]
    state: Mapped[str]
    created_at: Mapped[datetime]
    source: Mapped[dict[str, Any]]
    checkpoint: Mapped[dict[str, Any] | None] = mapped_column(Document)


class ChunkRow(Table):
    __tablename__ = "chunks"

    recording_id: Mapped[str] = mapped_column(Id, ForeignKey("recordings.id"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    start_sample: Mapped[int] = mapped_column(BigInteger)
    samples: Mapped[int]
    sha256: Mapped[str]
    payload: Mapped[bytes] = mapped_column(LargeBinary)


class ResultRow(Table):
    __tablename__ = "results"
    __table_args__ = (Index("ix_results_job_id_id", "job_id", "id"), Index("ix_results_unit_id", "unit", "id"))

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    kind: Mapped[str]
    name: Mapped[str]
    version: Mapped[str]
    parameters: Mapped[dict[str, Any]]
    document: Mapped[dict[str, Any]]
    verdict: Mapped[str]
    code_version: Mapped[str]
    simulated: Mapped[bool]
    created_at: Mapped[datetime]
    unit: Mapped[str | None]
    job_id: Mapped[str | None] = mapped_column(Id, ForeignKey("jobs.id"))
    seed: Mapped[int | None] = mapped_column(BigInteger)
    context: Mapped[dict[str, Any]]


class ResultRecordingRow(Table):
    __tablename__ = "result_recordings"
    __table_args__ = (Index("ix_result_recordings_recording_id", "recording_id"),)

    result_id: Mapped[str] = mapped_column(Id, ForeignKey("results.id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    recording_id: Mapped[str] = mapped_column(Id, ForeignKey("recordings.id"))
    content_hash: Mapped[str]


class ResultQuantityRow(Table):
    """A number of a result under its name, out of its document: a trend over many results reads no document."""

    __tablename__ = "result_quantities"

    result_id: Mapped[str] = mapped_column(Id, ForeignKey("results.id"), primary_key=True)
    name: Mapped[str] = mapped_column(Id, primary_key=True)
    value: Mapped[float] = mapped_column(Float(53))
    unit: Mapped[str]
    standard_uncertainty: Mapped[float | None] = mapped_column(Float(53))


class CalibrationRow(Table):
    __tablename__ = "calibrations"
    __table_args__ = (
        Index("ix_calibrations_unit_id", "unit", "id"),
        Index(
            "uq_calibrations_current_unit",
            "unit",
            unique=True,
            sqlite_where=text("is_current"),
            postgresql_where=text("is_current"),
        ),
    )

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    unit: Mapped[str]
    result_id: Mapped[str] = mapped_column(Id, ForeignKey("results.id"))
    made_at: Mapped[datetime]
    is_current: Mapped[bool]
    triads: Mapped[list[Any]]
    simulated: Mapped[bool]


class ResultCalibrationRow(Table):
    __tablename__ = "result_calibrations"
    __table_args__ = (Index("ix_result_calibrations_calibration_id", "calibration_id"),)

    result_id: Mapped[str] = mapped_column(Id, ForeignKey("results.id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    calibration_id: Mapped[str] = mapped_column(Id, ForeignKey("calibrations.id"))


class IdempotencyKeyRow(Table):
    """A client's key, what was asked with it, and the id of what it made."""

    __tablename__ = "idempotency_keys"

    key: Mapped[str] = mapped_column(Id, primary_key=True)
    kind: Mapped[str]
    fingerprint: Mapped[str]
    made_id: Mapped[str] = mapped_column(Id)
    created_at: Mapped[datetime]
