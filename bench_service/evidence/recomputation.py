"""Second computation of a stored result from its raw data, compared with what is stored; nothing is stored by it."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from bench_service.evidence.analyses import AnalysisRequest, AnalysisService
from bench_service.evidence.catalogue import Catalogue
from bench_service.evidence.job_analysis import analysed
from bench_service.evidence.recordings import RecordingStore
from bench_service.evidence.stores import EvidenceStores
from bench_service.evidence.work_processes import WorkProcesses
from bench_service.formats.chunk import sample_type
from bench_service.formats.content_hash import hash_of_blocks
from bench_service.model.context import context_of
from bench_service.model.job import Job
from bench_service.model.records import StoredResult
from procedures.core.imu_model import TriadCalibration

ROUNDED = 1e-14
"""Rounding of a stored covariance, in units of the two standard uncertainties."""
LISTED = 20
"""Differing places of the document that an answer lists."""


@dataclass(frozen=True)
class RecordingCheck:
    """A recording of a result: the content hash that the result names, and the hash of the stored samples now."""

    id: str
    stated: str
    found: str

    @property
    def same(self) -> bool:
        """True where the samples are those from which the result was computed."""
        return self.stated == self.found


@dataclass(frozen=True)
class CalibrationCheck:
    """A calibration computed again: its coefficients, and their largest change in standard uncertainties."""

    triad: str
    coefficients: tuple[float, ...]
    standard_uncertainties: tuple[float, ...]
    change: float | None
    """Largest |new − stored|/u; None: no stored calibration of the result is of that triad."""


@dataclass(frozen=True)
class Recomputation:
    """Comparison of a result that was computed again from the stored samples with the stored one."""

    result: str
    raw_data_same: bool
    same: bool
    """True where every number of the document is the stored one, bit by bit; covariances to 1e-14 of their size."""
    recordings: tuple[RecordingCheck, ...]
    calibrations: tuple[CalibrationCheck, ...]
    differences: tuple[str, ...]
    """First places of the document that differ, as JSON pointers."""
    stored_version: str
    version: str
    """Version of the procedure or method that computed it again."""
    stored_code: str
    code: str


RECOMPUTATION = TypeAdapter(Recomputation)


class RecomputationService:
    """Computes stored results again from their raw data; stores nothing."""

    def __init__(
        self,
        stores: EvidenceStores,
        catalogue: Catalogue,
        read_job: Callable[[str], Job],
        code_version: str,
        processes: WorkProcesses | None = None,
    ) -> None:
        """Set up with `processes`, where results are computed; None: here, in the caller's thread."""
        self._stores = stores
        self._catalogue = catalogue
        self._read_job = read_job
        self._code_version = code_version
        self._processes = processes

    def recomputed(self, result_id: str) -> Recomputation:
        """Compute a result again and return the comparison with the stored one. Raises `NotFound`, `DomainError`,
        `ValidationError` where that is not possible any more.
        """
        result = self._stores.results.get(result_id)
        if self._processes is not None:
            return RECOMPUTATION.validate_json(self._processes.result("recompute", result_id))
        checks = tuple(
            RecordingCheck(known, digest, digest_of(self._stores.recordings, known))
            for known, digest in result.recordings
        )
        version, document, calibrations = self._outcome(result)
        differences = tuple(
            pointer for pointer, _ in zip(_differences(result.document, document), range(LISTED), strict=False)
        )
        return Recomputation(
            result_id,
            all(check.same for check in checks),
            not differences,
            checks,
            tuple(self._check(result_id, one) for one in calibrations),
            differences,
            result.version,
            version,
            result.code_version,
            self._code_version,
        )

    def as_json(self, result_id: str) -> str:
        """Compute a result again and return the comparison as JSON text, for an answer between processes; raises as
        `recomputed`.
        """
        return RECOMPUTATION.dump_json(self.recomputed(result_id)).decode()

    def _outcome(self, result: StoredResult) -> tuple[str, dict[str, Any], Sequence[TriadCalibration]]:
        """Version, document and calibrations of the analysis as it is now."""
        if result.kind == "procedure" and result.job_id is not None:
            job = self._read_job(result.job_id)
            recordings = [self._stores.recordings.load(known) for known, _ in result.recordings]
            procedure = self._catalogue.procedure(result.name)
            context = context_of(job, self._stores.calibrations.several)
            found = analysed(job, context, procedure, result.parameters, recordings, self._code_version)
            return found.stored.version, found.stored.document, found.calibrations
        analyses = AnalysisService(self._stores, self._catalogue, self._read_job, self._code_version)
        recordings_used = tuple(known for known, _ in result.recordings)
        stored, calibrations, _ = analyses.computed(
            AnalysisRequest(result.name, recordings_used, result.calibrations, result.parameters, result.unit)
        )
        return stored.version, stored.document, calibrations

    def _check(self, result_id: str, found: TriadCalibration) -> CalibrationCheck:
        new, sd = found.coefficients, found.standard_uncertainties
        change: float | None = None
        for stored in self._stores.calibrations.of_results([result_id]):
            if stored.triad == found.triad:
                size = np.where(stored.value.standard_uncertainties > 0, stored.value.standard_uncertainties, np.inf)
                moved = np.abs(new - stored.value.coefficients)
                change = float(np.max(np.where(np.isinf(size), np.where(moved > 0, 1e300, 0.0), moved / size)))
        return CalibrationCheck(found.triad, tuple(new.tolist()), tuple(sd.tolist()), change)


def digest_of(recordings: RecordingStore, recording_id: str) -> str:
    """Return the content hash of a recording, computed from its stored samples a chunk at a time. Raises `NotFound`."""
    stored = recordings.get(recording_id)
    info = stored.info
    blocks = recordings.read(recording_id, [c.name for c in info.channels], 0, info.count)
    return hash_of_blocks(info.channels, info.rate_hz, sample_type(stored.dtype), blocks)


def _differences(stored: Any, found: Any, pointer: str = "") -> Iterator[str]:
    """JSON pointers of what differs between two documents, as JSON has them.

    A covariance is stored as standard uncertainties and correlations, so it comes back rounded.
    """
    if pointer.endswith("/covariance") and _same_covariance(stored, found):
        return
    if isinstance(stored, dict) and isinstance(found, dict):
        for name in sorted({*stored, *found}, key=str):
            yield from _differences(stored.get(name), found.get(name), f"{pointer}/{name}")
    elif isinstance(stored, list) and isinstance(found, list) and len(stored) == len(found):
        for number, (a, b) in enumerate(zip(stored, found, strict=True)):
            yield from _differences(a, b, f"{pointer}/{number}")
    elif json.dumps(stored) != json.dumps(found):
        yield pointer or "/"


def _same_covariance(stored: Any, found: Any) -> bool:
    """Whether two nested lists are one covariance but for the rounding of its storage."""
    try:
        a, b = np.array(stored, dtype=np.float64), np.array(found, dtype=np.float64)
        size = np.sqrt(np.outer(np.diagonal(a), np.diagonal(a)))
        return a.shape == b.shape and bool(np.all(np.abs(a - b) <= ROUNDED * size))
    except (ValueError, TypeError):
        return False
