"""Reports of upkeep in SQL: checks of the database and copies of it."""

from datetime import datetime

from sqlalchemy import select, update

from bench_service.mapping import copied
from bench_service.model.records import Page
from bench_service.persistence.database import Database
from bench_service.persistence.paging import page
from bench_service.persistence.tables.telemetry import UpkeepRow
from bench_service.telemetry.upkeep import UpkeepKind, UpkeepReport


class SqlUpkeepStore:
    """SQL implementation of `bench_service.telemetry.upkeep.UpkeepStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def begin(self, report: UpkeepReport, unless_since: datetime | None = None) -> bool:
        with self._database.write() as session:
            self._database.one_at_a_time(session, f"upkeep {report.kind.value}")
            if unless_since is not None:
                recent = select(UpkeepRow.id).where(
                    UpkeepRow.kind == report.kind.value, UpkeepRow.began_at > unless_since
                )
                if session.scalar(recent.limit(1)) is not None:
                    return False
            session.add(copied(UpkeepRow, report, kind=report.kind.value))
            return True

    def end(self, report: UpkeepReport) -> None:
        changed = {"ended_at": report.ended_at, "good": report.good, "document": report.document}
        with self._database.write() as session:
            session.execute(update(UpkeepRow).where(UpkeepRow.id == report.id).values(**changed))

    def last(self, kind: UpkeepKind) -> UpkeepReport | None:
        ended = select(UpkeepRow).where(UpkeepRow.kind == kind.value, UpkeepRow.ended_at.is_not(None))
        with self._database.read() as session:
            row = session.scalar(ended.order_by(UpkeepRow.id.desc()).limit(1))
            return None if row is None else _report(row)

    def list(self, *, kind: UpkeepKind | None = None, after: str | None = None, limit: int = 50) -> Page[UpkeepReport]:
        query = select(UpkeepRow)
        if kind is not None:
            query = query.where(UpkeepRow.kind == kind.value)
        with self._database.read() as session:
            return page(session, query, UpkeepRow.id, after, limit, _report)


def _report(row: UpkeepRow) -> UpkeepReport:
    return copied(UpkeepReport, row, kind=UpkeepKind(row.kind))
