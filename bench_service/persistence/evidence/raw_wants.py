"""Claims on the raw data of recordings, in SQL: calibrations that count, holds, and analyses that have not ended."""

from sqlalchemy import or_, select
from sqlalchemy.orm import Session

from bench_service.model.batches import TaskState
from bench_service.model.calibrations import Approval
from bench_service.persistence.slices import in_parts
from bench_service.persistence.tables.batches import TaskRecordingRow, TaskRow
from bench_service.persistence.tables.evidence import (
    CalibrationRow,
    CorrectionRow,
    HoldRow,
    ResultCalibrationRow,
    ResultCorrectionRow,
    ResultRecordingRow,
)

_OPEN = (TaskState.WAITING.value, TaskState.RUNNING.value)


def wanted_by_calibrations(session: Session) -> frozenset[str]:
    """Return the ids of recordings behind every calibration and correction that is current or approved.

    A result may rest on other calibrations and corrections; so theirs are included.
    """
    approved = Approval.APPROVED.value
    found: set[str] = set()
    new = {
        result
        for query in (
            select(CalibrationRow.result_id).where(or_(CalibrationRow.is_current, CalibrationRow.approval == approved)),
            select(CorrectionRow.result_id).where(or_(CorrectionRow.is_current, CorrectionRow.approval == approved)),
        )
        for result in session.scalars(query)
        if result is not None
    }
    while new:
        found |= new
        below: set[str] = set()
        for ids in in_parts(sorted(new)):
            calibrations = (
                select(CalibrationRow.result_id)
                .join(ResultCalibrationRow, ResultCalibrationRow.calibration_id == CalibrationRow.id)
                .where(ResultCalibrationRow.result_id.in_(ids))
            )
            corrections = (
                select(CorrectionRow.result_id)
                .join(ResultCorrectionRow, ResultCorrectionRow.correction_id == CorrectionRow.id)
                .where(ResultCorrectionRow.result_id.in_(ids))
            )
            below |= {result for query in (calibrations, corrections) for result in session.scalars(query) if result}
        new = below - found
    recordings: set[str] = set()
    for ids in in_parts(sorted(found)):
        used = select(ResultRecordingRow.recording_id).where(ResultRecordingRow.result_id.in_(ids))
        recordings |= set(session.scalars(used))
    return frozenset(recordings)


def wanted_by_holds(session: Session, recording_id: str | None = None) -> frozenset[str]:
    """Return the ids of recordings with a standing hold; with `recording_id` at most that one."""
    query = select(HoldRow.recording_id).where(HoldRow.released_at.is_(None))
    if recording_id is not None:
        query = query.where(HoldRow.recording_id == recording_id)
    return frozenset(session.scalars(query))


def wanted_by_analyses(session: Session, recording_id: str | None = None) -> frozenset[str]:
    """Return the ids of recordings that a waiting or running task needs; with `recording_id` at most that one."""
    query = (
        select(TaskRecordingRow.recording_id)
        .join(TaskRow, (TaskRow.batch_id == TaskRecordingRow.batch_id) & (TaskRow.number == TaskRecordingRow.number))
        .where(TaskRow.state.in_(_OPEN))
    )
    if recording_id is not None:
        query = query.where(TaskRecordingRow.recording_id == recording_id)
    return frozenset(session.scalars(query))
