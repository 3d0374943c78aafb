"""Mountings in SQL. Mountings on one bench, and jobs that begin there, take turns."""

from datetime import datetime

from sqlalchemy import or_, select
from sqlalchemy.orm import Session

from bench_service.mapping import copied
from bench_service.model.errors import BenchBusy, NotFound
from bench_service.model.job import JobState
from bench_service.model.mountings import StoredMounting
from bench_service.model.records import Idempotency, Page
from bench_service.persistence.database import Database
from bench_service.persistence.idempotency import again_after_conflict, made_before, remember
from bench_service.persistence.paging import page
from bench_service.persistence.tables.bench import MountingRow
from bench_service.persistence.tables.jobs import JobRow


class SqlMountingStore:
    """SQL implementation of `bench_service.bench.mountings.MountingStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def add(self, mounting: StoredMounting, idempotency: Idempotency | None = None) -> StoredMounting:
        def once() -> StoredMounting:
            with self._database.write() as session:
                known = made_before(session, idempotency, "mounting")
                if known is not None:
                    return _mounting(_found(session, known))
                self._database.turn_at_bench(session, mounting.bench)
                place = (MountingRow.bench == mounting.bench) & (MountingRow.plate == mounting.plate)
                before = session.scalars(
                    select(MountingRow).where(
                        MountingRow.ended_at.is_(None), or_(MountingRow.unit == mounting.unit, place)
                    )
                ).all()
                _require_idle(session, {mounting.bench, *(row.bench for row in before)})
                for row in before:
                    row.ended_at, row.ended_by = mounting.entered_at, mounting.by
                remember(session, idempotency, "mounting", mounting.id, mounting.entered_at)
                session.add(copied(MountingRow, mounting))
                return mounting

        return again_after_conflict(once)

    def get(self, mounting_id: str) -> StoredMounting:
        with self._database.read() as session:
            return _mounting(_found(session, mounting_id))

    def standing(self, unit: str, bench: str) -> StoredMounting | None:
        query = (
            select(MountingRow)
            .where(MountingRow.unit == unit, MountingRow.bench == bench, MountingRow.ended_at.is_(None))
            .order_by(MountingRow.id.desc())
            .limit(1)
        )
        with self._database.read() as session:
            row = session.scalar(query)
            return None if row is None else _mounting(row)

    def list(
        self,
        *,
        unit: str | None = None,
        bench: str | None = None,
        standing: bool = False,
        after: str | None = None,
        limit: int = 50,
    ) -> Page[StoredMounting]:
        query = select(MountingRow)
        for column, wanted in ((MountingRow.unit, unit), (MountingRow.bench, bench)):
            query = query if wanted is None else query.where(column == wanted)
        if standing:
            query = query.where(MountingRow.ended_at.is_(None))
        with self._database.read() as session:
            return page(session, query, MountingRow.id, after, limit, _mounting)

    def end(self, mounting_id: str, at: datetime, by: str) -> StoredMounting:
        with self._database.write() as session:
            row = _found(session, mounting_id)
            if row.ended_at is None:
                self._database.turn_at_bench(session, row.bench)
                _require_idle(session, {row.bench})
                row.ended_at, row.ended_by = at, by
            return _mounting(row)


def _require_idle(session: Session, benches: set[str]) -> None:
    query = select(JobRow.id, JobRow.bench).where(JobRow.bench.in_(benches), JobRow.state == JobState.RUNNING.value)
    for job, bench in session.execute(query):
        raise BenchBusy(f"job {job} drives bench {bench}: a mounting can be entered after the job has ended")


def _mounting(row: MountingRow) -> StoredMounting:
    return copied(StoredMounting, row)


def _found(session: Session, mounting_id: str) -> MountingRow:
    row = session.get(MountingRow, mounting_id)
    if row is None:
        raise NotFound("mounting", mounting_id)
    return row
