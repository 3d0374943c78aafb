"""The analysis of a job: its procedure's numbers from its complete recordings, ready to be stored."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from bench_service.evidence.catalogue import AnyProcedure
from bench_service.evidence.documents import document_of, require_storable
from bench_service.evidence.stores import EvidenceStores
from bench_service.model.job import Job
from bench_service.model.records import StoredResult
from bench_service.wall_clock import new_id, now
from procedures.analysis.measured_pace import fell_behind
from procedures.core.errors import UnfitRecording
from procedures.core.imu_model import TriadCalibration
from procedures.core.recording import Recording
from procedures.core.unit_correction import UnitCorrection
from procedures.inspection import analyse_procedure
from procedures.procedure import Context, Outcome


@dataclass(frozen=True)
class Analysed:
    """A result ready to be stored, with the calibrations and corrections that it gives."""

    outcome: Outcome
    stored: StoredResult
    calibrations: tuple[TriadCalibration, ...]
    corrections: tuple[UnitCorrection, ...]


def recordings_of(stores: EvidenceStores, job_id: str) -> list[Recording]:
    """Return a job's complete recordings for an analysis, in the order of their stations; samples are read when they
    are used.
    """
    return [stores.recordings.load(stored.info.id) for stored in stores.recordings.of_job(job_id)]


def analysed(
    job: Job,
    context: Context,
    procedure: AnyProcedure,
    parameters: dict[str, Any],
    recordings: Sequence[Recording],
    code_version: str,
) -> Analysed:
    """Run a procedure's analysis on a job's recordings, and return the result, not stored yet.

    Raises `DomainError`, `ValidationError` for the parameters. A value that cannot be stored, NaN above all, is
    `UnfitResult`.
    """
    if len(recordings) != len(job.stations):
        raise UnfitRecording(f"job {job.id} has {len(recordings)} of its {len(job.stations)} recordings")
    params = procedure.resolve(procedure.params.model_validate(parameters), context)
    outcome = analyse_procedure(procedure, recordings, params, context)
    said = (*context.bench.overdue(job.created_at.date().isoformat()), *fell_behind([r.info for r in recordings]))
    if said:
        outcome = outcome.model_copy(update={"warnings": (*said, *outcome.warnings)})
    used = (context.unit.calibration_id(triad) for triad in procedure.uses_calibration)
    stored = StoredResult(
        id=new_id(),
        kind="procedure",
        name=procedure.name,
        version=procedure.version,
        parameters=params.model_dump(mode="json"),
        document=document_of(outcome),
        verdict=outcome.verdict,
        recordings=tuple((r.info.id, r.info.content_hash) for r in recordings),
        calibrations=tuple(c for c in used if c is not None),
        code_version=code_version,
        simulated=job.simulated,
        created_at=now(),
        unit=job.unit,
        job_id=job.id,
        seed=job.seed,
        context=job.context,
        corrections=context.unit.correction_ids(procedure.uses_corrections(params)),
    )
    found = Analysed(outcome, stored, procedure.calibrations(outcome), procedure.corrections(outcome))
    require_storable(found.calibrations, found.corrections)
    return found
