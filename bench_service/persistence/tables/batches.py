"""SQL tables of batches of analyses, their tasks, and results by the content that they were made from."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, ForeignKeyConstraint, Index
from sqlalchemy.orm import Mapped, mapped_column

from bench_service.persistence.tables.columns import Document, Id, Table


class BatchRow(Table):
    __tablename__ = "analysis_batches"

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    method: Mapped[str]
    version: Mapped[str]
    parameters: Mapped[dict[str, Any]]
    calibrations: Mapped[list[Any]]
    selection: Mapped[dict[str, Any]]
    each: Mapped[str]
    priority: Mapped[int]
    requested_by: Mapped[str]
    created_at: Mapped[datetime]
    total: Mapped[int]
    cancelled_at: Mapped[datetime | None]
    cancelled_by: Mapped[str]
    ended_at: Mapped[datetime | None]
    final_counts: Mapped[dict[str, Any] | None] = mapped_column(Document)
    """Counts of the tasks by state, once all of them have ended: a list of old batches counts nothing."""


class TaskRow(Table):
    __tablename__ = "analysis_tasks"
    __table_args__ = (
        Index("ix_analysis_tasks_state_priority_batch_id_number", "state", "priority", "batch_id", "number"),
        Index("ix_analysis_tasks_batch_id_state", "batch_id", "state"),
    )

    batch_id: Mapped[str] = mapped_column(Id, ForeignKey("analysis_batches.id"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    state: Mapped[str]
    priority: Mapped[int]
    attempt: Mapped[int]
    worker: Mapped[str]
    claimed_at: Mapped[datetime | None]
    ended_at: Mapped[datetime | None]
    not_before: Mapped[datetime | None]
    result_id: Mapped[str | None] = mapped_column(Id, ForeignKey("results.id"))
    failure: Mapped[dict[str, Any] | None] = mapped_column(Document)


class TaskRecordingRow(Table):
    __tablename__ = "analysis_task_recordings"
    __table_args__ = (
        ForeignKeyConstraint(["batch_id", "number"], ["analysis_tasks.batch_id", "analysis_tasks.number"]),
        Index("ix_analysis_task_recordings_recording_id", "recording_id"),
    )

    batch_id: Mapped[str] = mapped_column(Id, primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    position: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    recording_id: Mapped[str] = mapped_column(Id, ForeignKey("recordings.id"))


class ResultContentRow(Table):
    """The first result of each content digest, over everything that an analysis of a method reads."""

    __tablename__ = "result_contents"

    content: Mapped[str] = mapped_column(Id, primary_key=True)
    result_id: Mapped[str] = mapped_column(Id, ForeignKey("results.id"))
