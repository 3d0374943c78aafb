"""Correction sets in SQL: history and choice. They come in with the result that gives them (`result_store`)."""

from collections.abc import Callable
from datetime import datetime

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from bench_service import wall_clock
from bench_service.evidence.corrections import StoredCorrection
from bench_service.mapping import copied
from bench_service.model.calibrations import Act, Approval, Decider
from bench_service.model.errors import CorrectionRefused, NotFound
from bench_service.model.records import Idempotency, Page
from bench_service.persistence.database import Database
from bench_service.persistence.evidence.correction_rows import corrections_where, retire_current
from bench_service.persistence.idempotency import again_after_conflict, made_before, remember
from bench_service.persistence.paging import page
from bench_service.persistence.tables.evidence import (
    CorrectionDecisionRow,
    CorrectionRow,
    ResultCorrectionRow,
    ResultRow,
)
from procedures.core.limits import Verdict
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
            found = page(session, query, CorrectionRow.id, after, limit, lambda row: row.id)
            known = {c.id: c for c in corrections_where(session, CorrectionRow.id.in_(found.items))}
            return Page(tuple(known[i] for i in found.items), found.next)

    def get(self, unit: str, correction_id: str) -> StoredCorrection:
        with self._database.read() as session:
            return _one(session, unit, correction_id)

    def current(self, unit: str, kind: CorrectionKind) -> StoredCorrection | None:
        of_kind = (CorrectionRow.unit == unit, CorrectionRow.kind == kind, CorrectionRow.is_current)
        with self._database.read() as session:
            return next(iter(corrections_where(session, *of_kind)), None)

    def used_by(self, correction_id: str) -> tuple[str, ...]:
        query = (
            select(ResultCorrectionRow.result_id)
            .where(ResultCorrectionRow.correction_id == correction_id)
            .distinct()
            .order_by(ResultCorrectionRow.result_id.desc())
        )
        with self._database.read() as session:
            return tuple(session.scalars(query))

    def make_current(
        self, unit: str, correction_id: str, by: Decider, idempotency: Idempotency | None = None
    ) -> StoredCorrection:
        def choose(session: Session, row: CorrectionRow) -> None:
            _require_remark(session, row, by)
            _lock_all(session, unit, row.kind)
            retire_current(session, unit, row.kind)
            row.is_current = True

        return self._decided(unit, correction_id, by, Act.CHOSEN, "correction choice", idempotency, choose)

    def choose_by_rule(self, unit: str, kind: CorrectionKind, by: Decider) -> StoredCorrection:
        with self._database.read() as session:
            found = _by_rule(session, unit, kind)

        def choose(session: Session, row: CorrectionRow) -> None:
            _lock_all(session, unit, row.kind)
            retire_current(session, unit, row.kind)
            _set(session, row, is_current=True)

        return self._decided(unit, found, by, Act.GIVEN_BACK, "correction choice", None, choose)

    def approve(
        self,
        unit: str,
        correction_id: str,
        by: Decider,
        valid_until: datetime | None,
        idempotency: Idempotency | None = None,
    ) -> StoredCorrection:
        def change(session: Session, row: CorrectionRow) -> None:
            until = {} if valid_until is None else {"valid_until": valid_until}
            _set(session, row, approval=Approval.APPROVED.value, **until)

        return self._decided(unit, correction_id, by, Act.APPROVED, "correction approved", idempotency, change)

    def reject(
        self, unit: str, correction_id: str, by: Decider, idempotency: Idempotency | None = None
    ) -> StoredCorrection:
        def change(session: Session, row: CorrectionRow) -> None:
            _set(session, row, approval=Approval.REJECTED.value)

        return self._decided(unit, correction_id, by, Act.REJECTED, "correction rejected", idempotency, change)

    def _decided(
        self,
        unit: str,
        correction_id: str,
        by: Decider,
        act: Act,
        kind: str,
        idempotency: Idempotency | None,
        change: Callable[[Session, CorrectionRow], None],
    ) -> StoredCorrection:
        """Change a correction and note the decision in one transaction, unless its key is known."""

        def once() -> StoredCorrection:
            with self._database.write() as session:
                row = _found(session, unit, correction_id)
                if made_before(session, idempotency, kind) is None:
                    at = wall_clock.now()
                    remember(session, idempotency, kind, correction_id, at)
                    change(session, row)
                    given = {"id": wall_clock.new_id(), "correction_id": correction_id, "act": act.value, "at": at}
                    session.add(copied(CorrectionDecisionRow, by, **given))
                    session.flush()
                return _one(session, unit, correction_id)

        return again_after_conflict(once)


def _set(session: Session, row: CorrectionRow, **values: object) -> None:
    """Write values as they are given now, also where the row was read with the same ones."""
    session.execute(update(CorrectionRow).where(CorrectionRow.id == row.id).values(**values))
    session.expire_all()


def _by_rule(session: Session, unit: str, kind: str) -> str:
    """Id of the newest correction that the rule would make current. Raises `CorrectionRefused` without one."""
    at = wall_clock.now()
    for found in reversed(corrections_where(session, CorrectionRow.unit == unit, CorrectionRow.kind == kind)):
        if found.of_job and found.verdict is Verdict.PASS and not found.unusable(at):
            return found.id
    raise CorrectionRefused(
        f"no job that passed has given unit {unit} a usable correction of the kind {kind!r}: run one, or choose one of "
        "its history"
    )


def _require_remark(session: Session, row: CorrectionRow, by: Decider) -> None:
    """Refuse to choose a correction of a result that did not pass without a reason. Raises `CorrectionRefused`."""
    verdict = session.scalars(select(ResultRow.verdict).where(ResultRow.id == row.result_id)).one()
    if verdict != Verdict.PASS.value and not by.remark:
        raise CorrectionRefused(
            f"correction {row.id} of the kind {row.kind!r} comes from result {row.result_id}, whose verdict is "
            f"{verdict}: give a remark that says why it is used nevertheless"
        )


def _one(session: Session, unit: str, correction_id: str) -> StoredCorrection:
    _found(session, unit, correction_id)
    return corrections_where(session, CorrectionRow.id == correction_id)[0]


def _lock_all(session: Session, unit: str, kind: str) -> None:
    """Every correction of a kind, in one order: two choices at once wait for each other instead of both for both."""
    mine = select(CorrectionRow.id).where(CorrectionRow.unit == unit, CorrectionRow.kind == kind)
    session.scalars(mine.order_by(CorrectionRow.id).with_for_update()).all()


def _found(session: Session, unit: str, correction_id: str) -> CorrectionRow:
    row = session.get(CorrectionRow, correction_id)
    if row is None or row.unit != unit:
        raise NotFound("correction", correction_id, f"unit {unit} has none with this id")
    return row
