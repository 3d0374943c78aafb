"""Correction sets in SQL: history and choice. They come in with the result that gives them (`result_store`)."""

from sqlalchemy import select
from sqlalchemy.orm import Session

from bench_service import wall_clock
from bench_service.evidence.corrections import StoredCorrection
from bench_service.model.errors import NotFound
from bench_service.model.records import Idempotency, Page
from bench_service.persistence.database import Database
from bench_service.persistence.evidence.correction_rows import correction_of_row, retire_current
from bench_service.persistence.idempotency import again_after_conflict, made_before, remember
from bench_service.persistence.pages import page
from bench_service.persistence.tables.evidence import CorrectionRow, ResultCorrectionRow
from procedures.core.unit_correction import CorrectionKind


class SqlCorrectionStore:
    """SQL implementation of `bench_service.evidence.corrections.CorrectionStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def list(
        self, unit: str, *, kind: CorrectionKind | None = None, after: str | None = None, limit: int = 50
    ) -> Page[StoredCorrection]:
        query = select(CorrectionRow).where(CorrectionRow.unit == unit)
        if kind is not None:
            query = query.where(CorrectionRow.kind == kind)
        with self._database.read() as session:
            return page(session, query, CorrectionRow.id, after, limit, correction_of_row)

    def get(self, unit: str, correction_id: str) -> StoredCorrection:
        with self._database.read() as session:
            return correction_of_row(_found(session, unit, correction_id))

    def current(self, unit: str, kind: CorrectionKind) -> StoredCorrection | None:
        query = select(CorrectionRow).where(
            CorrectionRow.unit == unit, CorrectionRow.kind == kind, CorrectionRow.is_current
        )
        with self._database.read() as session:
            row = session.scalar(query)
            return None if row is None else correction_of_row(row)

    def used_by(self, correction_id: str) -> tuple[str, ...]:
        query = (
            select(ResultCorrectionRow.result_id)
            .where(ResultCorrectionRow.correction_id == correction_id)
            .distinct()
            .order_by(ResultCorrectionRow.result_id.desc())
        )
        with self._database.read() as session:
            return tuple(session.scalars(query))

    def make_current(self, unit: str, correction_id: str, idempotency: Idempotency | None = None) -> StoredCorrection:
        def once() -> StoredCorrection:
            with self._database.write() as session:
                row = _found(session, unit, correction_id)
                if made_before(session, idempotency, "correction choice") is None:
                    remember(session, idempotency, "correction choice", correction_id, wall_clock.now())
                    _lock_all(session, unit, row.kind)
                    retire_current(session, unit, row.kind)
                    row.is_current = True
                    session.flush()
                return correction_of_row(row)

        return again_after_conflict(once)


def _lock_all(session: Session, unit: str, kind: str) -> None:
    """Every correction of a kind, in one order: two choices at once wait for each other instead of both for both."""
    mine = select(CorrectionRow.id).where(CorrectionRow.unit == unit, CorrectionRow.kind == kind)
    session.scalars(mine.order_by(CorrectionRow.id).with_for_update()).all()


def _found(session: Session, unit: str, correction_id: str) -> CorrectionRow:
    row = session.get(CorrectionRow, correction_id)
    if row is None or row.unit != unit:
        raise NotFound("correction", correction_id, f"unit {unit} has none of that id")
    return row
