"""Counts for monitoring in SQL: queries that walk along indices, never over whole rows."""

import shutil
from datetime import datetime
from pathlib import Path

from sqlalchemy import func, or_, select

from bench_service.model.job import FINAL
from bench_service.model.raw_data import HERE
from bench_service.model.records import RecordingState
from bench_service.persistence.database import Database
from bench_service.persistence.tables.columns import columns
from bench_service.persistence.tables.evidence import RecordingRow
from bench_service.persistence.tables.jobs import JobRow
from bench_service.telemetry.tallies import Ending

_STATE = JobRow.state.concat("")
"""Not a column: SQLite would take its index, which holds the whole history, for the one of the times."""


class SqlTallyStore:
    """SQL implementation of `bench_service.telemetry.tallies.TallyStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def endings(self, since: datetime | None, after: str, limit: int) -> tuple[Ending, ...]:
        query = (
            select(*columns(JobRow, Ending))
            .where(JobRow.finished_at.is_not(None), _STATE.in_([state.value for state in FINAL]))
            .order_by(JobRow.finished_at, JobRow.id)
            .limit(limit)
        )
        if since is not None:
            later = or_(JobRow.finished_at > since, JobRow.id > after)
            query = query.where(JobRow.finished_at >= since, later)
        with self._database.read() as session:
            return tuple(Ending(*row) for row in session.execute(query))

    def stations_of_open_jobs(self) -> dict[str, int]:
        open_states = ("queued", "running", "paused", "interrupted")
        query = select(JobRow.id, JobRow.stations_done).where(JobRow.state.in_(open_states), JobRow.stations_done > 0)
        with self._database.read() as session:
            return {row.id: row.stations_done for row in session.execute(query)}

    def recorded_bytes(self) -> int:
        listed = (RecordingState.COMPLETE.value, RecordingState.INTERRUPTED.value)
        with self._database.read() as session:
            total = select(func.sum(RecordingRow.stored_bytes)).where(RecordingRow.state.in_(listed))
            found = session.scalar(total.where(RecordingRow.raw.in_([state.value for state in HERE])))
        return int(found or 0)

    def free_bytes(self) -> int | None:
        file = self._database.engine.url.database
        if self._database.is_postgres or not file:
            return None
        return shutil.disk_usage(Path(file).parent).free
