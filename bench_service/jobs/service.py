"""What the service can be asked, in one place: HTTP and command line say it in their own words."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import timedelta
from functools import cached_property
from random import SystemRandom
from typing import Any

from bench_service.formats.description import ImportDescription
from bench_service.formats.import_file import ImportFile, read_import
from bench_service.jobs.driver import BenchDriver, TrueTriad
from bench_service.jobs.errors import IllegalTransition, NotDriving, NotFound
from bench_service.jobs.job import Job, JobState
from bench_service.jobs.planning import CONTEXT, Plan, Planner
from bench_service.jobs.runner import analysed, recordings_of
from bench_service.jobs.store import Stores
from bench_service.jobs.stored import Idempotency, NewRecording, RecordingState, StoredResult
from bench_service.jobs.worker import Worker
from bench_service.wall_clock import new_id, now
from procedures import methods
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.recording import Recording, RecordingInfo
from procedures.core.report import Report
from procedures.core.unit import Unit
from procedures.procedure import DatedCalibration, Evidence, Method, Outcome, Parameters

AnyMethod = Method[Parameters, Outcome]
SEEDS = SystemRandom()
CRASHED_IMPORT = timedelta(hours=1)
"""An import that is not sealed after this long will never be: its process is gone."""


@dataclass(frozen=True)
class JobRequest:
    """A job as a client asks for it."""

    procedure: str
    unit: str
    bench: str | None = None
    parameters: dict[str, Any] = field(default_factory=dict[str, Any])
    priority: int = 10
    labels: dict[str, str] = field(default_factory=dict[str, str])
    seed: int | None = None


@dataclass(frozen=True)
class AnalysisRequest:
    """A method and what it is to work on."""

    method: str
    recordings: tuple[str, ...] = ()
    calibrations: tuple[str, ...] = ()
    parameters: dict[str, Any] = field(default_factory=dict[str, Any])


class BenchService:
    """The machine room's front desk. Every verb is complete when it returns."""

    def __init__(
        self,
        stores: Stores,
        driver: BenchDriver,
        planner: Planner,
        worker: Worker | None,
        code_version: str,
    ) -> None:
        self.stores = stores
        self.driver = driver
        self.planner = planner
        self.code_version = code_version
        self._worker = worker

    @cached_property
    def methods(self) -> Mapping[str, AnyMethod]:
        """Every method by name."""
        return methods.discover()

    def register(self) -> None:
        """Remember the bench and its units, and forget what crashed imports left."""
        self.stores.units.put_bench(self.driver.description)
        self.stores.recordings.discard_open_imports(now() - CRASHED_IMPORT)
        for unit in self.driver.mounted():
            self._register(unit)

    def begin(self, warm_up: Sequence[Callable[[], object]] = ()) -> None:
        """Begin to work, beside the first answers. The bench's lease must be held.

        `warm_up` is called once the engine runs and the numerics are loaded.
        """
        if self._worker is not None:
            self._worker.begin([lambda: (self.planner.catalog, self.methods), *warm_up])

    def ready(self) -> None:
        """Return once requests can be served in full. Raises `StorageFailure`, `NotDriving`."""
        self.stores.jobs.counts()
        if self._worker is not None:
            self._worker.require_engine()

    def stop(self) -> None:
        """End the service: the running job is left for the next start, the bench made safe."""
        if self._worker is not None:
            self._worker.shut_down()

    def submit(self, request: JobRequest, idempotency_key: str | None = None) -> Job:
        """Plan, store and queue a job. Raises what `Planner.plan` raises, `BadParameter` for an axis limit."""
        plan = self.planner.plan(request.procedure, request.unit, request.parameters, request.bench)
        if plan.violations:
            raise BadParameter("orientations", plan.violations[0], "beyond an axis limit of the bench")
        if request.seed is not None and not plan.context.bench.simulated:
            raise BadParameter("seed", request.seed, "only a simulated bench has one")
        if self._worker is None:
            raise NotDriving("this process does not drive a bench; ask the service that does")
        self._register(plan.context.unit)
        job = self._new_job(request, plan)
        key = None if idempotency_key is None else Idempotency(f"jobs:{idempotency_key}", fingerprint(request))
        stored = self.stores.jobs.add(job, key)
        self._worker.require_engine().enqueue(stored)
        return stored

    def cancel(self, job_id: str) -> Job:
        """Ask a job to end. Raises `IllegalTransition` where it has ended."""
        return self.stores.jobs.request_cancel(job_id, now())

    def stop_bench(self, bench_id: str) -> Job | None:
        """Stop what the bench is doing; the job that was running, if any. Its bench is safe once it is cancelled."""
        if bench_id != self.driver.description.id:
            raise NotFound("bench", bench_id)
        running = self.running_job()
        if running is None:
            return None
        try:
            return self.cancel(running.id)
        except IllegalTransition:
            return None

    def running_job(self) -> Job | None:
        """The job that drives the bench now."""
        return None if self._worker is None else self._worker.running_job()

    def result_of(self, job_id: str) -> StoredResult:
        """The result that gave the job its verdict. Raises `NotFound` where there is none (yet)."""
        job = self.stores.jobs.get(job_id)
        if job.result_id is None:
            raise NotFound("result of job", job_id, f"it is {job.state.value}")
        return self.stores.results.get(job.result_id)

    def truth(self, job_id: str) -> tuple[TrueTriad, ...]:
        """What a simulated unit really was in a job. Raises `NotFound` on a real bench."""
        job = self.stores.jobs.get(job_id)
        if not job.simulated or job.seed is None:
            raise NotFound("truth of job", job_id, "nobody knows it on a real bench")
        return self.driver.truth(job.unit, job.seed)

    def analyse_again(self, job_id: str, parameters: dict[str, Any], key: str | None = None) -> StoredResult:
        """Analyse a job's recordings with other parameters; the first result stays as it is."""
        job = self.stores.jobs.get(job_id)
        recordings = recordings_of(self.stores, job_id)
        if len(recordings) < len(job.stations):
            raise UnfitRecording(f"job {job_id} has {len(recordings)} of its {len(job.stations)} recordings")
        merged = {**job.requested_parameters, **parameters}
        result = analysed(job, self.planner.procedure(job.procedure), merged, recordings, self.code_version)
        idempotency = None if key is None else Idempotency(f"again:{key}", fingerprint([job_id, parameters]))
        return self.stores.results.add(result.stored, result.calibrations, False, idempotency)

    def run_method(self, request: AnalysisRequest, key: str | None = None) -> StoredResult:
        """Run a method on stored recordings or calibrations. Raises `NotFound`, `DomainError`, `ValidationError`."""
        method = self.method(request.method)
        params = method.params.model_validate(request.parameters)
        used = [self.stores.results.calibration(c) for c in request.calibrations]
        dated = tuple(DatedCalibration(c.id, c.made_at.isoformat(), c.triads) for c in used)
        evidence = Evidence(self._complete(request.recordings), dated)
        units = {r.info.unit for r in evidence.recordings} | {c.unit for c in used}
        if len(units) > 1:
            raise UnfitRecording(f"the evidence is of several units: {', '.join(sorted(units))}")
        serial = next(iter(units), None)
        outcome = method.analyse(evidence, params, None if serial is None else self.stores.units.unit(serial))
        stored = StoredResult(
            id=new_id(),
            kind="method",
            name=method.name,
            version=method.version,
            parameters=params.model_dump(mode="json"),
            document=outcome.model_dump(mode="json"),
            verdict=outcome.verdict,
            recordings=tuple((r.info.id, r.info.content_hash) for r in evidence.recordings),
            calibrations=request.calibrations,
            code_version=self.code_version,
            simulated=any(r.info.simulated for r in evidence.recordings) or any(c.simulated for c in used),
            created_at=now(),
            unit=serial,
        )
        idempotency = None if key is None else Idempotency(f"analyses:{key}", fingerprint(request))
        return self.stores.results.add(stored, method.calibrations(outcome), False, idempotency)

    def import_recording(
        self, files: Sequence[ImportFile], description: ImportDescription, key: str | None = None
    ) -> RecordingInfo:
        """Store recorded files as one recording of a unit, which is registered where it is new.

        Raises `DomainError` naming file and row, `StorageFull`; then nothing of the recording remains.
        """
        imported = read_import(files, description)
        idempotency = None if key is None else Idempotency(f"recordings:{key}", fingerprint(imported.source))
        recordings = self.stores.recordings
        first = recordings.made_before(idempotency)
        if first is not None:
            return first
        self._register(Unit(description.unit, imported.rate_hz, imported.channels))
        writer = recordings.open(
            NewRecording(
                unit=description.unit,
                channels=imported.channels,
                rate_hz=imported.rate_hz,
                start_s=description.start_s,
                simulated=description.simulated,
                dtype=imported.dtype,
                source=imported.source,
                idempotency=idempotency,
            )
        )
        try:
            for block in imported.blocks():
                writer.write(block)
            return writer.seal()
        except BaseException:
            writer.abandon()
            raise

    def method(self, name: str) -> AnyMethod:
        """Raises `NotFound`."""
        if name not in self.methods:
            raise NotFound("method", name)
        return self.methods[name]

    def report(self, result: StoredResult) -> Report:
        """What a person is shown of a result."""
        entry = self.planner.catalog.get(result.name) if result.kind == "procedure" else self.methods.get(result.name)
        if entry is None:
            return Report(f"{result.name} is no longer in the catalogue; the document below is as it was stored.")
        return entry.report(entry.result.model_validate(result.document))

    def _complete(self, ids: Sequence[str]) -> tuple[Recording, ...]:
        """Recordings by id. Raises `NotFound`, and `UnfitRecording` for one that was interrupted."""
        for recording_id in ids:
            stored = self.stores.recordings.get(recording_id)
            if stored.state is not RecordingState.COMPLETE:
                raise UnfitRecording(f"recording {recording_id} is {stored.state.value}: kept, but not for analysis")
        return tuple(self.stores.recordings.load(recording_id) for recording_id in ids)

    def _register(self, unit: Unit) -> None:
        """Remember a unit that is met for the first time."""
        try:
            self.stores.units.unit(unit.serial)
        except NotFound:
            self.stores.units.put_unit(unit)

    def _new_job(self, request: JobRequest, plan: Plan) -> Job:
        bench = plan.context.bench
        seed = request.seed if request.seed is not None else SEEDS.getrandbits(48)
        return Job(
            id=new_id(),
            procedure=plan.procedure.name,
            procedure_version=plan.procedure.version,
            unit=request.unit,
            bench=bench.id,
            state=JobState.QUEUED,
            created_at=now(),
            requested_parameters=request.parameters,
            parameters=plan.parameters.model_dump(mode="json"),
            context=CONTEXT.dump_python(plan.context, mode="json"),
            stations=plan.stations,
            duration_s=plan.prediction.duration_s,
            code_version=self.code_version,
            simulated=bench.simulated,
            seed=seed if bench.simulated else None,
            priority=request.priority,
            labels=request.labels,
        )


def fingerprint(request: object) -> str:
    """A digest of what a client asked, the same for the same request."""
    return hashlib.sha256(json.dumps(request, sort_keys=True, default=vars).encode()).hexdigest()
