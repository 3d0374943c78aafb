"""Results, calibrations and lineage in SQL. Must not know how a result was computed."""

from collections import defaultdict
from collections.abc import Sequence
from itertools import islice
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from bench_service.model.calibrations import StoredCalibration
from bench_service.model.errors import NotFound
from bench_service.model.records import Idempotency, Page, ResultValue, StoredResult
from bench_service.model.search import EVERYTHING, Search
from bench_service.persistence.database import Database
from bench_service.persistence.evidence.calibration_rows import (
    calibrations_where,
    with_coefficients,
    without_coefficients,
)
from bench_service.persistence.evidence.calibration_store import add_calibrations
from bench_service.persistence.evidence.correction_rows import add_corrections, check_corrections, correction_lineage
from bench_service.persistence.evidence.result_rows import (
    lineage_rows,
    quantity_rows,
    result_of_row,
    row_of_result,
)
from bench_service.persistence.evidence.result_values import (
    AT_ONCE,
    DOCUMENTS,
    VerdictResults,
    value_of_row,
    values_query,
)
from bench_service.persistence.idempotency import again_after_conflict, made_before, remember
from bench_service.persistence.paging import page
from bench_service.persistence.searching import find_results
from bench_service.persistence.tables.batches import ResultContentRow
from bench_service.persistence.tables.evidence import (
    CalibrationRow,
    RecordingRow,
    ResultCalibrationRow,
    ResultCorrectionRow,
    ResultRecordingRow,
    ResultRow,
)
from bench_service.persistence.text_search import ways_to_results
from procedures.core.imu_model import TriadCalibration
from procedures.core.unit_correction import UnitCorrection


