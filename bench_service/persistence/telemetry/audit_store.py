"""The audit trail in SQL: rows are only added."""

from sqlalchemy import or_, select

from bench_service.mapping import copied
from bench_service.model.records import Page
from bench_service.persistence.database import Database
from bench_service.persistence.pages import page
from bench_service.persistence.tables.telemetry import AuditRow
from bench_service.telemetry.audit import AuditEntry


class SqlAuditTrail:
    """SQL implementation of `bench_service.telemetry.audit.AuditTrail`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def add(self, entry: AuditEntry) -> None:
        with self._database.write() as session:
            session.add(copied(AuditRow, entry))

    def list(
        self, *, who: str | None = None, target: str | None = None, after: str | None = None, limit: int = 50
    ) -> Page[AuditEntry]:
        query = select(AuditRow)
        if who is not None:
            query = query.where(AuditRow.who == who)
        if target is not None:
            part = f"/{target}"
            query = query.where(
                or_(
                    AuditRow.target == target,
                    AuditRow.target.endswith(part, autoescape=True),
                    AuditRow.target.contains(f"{part}/", autoescape=True),
                )
            )
        with self._database.read() as session:
            return page(session, query, AuditRow.id, after, limit, _entry)


def _entry(row: AuditRow) -> AuditEntry:
    return copied(AuditEntry, row)
