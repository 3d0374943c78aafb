"""Stores that `evidence` needs: units, recordings, results, calibrations, corrections, batches of analyses, and
clients' idempotency keys.
"""

from dataclasses import dataclass

from bench_service.access.stores import AccessStores
from bench_service.evidence.batches.store import BatchStore
from bench_service.evidence.calibrations import CalibrationStore
from bench_service.evidence.corrections import CorrectionStore
from bench_service.evidence.idempotency_keys import KeyStore
from bench_service.evidence.raw_data.store import RawDataStore
from bench_service.evidence.recordings import RecordingStore
from bench_service.evidence.results import ResultStore
from bench_service.evidence.unit_notes import UnitNoteStore
from bench_service.evidence.units import UnitStore


@dataclass(frozen=True)
class EvidenceStores(AccessStores):
    """The stores that `evidence` needs, with those of `access` and the packages below it, as one value."""

    units: UnitStore
    unit_notes: UnitNoteStore
    recordings: RecordingStore
    results: ResultStore
    calibrations: CalibrationStore
    corrections: CorrectionStore
    keys: KeyStore
    batches: BatchStore
    raw_data: RawDataStore
