"""Analyses of stored evidence: methods on recordings and calibrations, and second analyses of jobs.

They need no bench and no worker.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from bench_service.evidence.batches.content import content_of
from bench_service.evidence.catalogue import Catalogue
from bench_service.evidence.documents import document_of, require_storable
from bench_service.evidence.job_analysis import analysed, recordings_of
from bench_service.evidence.stores import EvidenceStores
from bench_service.evidence.work_processes import WorkProcesses
from bench_service.model.calibrations import StoredCalibration
from bench_service.model.context import context_of
from bench_service.model.job import Job
from bench_service.model.records import Idempotency, RecordingState, StoredRecording, StoredResult
from bench_service.wall_clock import new_id, now
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.imu_model import TriadCalibration
from procedures.core.recording import Recording
from procedures.core.unit import Unit
from procedures.core.unit_correction import UnitCorrection
from procedures.inspection import analyse_method
from procedures.procedure import DatedCalibration, Evidence, Method, Parameters


@dataclass(frozen=True)
class AnalysisRequest:
    """A client's request for an analysis: a method, its recordings or calibrations, parameters, unit."""

    method: str
    recordings: tuple[str, ...] = ()
    calibrations: tuple[str, ...] = ()
    parameters: dict[str, Any] = field(default_factory=dict[str, Any])
    unit: str | None = None
    """Serial of the unit that it is about; None: that of the evidence. Needed where there is no evidence."""


Computed = tuple[StoredResult, tuple[TriadCalibration, ...], tuple[UnitCorrection, ...]]
"""A result that is not stored yet, with the calibrations and corrections that it gives."""


@dataclass(frozen=True)
class _Inputs:
    method: Method[Any, Any]
    params: Parameters
    evidence: Evidence
    unit: Unit | None
    serial: str | None
    content: str
    simulated: bool


