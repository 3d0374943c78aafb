"""Results and their numbers as rows and back. Knows the shapes only; no transaction begins here."""

from collections.abc import Iterable
from math import isfinite
from typing import Any

from bench_service.mapping import copied
from bench_service.model.quantities import quantities
from bench_service.model.records import StoredResult
from bench_service.persistence.tables.evidence import (
    ResultCalibrationRow,
    ResultCorrectionRow,
    ResultQuantityRow,
    ResultRecordingRow,
    ResultRow,
)
from procedures.core.limits import Verdict


def row_of_result(result: StoredResult, document: dict[str, Any]) -> ResultRow:
    """Convert a result to its row, without its lineage and with the document that is stored."""
    return copied(ResultRow, result, verdict=result.verdict.value, document=document)


def quantity_rows(result: StoredResult, elsewhere: frozenset[str]) -> list[ResultQuantityRow]:
    """Build the rows that hold the numbers of a result's document, but not those that are stored elsewhere, nor what is
    unbounded.
    """
    found = [q for q in quantities(result.document).values() if isfinite(q.value)]
    return [copied(ResultQuantityRow, q, result_id=result.id) for q in found if q.name not in elsewhere]


def lineage_rows(result: StoredResult) -> tuple[ResultRecordingRow | ResultCalibrationRow, ...]:
    """Return the rows of a result's lineage: its recordings with hashes, and its calibrations, by position."""
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
    document: dict[str, Any],
    recordings: Iterable[ResultRecordingRow],
    calibrations: Iterable[ResultCalibrationRow],
    corrections: Iterable[ResultCorrectionRow],
) -> StoredResult:
    """Convert rows to their result, with its whole document; lineage in the order of its positions."""
    return copied(
        StoredResult,
        row,
        document=document,
        verdict=Verdict(row.verdict),
        recordings=tuple((r.recording_id, r.content_hash) for r in recordings),
        calibrations=tuple(c.calibration_id for c in calibrations),
        corrections=tuple(c.correction_id for c in corrections),
    )