class SqlResultStore:
    """SQL implementation of `bench_service.evidence.results.ResultStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def add(
        self,
        result: StoredResult,
        calibrations: Sequence[TriadCalibration] = (),
        by_rule: bool = True,
        idempotency: Idempotency | None = None,
        corrections: Sequence[UnitCorrection] = (),
        content: str | None = None,
        reuse: bool = True,
    ) -> StoredResult:
        if (calibrations or corrections) and result.unit is None:
            raise ValueError("a calibration or correction needs the unit that it belongs to")
        if len({c.kind for c in corrections}) < len(corrections):
            raise ValueError("a result gives at most one correction of a kind")
        if len({c.triad for c in calibrations}) < len(calibrations):
            raise ValueError("a result gives at most one calibration of a triad")

        def once() -> StoredResult:
            with self._database.write() as session:
                known = made_before(session, idempotency, "result")
                if known is not None:
                    return _results(session, [_found(session, known)])[0]
                same = None if content is None else session.get(ResultContentRow, content)
                if same is not None and reuse:
                    return _results(session, [_found(session, same.result_id)])[0]
                remember(session, idempotency, "result", result.id, result.created_at)
                _check_lineage(session, result)
                document, taken = without_coefficients(result.document, calibrations)
                session.add(row_of_result(result, document))
                session.flush()
                if (
                    content is not None and same is None
                ):  # a transaction with the same content waits here, and then finds this result
                    session.add(ResultContentRow(content=content, result_id=result.id))
                    session.flush()
                session.add_all([*quantity_rows(result, taken), *lineage_rows(result), *correction_lineage(result)])
                add_calibrations(session, result, calibrations, by_rule)
                add_corrections(session, result, corrections, by_rule)
                if not calibrations:
                    return result
                session.flush()
                return _results(session, [_found(session, result.id)])[0]  # as it is read again, to the last bit

        return again_after_conflict(once)

    def get(self, result_id: str) -> StoredResult:
        with self._database.read() as session:
            return _results(session, [_found(session, result_id)])[0]

    def of_content(self, content: str) -> StoredResult | None:
        with self._database.read() as session:
            same = session.get(ResultContentRow, content)
            return None if same is None else _results(session, [_found(session, same.result_id)])[0]

    def list(
        self,
        *,
        job_id: str | None = None,
        unit: str | None = None,
        name: str | None = None,
        search: Search = EVERYTHING,
        after: str | None = None,
        limit: int = 50,
    ) -> Page[StoredResult]:
        query = find_results(select(ResultRow), search)
        if job_id is not None:
            query = query.where(ResultRow.job_id == job_id)
        if unit is not None:
            query = query.where(ResultRow.unit == unit)
        if name is not None:
            query = query.where(ResultRow.name == name)
        with self._database.read() as session:
            either = None if search.text is None else ways_to_results(session, search.text)
            rows = page(session, query, ResultRow.id, after, limit, _itself, either)
            return Page(_results(session, rows.items), rows.next)

    def newest_verdict(self, unit: str, procedure: str, *, simulated: bool) -> StoredResult | None:
        results = VerdictResults(unit, procedure, simulated)
        with self._database.read() as session:
            newest = next(results.newest_first(session, select(ResultRow.id), at_once=DOCUMENTS), None)
            return None if newest is None else _results(session, [_found(session, newest.id)])[0]

    def values(
        self,
        unit: str,
        procedure: str,
        quantity: str,
        *,
        simulated: bool,
        limit: int,
        before: str | None = None,
        parameters: dict[str, Any] | None = None,
    ) -> tuple[ResultValue, ...]:
        results = VerdictResults(unit, procedure, simulated)
        at_once = DOCUMENTS if quantity.startswith("/") else AT_ONCE
        with self._database.read() as session:
            rows = results.newest_first(session, values_query(quantity), before, at_once)
            same = (row for row in rows if parameters is None or row.parameters == parameters)
            return tuple(value_of_row(session, row, quantity) for row in islice(same, limit))

    def of_recording(self, recording_id: str) -> tuple[str, ...]:
        query = (
            select(ResultRecordingRow.result_id)
            .where(ResultRecordingRow.recording_id == recording_id)
            .distinct()
            .order_by(ResultRecordingRow.result_id.desc())
        )
        with self._database.read() as session:
            return tuple(session.scalars(query))


def _itself(row: ResultRow) -> ResultRow:
    return row


def _found(session: Session, result_id: str) -> ResultRow:
    row = session.get(ResultRow, result_id)
    if row is None:
        raise NotFound("result", result_id)
    return row


def _results(session: Session, rows: Sequence[ResultRow]) -> tuple[StoredResult, ...]:
    """Results with their coefficients and their lineage, in seven queries however many they are."""
    ids = [row.id for row in rows]
    recordings: dict[str, list[ResultRecordingRow]] = defaultdict(list)
    calibrations: dict[str, list[ResultCalibrationRow]] = defaultdict(list)
    corrections: dict[str, list[ResultCorrectionRow]] = defaultdict(list)
    given: dict[str | None, list[StoredCalibration]] = defaultdict(list)
    if ids:
        for made in calibrations_where(session, CalibrationRow.result_id.in_(ids)):
            given[made.result_id].append(made)
        used = select(ResultRecordingRow).where(ResultRecordingRow.result_id.in_(ids))
        for recording in session.scalars(used.order_by(ResultRecordingRow.position)):
            recordings[recording.result_id].append(recording)
        applied = select(ResultCalibrationRow).where(ResultCalibrationRow.result_id.in_(ids))
        for calibration in session.scalars(applied.order_by(ResultCalibrationRow.position)):
            calibrations[calibration.result_id].append(calibration)
        corrected = select(ResultCorrectionRow).where(ResultCorrectionRow.result_id.in_(ids))
        for correction in session.scalars(corrected.order_by(ResultCorrectionRow.position)):
            corrections[correction.result_id].append(correction)
    return tuple(
        result_of_row(
            row,
            with_coefficients(row.document, given[row.id]),
            recordings[row.id],
            calibrations[row.id],
            corrections[row.id],
        )
        for row in rows
    )


def _check_lineage(session: Session, result: StoredResult) -> None:
    """Check that everything from which a result was made exists. Raises `NotFound`."""
    for recording_id, _ in result.recordings:
        if session.scalar(select(RecordingRow.id).where(RecordingRow.id == recording_id)) is None:
            raise NotFound("recording", recording_id)
    for calibration_id in result.calibrations:
        if session.scalar(select(CalibrationRow.id).where(CalibrationRow.id == calibration_id)) is None:
            raise NotFound("calibration", calibration_id)
    check_corrections(session, result)
