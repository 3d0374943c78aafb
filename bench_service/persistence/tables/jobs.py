"""SQL tables of jobs, their events, reservations, and idempotency keys."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, Float, ForeignKey, Index
from sqlalchemy.orm import Mapped, mapped_column

from bench_service.persistence.tables.columns import Document, Id, Table


class JobRow(Table):
    __tablename__ = "jobs"
    __table_args__ = (
        Index("ix_jobs_state_id", "state", "id"),
        Index("ix_jobs_procedure_id", "procedure", "id"),
        Index("ix_jobs_unit_id", "unit", "id"),
        Index("ix_jobs_bench_state_priority_queued_at_id", "bench", "state", "priority", "queued_at", "id"),
        Index("ix_jobs_finished_at_id", "finished_at", "id"),
        Index("ix_jobs_verdict_id", "verdict", "id"),
        Index("ix_jobs_bench_id", "bench", "id"),
        Index("ix_jobs_requested_by_id", "requested_by", "id"),
        Index("ix_jobs_id_procedure_unit_bench_requested_by", "id", "procedure", "unit", "bench", "requested_by"),
        Index("ix_jobs_result_id_id", "result_id", "id"),
        Index("ix_jobs_number", "number", unique=True),
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
    """Time of queueing, never NULL; to declare that in an existing table, SQLite would have to copy it."""
    not_before: Mapped[datetime | None]
    retries: Mapped[int]
    retries_left: Mapped[int]
    reservation: Mapped[str | None] = mapped_column(Id)
    mounting: Mapped[str | None] = mapped_column(Id)
    requested_by: Mapped[str]
    team: Mapped[str] = mapped_column(server_default="")
    prompt: Mapped[dict[str, Any] | None] = mapped_column(Document)
    started_at: Mapped[datetime | None]
    finished_at: Mapped[datetime | None]
    result_id: Mapped[str | None] = mapped_column(Id)
    failure: Mapped[dict[str, Any] | None] = mapped_column(Document)
    number: Mapped[int] = mapped_column(nullable=True)
    """Short number, never NULL; to declare that in an existing table, SQLite would have to copy it."""


class JobLabelRow(Table):
    """A label of a job, copied from its document: a search by label reads no document."""

    __tablename__ = "job_labels"
    __table_args__ = (
        Index("ix_job_labels_name_value_job_id", "name", "value", "job_id"),
        Index("ix_job_labels_name_job_id", "name", "job_id"),
    )

    job_id: Mapped[str] = mapped_column(Id, ForeignKey("jobs.id"), primary_key=True)
    name: Mapped[str] = mapped_column(Id, primary_key=True)
    value: Mapped[str] = mapped_column(Id)


class EventRow(Table):
    __tablename__ = "events"

    job_id: Mapped[str] = mapped_column(Id, ForeignKey("jobs.id"), primary_key=True)
    sequence: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    at: Mapped[datetime]
    kind: Mapped[str]
    data: Mapped[dict[str, Any]]


class ReservationRow(Table):
    """A reservation of a unit or a bench."""

    __tablename__ = "reservations"
    __table_args__ = (Index("ix_reservations_kind_name", "kind", "name"),)

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    kind: Mapped[str]
    name: Mapped[str] = mapped_column(Id)
    holder: Mapped[str]
    note: Mapped[str]
    team: Mapped[str] = mapped_column(server_default="")
    created_at: Mapped[datetime]
    until: Mapped[datetime]
    ended_at: Mapped[datetime | None]


class IdempotencyKeyRow(Table):
    """A client's idempotency key, the request made with it, and the id of the created object."""

    __tablename__ = "idempotency_keys"

    key: Mapped[str] = mapped_column(Id, primary_key=True)
    kind: Mapped[str]
    fingerprint: Mapped[str]
    made_id: Mapped[str] = mapped_column(Id)
    created_at: Mapped[datetime]