class AnalysisService:
    """Runs methods and second analyses on stored evidence, in processes of their own; each call returns with its result
    stored.
    """

    def __init__(
        self,
        stores: EvidenceStores,
        catalogue: Catalogue,
        read_job: Callable[[str], Job],
        code_version: str,
        processes: WorkProcesses | None = None,
    ) -> None:
        """Set up with `read_job`: gives a job by its id, and raises `NotFound`.

        `processes`: where analyses are computed; None: here, in the caller's thread.
        """
        self._processes = processes
        self._stores = stores
        self._catalogue = catalogue
        self._read_job = read_job
        self._code_version = code_version

    def analyse_again(self, job_id: str, parameters: dict[str, Any], key: str | None = None) -> StoredResult:
        """Analyse a job's recordings with other parameters, store the result and return it; the first result stays as
        it is. Raises `NotFound`, `DomainError`, `ValidationError`.
        """
        idempotency = Idempotency.of("again", key, [job_id, parameters])
        known = self._stores.keys.made(idempotency, "result")
        if known is not None:
            return self._stores.results.get(known)
        job = self._read_job(job_id)
        recordings = recordings_of(self._stores, job_id)
        merged = {**job.requested_parameters, **parameters}
        procedure = self._catalogue.procedure(job.procedure)
        if self._processes is not None:
            procedure.params.model_validate(merged)
            return self._stores.results.get(self._processes.result("again", job_id, parameters, key))
        context = context_of(job, self._stores.calibrations.several)
        result = analysed(job, context, procedure, merged, recordings, self._code_version)
        return self._stores.results.add(result.stored, result.calibrations, False, idempotency, result.corrections)

    def run_method(self, request: AnalysisRequest, key: str | None = None) -> StoredResult:
        """Run a method on stored recordings or calibrations, store the result and return it. Raises `NotFound`,
        `DomainError`, `ValidationError`.
        """
        idempotency = Idempotency.of("analyses", key, request)
        known = self._stores.keys.made(idempotency, "result")
        if known is not None:
            return self._stores.results.get(known)
        _require_each_once("recordings", request.recordings)
        _require_each_once("calibrations", request.calibrations)
        if self._processes is not None:
            self._catalogue.method(request.method).params.model_validate(request.parameters)
            return self._stores.results.get(self._processes.result("method", request, key))
        return self._run(request, idempotency, reuse=False)[0]

    def run_or_take(self, request: AnalysisRequest) -> tuple[StoredResult, bool]:
        """Take the stored result of the same content, or run the method here; True where a result was taken.

        Raises as `run_method`. Two that run the same content at once store one result, and both give it.
        """
        return self._run(request, None, reuse=True)

    def computed(self, request: AnalysisRequest) -> Computed:
        """Return the result of a method with the calibrations and corrections that it gives; nothing is stored.

        Raises `NotFound`, `DomainError`, `ValidationError`.
        """
        return self._computed(self._gathered(request), request)

    def _run(self, request: AnalysisRequest, idempotency: Idempotency | None, reuse: bool) -> tuple[StoredResult, bool]:
        inputs = self._gathered(request)
        known = self._stores.results.of_content(inputs.content) if reuse else None
        if known is not None:
            return known, True
        stored, calibrations, corrections = self._computed(inputs, request)
        require_storable(calibrations, corrections)
        added = self._stores.results.add(stored, calibrations, False, idempotency, corrections, inputs.content, reuse)
        return added, added.id != stored.id

    def _gathered(self, request: AnalysisRequest) -> _Inputs:
        method = self._catalogue.method(request.method)
        params = method.params.model_validate(request.parameters)
        used = self._stores.calibrations.several(request.calibrations)
        dated = tuple(DatedCalibration(c.id, c.made_at.isoformat(), (c.value,), self._mounting_of(c)) for c in used)
        evidence = Evidence(self._complete(request.recordings), dated)
        infos = [recording.info for recording in evidence.recordings]
        serial = _unit_of({info.unit for info in infos} | {c.unit for c in used}, request.unit)
        unit = None if serial is None else self._stores.units.unit(serial)
        content = content_of(method.name, method.version, params.model_dump(mode="json"), infos, used, unit)
        simulated = any(info.simulated for info in infos) or any(c.simulated for c in used)
        return _Inputs(method, params, evidence, unit, serial, content, simulated)

    def _computed(self, inputs: _Inputs, request: AnalysisRequest) -> Computed:
        method = inputs.method
        outcome = analyse_method(method, inputs.evidence, inputs.params, inputs.unit)
        corrections = method.corrections(outcome)
        if corrections and inputs.serial is None:
            raise BadParameter("unit", None, "the serial of the unit whose correction this is to be")
        stored = StoredResult(
            id=new_id(),
            kind="method",
            name=method.name,
            version=method.version,
            parameters=inputs.params.model_dump(mode="json"),
            document=document_of(outcome),
            verdict=outcome.verdict,
            recordings=tuple((r.info.id, r.info.content_hash) for r in inputs.evidence.recordings),
            calibrations=request.calibrations,
            code_version=self._code_version,
            simulated=inputs.simulated,
            created_at=now(),
            unit=inputs.serial,
            corrections=() if inputs.unit is None else inputs.unit.correction_ids(method.uses_corrections(outcome)),
        )
        return stored, method.calibrations(outcome), corrections

    def _mounting_of(self, calibration: StoredCalibration) -> str:
        """Id of the mounting that the calibration's job rested on; empty where it rested on none."""
        if calibration.result_id is None:
            return ""
        mounting = self._stores.results.get(calibration.result_id).context.get("mounting")
        return mounting["id"] if mounting else ""

    def _complete(self, ids: Sequence[str]) -> tuple[Recording, ...]:
        """Recordings by their ids. Raises `NotFound`, and `UnfitRecording` for one that was interrupted."""
        found = [self._stores.recordings.get(recording_id) for recording_id in ids]
        for stored in found:
            if stored.state is not RecordingState.COMPLETE:
                raise UnfitRecording(f"recording {stored.info.id} is {stored.state.value}: kept, but not for analysis")
        named = zip(found, self._names(found), strict=True)
        return tuple(self._stores.recordings.load(one.info.id, name) for one, name in named)

    def _names(self, found: Sequence[StoredRecording]) -> list[str]:
        """Names of recordings in the texts of an analysis: job and station, where they are not all of one job.

        Empty: that of its file.
        """
        jobs = {one.job_id for one in found}
        if len(jobs) < 2:
            return [""] * len(found)
        numbers = {job_id: self._read_job(job_id).number for job_id in jobs if job_id is not None}
        stations = ["" if one.info.station is None else f", {one.info.station.label}" for one in found]
        return [
            "" if one.job_id is None else f"job #{numbers[one.job_id]}{station}"
            for one, station in zip(found, stations, strict=True)
        ]


def _unit_of(of_evidence: set[str], named: str | None) -> str | None:
    """The one unit of the evidence, or the named one where there is none. Raises `UnfitRecording`, `BadParameter`."""
    if len(of_evidence) > 1:
        raise UnfitRecording(f"the evidence is of several units: {', '.join(sorted(of_evidence))}")
    if named is not None and of_evidence - {named}:
        raise BadParameter("unit", named, f"{min(of_evidence)}, the unit of the evidence, or none")
    return named or next(iter(of_evidence), None)


def _require_each_once(field: str, ids: Sequence[str]) -> None:
    """Refuse evidence that is given twice, which would count as two. Raises `BadParameter`."""
    for position, known in enumerate(ids):
        if known in ids[:position]:
            raise BadParameter(
                f"{field}.{position}", known, "another id, or none: this one is given twice, and would count as two"
            )
