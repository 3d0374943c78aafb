"""Conversion of corrections to rows and back, and their place in a unit's history. No transaction begins here."""

from collections import defaultdict
from collections.abc import Collection, Sequence

from pydantic import TypeAdapter
from sqlalchemy import ColumnElement, select, update
from sqlalchemy.orm import InstrumentedAttribute, Session

from bench_service import wall_clock
from bench_service.evidence.corrections import StoredCorrection
from bench_service.mapping import copied
from bench_service.model.calibrations import Act, Approval, Decision, takes_over
from bench_service.model.errors import NotFound
from bench_service.model.records import StoredResult
from bench_service.persistence.tables.evidence import (
    CorrectionDecisionRow,
    CorrectionRow,
    ResultCorrectionRow,
    ResultRow,
)
from bench_service.persistence.tables.jobs import JobRow
from procedures.core.limits import Verdict
from procedures.core.unit_correction import UnitCorrection

CORRECTION = TypeAdapter(UnitCorrection)


def correction_of_row(
    row: CorrectionRow, verdict: str, of_job: bool, decisions: Sequence[CorrectionDecisionRow] = ()
) -> StoredCorrection:
    """Convert a row with its result's verdict and its decisions, oldest first, to a stored correction. `of_job`: the
    result gave a job its verdict.
    """
    return copied(
        StoredCorrection,
        row,
        current=row.is_current,
        correction=CORRECTION.validate_python(row.document),
        verdict=Verdict(verdict),
        of_job=of_job,
        approval=Approval(row.approval),
        decisions=tuple(copied(Decision, d, calibration_id=d.correction_id, act=Act(d.act)) for d in decisions),
    )


def corrections_where(
    session: Session, *conditions: ColumnElement[bool] | InstrumentedAttribute[bool]
) -> list[StoredCorrection]:
    """Return the corrections that meet all conditions, with their decisions, oldest first."""
    rows = session.scalars(select(CorrectionRow).where(*conditions).order_by(CorrectionRow.id)).all()
    decisions: dict[str, list[CorrectionDecisionRow]] = defaultdict(list)
    if rows:
        of = CorrectionDecisionRow.correction_id.in_([row.id for row in rows])
        for decision in session.scalars(select(CorrectionDecisionRow).where(of).order_by(CorrectionDecisionRow.id)):
            decisions[decision.correction_id].append(decision)
    verdicts = _verdicts(session, {row.result_id for row in rows})
    return [correction_of_row(row, *verdicts[row.result_id], decisions[row.id]) for row in rows]


def _verdicts(session: Session, results: Collection[str]) -> dict[str, tuple[str, bool]]:
    """Verdict of each result, and whether it is its job's own one."""
    if not results:
        return {}
    own = select(JobRow.result_id).where(JobRow.id == ResultRow.job_id, JobRow.result_id == ResultRow.id).exists()
    query = select(ResultRow.id, ResultRow.verdict, own).where(ResultRow.id.in_(results))
    return {result: (verdict, of_job) for result, verdict, of_job in session.execute(query)}


def check_corrections(session: Session, result: StoredResult) -> None:
    """Check that the corrections of a result exist. Raises `NotFound`."""
    for correction_id in result.corrections:
        if session.scalar(select(CorrectionRow.id).where(CorrectionRow.id == correction_id)) is None:
            raise NotFound("correction", correction_id)


def correction_lineage(result: StoredResult) -> list[ResultCorrectionRow]:
    """Return new rows that link a result to the corrections that it used."""
    return [
        ResultCorrectionRow(result_id=result.id, position=position, correction_id=correction_id)
        for position, correction_id in enumerate(result.corrections)
    ]


def retire_current(session: Session, unit: str | None, kind: str) -> None:
    """Make the unit's current correction of that kind no longer current, in this transaction. Without one (or for
    `unit` None) nothing is changed.
    """
    session.execute(
        update(CorrectionRow)
        .where(CorrectionRow.unit == unit, CorrectionRow.kind == kind, CorrectionRow.is_current)
        .values(is_current=False)
    )


def add_corrections(
    session: Session, result: StoredResult, corrections: Sequence[UnitCorrection], by_rule: bool
) -> None:
    """Add a result's corrections to the unit's history; by the rule they become current where the result passed.

    A person's usable choice stands. `by_rule`: False for a second analysis or a method, whose corrections become
    current only when a person chooses them. Of two that become current at once, the index lets one wait and the store
    try again.
    """
    if not corrections:
        return
    known = corrections_where(session, CorrectionRow.unit == result.unit, CorrectionRow.is_current)
    current = {c.correction.kind: c for c in known}
    for correction in corrections:
        make_current = by_rule and takes_over(result.verdict, current.get(correction.kind), wall_clock.now())
        if make_current:
            retire_current(session, result.unit, correction.kind)
        session.add(
            CorrectionRow(
                id=wall_clock.new_id(),
                unit=result.unit,
                kind=correction.kind,
                result_id=result.id,
                made_at=result.created_at,
                is_current=make_current,
                simulated=result.simulated,
                document=CORRECTION.dump_python(correction, mode="json"),
                approval=Approval.OPEN.value,
                valid_until=None,
            )
        )
        session.flush()
