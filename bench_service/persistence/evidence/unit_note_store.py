"""Remarks about units in SQL."""

from sqlalchemy import select

from bench_service.mapping import copied
from bench_service.model.errors import NotFound
from bench_service.model.notes import UnitNote
from bench_service.model.records import Idempotency, Page
from bench_service.persistence.database import Database
from bench_service.persistence.idempotency import again_after_conflict, made_before, remember
from bench_service.persistence.paging import page
from bench_service.persistence.tables.evidence import UnitNoteRow


class SqlUnitNoteStore:
    """SQL implementation of `bench_service.evidence.unit_notes.UnitNoteStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def add(self, note: UnitNote, idempotency: Idempotency | None = None) -> UnitNote:
        def once() -> UnitNote:
            with self._database.write() as session:
                known = made_before(session, idempotency, "unit_note")
                if known is not None:
                    row = session.get(UnitNoteRow, known)
                    if row is None:
                        raise NotFound("unit_note", known)
                    return copied(UnitNote, row)
                remember(session, idempotency, "unit_note", note.id, note.at)
                session.add(copied(UnitNoteRow, note))
                return note

        return again_after_conflict(once)

    def list(self, unit: str, *, after: str | None = None, limit: int = 50) -> Page[UnitNote]:
        query = select(UnitNoteRow).where(UnitNoteRow.unit == unit)
        with self._database.read() as session:
            return page(session, query, UnitNoteRow.id, after, limit, lambda row: copied(UnitNote, row))
