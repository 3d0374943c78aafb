"""Results, their numbers, and calibrations as rows and back. Knows the shapes only; no transaction begins here."""

from collections.abc import Iterable

from pydantic import TypeAdapter

from bench_service.mapping import copied
from bench_service.model.quantities import quantities
from bench_service.model.records import StoredCalibration, StoredResult
from bench_service.persistence.tables.evidence import (
    CalibrationRow,
    ResultCalibrationRow,
    ResultCorrectionRow,
    ResultQuantityRow,
    ResultRecordingRow,
    ResultRow,
)
from procedures.core.imu_model import TriadCalibration
from procedures.core.limits import Verdict

TRIADS = TypeAdapter(tuple[TriadCalibration, ...])


def row_of_result(result: StoredResult) -> ResultRow:
    """Convert a result to its row, without its lineage."""
    return copied(ResultRow, result, verdict=result.verdict.value)


def quantity_rows(result: StoredResult) -> list[ResultQuantityRow]:
    """Build the rows that hold the numbers of a result's document."""
    found = quantities(result.document).values()
    return [copied(ResultQuantityRow, quantity, result_id=result.id) for quantity in found]


def lineage_rows(result: StoredResult) -> tuple[ResultRecordingRow | ResultCalibrationRow, ...]:
    """Build the rows of a result's lineage."""
    recordings = (
        ResultRecordingRow(result_id=result.id, position=position, recording_id=recording_id, content_hash=digest)
        for position, (recording_id, digest) in enumerate(result.recordings)
    )
    calibrations = (
        ResultCalibrationRow(result_id=result.id, position=position, calibration_id=calibration_id)
        for position, calibration_id in enumerate(result.calibrations)
    )
    return (*recordings, *calibrations)


def result_of_row(
    row: ResultRow,
    recordings: Iterable[ResultRecordingRow],
    calibrations: Iterable[ResultCalibrationRow],
    corrections: Iterable[ResultCorrectionRow],
) -> StoredResult:
    """Convert rows to their result; lineage in the order of its positions."""
    return copied(
        StoredResult,
        row,
        verdict=Verdict(row.verdict),
        recordings=tuple((r.recording_id, r.content_hash) for r in recordings),
        calibrations=tuple(c.calibration_id for c in calibrations),
        corrections=tuple(c.correction_id for c in corrections),
    )


def calibration_of_row(row: CalibrationRow) -> StoredCalibration:
    """Convert a row to its calibration."""
    return copied(StoredCalibration, row, current=row.is_current, triads=TRIADS.validate_python(row.triads))
