"""Conversion of corrections to rows and back, and their place in a unit's history. No transaction begins here."""

from collections.abc import Sequence

from pydantic import TypeAdapter
from sqlalchemy import select, update
from sqlalchemy.orm import Session

from bench_service import wall_clock
from bench_service.evidence.corrections import StoredCorrection
from bench_service.mapping import copied
from bench_service.model.errors import NotFound
from bench_service.model.records import StoredResult
from bench_service.persistence.tables.evidence import CorrectionRow, ResultCorrectionRow
from procedures.core.unit_correction import UnitCorrection

CORRECTION = TypeAdapter(UnitCorrection)


def correction_of_row(row: CorrectionRow) -> StoredCorrection:
    """Convert a row to its correction."""
    correction = CORRECTION.validate_python(row.document)
    return copied(StoredCorrection, row, current=row.is_current, correction=correction)


def check_corrections(session: Session, result: StoredResult) -> None:
    """Check that the corrections of a result exist. Raises `NotFound`."""
    for correction_id in result.corrections:
        if session.scalar(select(CorrectionRow.id).where(CorrectionRow.id == correction_id)) is None:
            raise NotFound("correction", correction_id)


def correction_lineage(result: StoredResult) -> list[ResultCorrectionRow]:
    """Build the rows that link a result to the corrections that it used."""
    return [
        ResultCorrectionRow(result_id=result.id, position=position, correction_id=correction_id)
        for position, correction_id in enumerate(result.corrections)
    ]


def retire_current(session: Session, unit: str | None, kind: str) -> None:
    """Unset the unit's current correction of that kind."""
    session.execute(
        update(CorrectionRow)
        .where(CorrectionRow.unit == unit, CorrectionRow.kind == kind, CorrectionRow.is_current)
        .values(is_current=False)
    )


def add_corrections(
    session: Session, result: StoredResult, corrections: Sequence[UnitCorrection], make_current: bool
) -> None:
    """Add to a unit's history; of two that become current at once, the index lets one wait and the store try again."""
    for correction in corrections:
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
            )
        )
        session.flush()
