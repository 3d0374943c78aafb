"""Results, their numbers, and calibrations as rows and back. Knows the shapes only; no transaction begins here."""

from collections.abc import Iterable

from pydantic import TypeAdapter

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
    """The row that keeps a result, without its lineage."""
    return ResultRow(
        id=result.id,
        kind=result.kind,
        name=result.name,
        version=result.version,
        parameters=result.parameters,
        document=result.document,
        verdict=result.verdict.value,
        code_version=result.code_version,
        simulated=result.simulated,
        created_at=result.created_at,
        unit=result.unit,
        job_id=result.job_id,
        seed=result.seed,
        context=result.context,
    )


def quantity_rows(result: StoredResult) -> list[ResultQuantityRow]:
    """The rows that keep the numbers of a result's document."""
    return [
        ResultQuantityRow(
            result_id=result.id,
            name=quantity.name,
            value=quantity.value,
            unit=quantity.unit,
            standard_uncertainty=quantity.standard_uncertainty,
        )
        for quantity in quantities(result.document).values()
    ]


def lineage_rows(result: StoredResult) -> tuple[ResultRecordingRow | ResultCalibrationRow, ...]:
    """The rows that say what a result was made from."""
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
    """The result that rows keep; lineage in the order of its positions."""
    return StoredResult(
        id=row.id,
        kind=row.kind,
        name=row.name,
        version=row.version,
        parameters=row.parameters,
        document=row.document,
        verdict=Verdict(row.verdict),
        recordings=tuple((r.recording_id, r.content_hash) for r in recordings),
        calibrations=tuple(c.calibration_id for c in calibrations),
        code_version=row.code_version,
        simulated=row.simulated,
        created_at=row.created_at,
        unit=row.unit,
        job_id=row.job_id,
        seed=row.seed,
        context=row.context,
        corrections=tuple(c.correction_id for c in corrections),
    )


def calibration_of_row(row: CalibrationRow) -> StoredCalibration:
    """The calibration that a row keeps."""
    return StoredCalibration(
        row.id, row.unit, row.result_id, row.made_at, row.is_current, TRIADS.validate_python(row.triads), row.simulated
    )
