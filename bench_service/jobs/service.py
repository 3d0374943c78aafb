"""What the service can be asked, in one place: HTTP and command line say it in their own words."""

import logging
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import timedelta
from random import SystemRandom

from bench_service.jobs.analyses import AnalysisDesk
from bench_service.jobs.campaigns.desk import CampaignDesk
from bench_service.jobs.driver import BenchDriver, TrueTriad
from bench_service.jobs.errors import IllegalTransition, NotDriving, NotFound, NotReady, NotUnderstood
from bench_service.jobs.job import Job, JobState
from bench_service.jobs.live import LiveBoard
from bench_service.jobs.log_context import about
from bench_service.jobs.planning import CONTEXT, Plan, Planner, register
from bench_service.jobs.queue import RunningJob
from bench_service.jobs.queue_desk import QueueDesk
from bench_service.jobs.request import JobRequest, fingerprint
from bench_service.jobs.safety import Safety, SafetyDesk
from bench_service.jobs.store import Stores
from bench_service.jobs.stored import BenchStop, Idempotency, StoredResult
from bench_service.jobs.tracing import Traces
from bench_service.jobs.worker import Worker
from bench_service.wall_clock import new_id, now
from procedures.core.errors import BadParameter

log = logging.getLogger(__name__)
SEEDS = SystemRandom()
CRASHED_IMPORT = timedelta(hours=1)
"""An import that is not sealed after this long will never be: its process is gone."""


LEAST_FREE_BYTES = 200_000_000
"""With less room on the database's disk the service says that it is not ready: an hour of samples is about 17 MB."""


class BenchService:
    """The machine room's front desk. Every verb is complete when it returns."""

    def __init__(
        self,
        stores: Stores,
        driver: BenchDriver | None,
        planner: Planner,
        worker: Worker | None,
        code_version: str,
        safety: SafetyDesk,
        live: LiveBoard | None = None,
        free_bytes: Callable[[], int | None] = lambda: None,
        traces: Traces | None = None,
    ) -> None:
        """`driver`: of this process's own bench; None: it plans and queues for benches that workers drive.

        `free_bytes`: room on the database's disk, where that is known.
        """
        self.safety = safety
        self.traces = traces or Traces()
        self.live = live or LiveBoard(stores.live)
        self.stores = stores
        self.driver = driver
        self.planner = planner
        self.code_version = code_version
        self.analyses = AnalysisDesk(stores, planner, code_version)
        self.benches = planner.benches
        self.queues = QueueDesk(stores, planner.benches, self._wake)
        self._worker = worker
        self._free_bytes = free_bytes
        self.campaigns = CampaignDesk(stores, planner, self.analyses, self.submit, self.cancel)

    def register(self) -> None:
        """Remember the bench and its units, and forget what crashed imports left."""
        self.stores.recordings.discard_open_imports(now() - CRASHED_IMPORT)
        if self.driver is None:
            return
        mounted = self.driver.mounted()
        for unit in mounted:
            register(self.stores, unit)
        self.stores.units.put_bench(self.driver.description, [unit.serial for unit in mounted])
        if self._worker is not None:
            self.safety.at_start(self.driver.description.id)

    def begin(self, warm_up: Sequence[Callable[[], object]] = ()) -> None:
        """Begin to work, beside the first answers. The bench's lease must be held.

        `warm_up` is called once the engine runs and the numerics are loaded.
        """
        if self._worker is not None:
            self._worker.begin([lambda: (self.planner.catalog, self.analyses.methods), *warm_up])
            self.campaigns.conductor.begin()

    def at_failed_start(self, then: Callable[[], object]) -> None:
        """Have `then` called where the engine does not start. To be said before `begin`."""
        if self._worker is not None:
            self._worker.at_failed_start(then)

    def failed_start(self) -> NotDriving | None:
        """Why this service can never work; None where it works, or may yet."""
        return None if self._worker is None else self._worker.failed_start()

    def require_start(self) -> None:
        """Wait until the engine runs. Raises `NotDriving` where it does not start."""
        if self._worker is not None:
            self._worker.require_engine()

    def ready(self) -> tuple[str, ...]:
        """Return once a job could start, with what a person should know all the same.

        A stopped bench is such a note: it refuses by a person's will, and the service works. Raises `NotReady` with
        every reason, `StorageFailure` where the database does not answer.
        """
        self.stores.jobs.counts()
        reasons: list[str] = []
        free = self._free_bytes()
        if free is not None and free < LEAST_FREE_BYTES:
            reasons.append(f"the disk is nearly full: {free} bytes are free, {LEAST_FREE_BYTES} are needed")
        if self._worker is not None:
            reasons += self._worker.troubles()
        if reasons:
            raise NotReady(reasons)
        stops = (self.stores.units.bench_stop(bench) for bench in self.benches.ids())
        return tuple(f"bench {stop.bench} is stopped: {stop.reason}" for stop in stops if stop is not None)

    def stop(self) -> None:
        """End the service: the running job is left for the next start, the bench made safe."""
        self.campaigns.conductor.stop()
        if self._worker is not None:
            self._worker.shut_down()

    def submit(self, request: JobRequest, idempotency_key: str | None = None, requested_by: str = "") -> Job:
        """Plan, store and queue a job. Raises what `Planner.plan` raises, `BadParameter` for an axis limit."""
        key = None if idempotency_key is None else Idempotency(f"jobs:{idempotency_key}", fingerprint(request))
        known = self.stores.keys.made(key, "job")
        if known is not None:
            return self.stores.jobs.get(known)
        plan = self.planner.plan(request.procedure, request.unit, request.parameters, request.bench)
        if plan.violations:
            raise BadParameter("stations", plan.violations[0], "beyond a limit of the bench")
        if request.seed is not None and not plan.context.bench.simulated:
            raise BadParameter("seed", request.seed, "only a simulated bench has one")
        if request.reservation is not None:
            self.queues.usable(request.reservation, plan.context.bench.id, request.unit)
        register(self.stores, plan.context.unit)
        job = replace(self._new_job(request, plan), requested_by=requested_by)
        stored = self.stores.jobs.add(job, key)
        self._wake()
        with about(job=stored.id):
            log.info("%s on %s queued", stored.procedure, stored.unit)
        return stored

    def cancel(self, job_id: str) -> Job:
        """Ask a job to end. Raises `IllegalTransition` where it has ended."""
        return self.stores.jobs.request_cancel(job_id, now())

    def pause(self, job_id: str) -> Job:
        """Put a job aside, a running one before its next station. Raises `IllegalTransition` where it has ended."""
        return self.stores.jobs.request_pause(job_id, now())

    def resume(self, job_id: str) -> Job:
        """Go on with a job that can be resumed, with the stations that remain. Raises `IllegalTransition`."""
        job = self.stores.jobs.resume(job_id, now())
        self._wake()
        return job

    def stop_bench(self, bench_id: str, reason: str) -> tuple[str | None, Safety]:
        """Stop what the bench is doing, wherever its worker is, until it is released; the id of the job that was
        running, if any, and what is known of the bench's safety then. Jobs in the queue wait.
        """
        self.benches.description(bench_id)
        self.stores.units.stop_bench(BenchStop(bench_id, now(), reason))
        running = self.running_job(bench_id)
        if running is not None:
            with suppress(IllegalTransition, NotUnderstood):  # it has ended this moment; or nobody here can read it
                self.cancel(running.id)
        return None if running is None else running.id, self.safety.stopping(bench_id)

    def release_bench(self, bench_id: str) -> None:
        """Let a stopped bench work again; the jobs in its queue go on. Raises `NotSafe` while it is not safe."""
        self.benches.description(bench_id)
        if self.stores.units.bench_stop(bench_id) is not None:
            self.safety.require(bench_id)
            self.stores.units.release_bench(bench_id)
        self._wake()

    def set_priority(self, job_id: str, priority: int) -> Job:
        """Change the place of a queued job. Raises `IllegalTransition` where it is not queued."""
        return self.stores.queue.set_priority(job_id, priority, now())

    def running_job(self, bench_id: str) -> RunningJob | None:
        """A bench's job that has begun and not ended."""
        return self.stores.queue.running(bench_id)

    def driving_job(self, bench_id: str) -> str | None:
        """The id of the job that drives a bench now; one that only waits for room to note its end drives it no more."""
        if self._worker is not None and self.driver is not None and self.driver.description.id == bench_id:
            driving = self._worker.running_job()
        else:
            driving = self.running_job(bench_id)
        return None if driving is None else driving.id

    def _wake(self) -> None:
        if self._worker is not None:
            self._worker.wake()

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
        if self.driver is None or self.driver.description.id != job.bench:
            raise NotFound("truth of job", job_id, f"the process that drives bench {job.bench} knows it")
        return self.driver.truth(job.unit, job.seed)

    def _new_job(self, request: JobRequest, plan: Plan) -> Job:
        bench, created_at = plan.context.bench, now()
        seed = request.seed if request.seed is not None else SEEDS.getrandbits(48)
        return Job(
            id=new_id(),
            procedure=plan.procedure.name,
            procedure_version=plan.procedure.version,
            unit=request.unit,
            bench=bench.id,
            state=JobState.QUEUED,
            created_at=created_at,
            queued_at=created_at,
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
            deadline_at=request.deadline_at,
            retries=request.retries,
            retries_left=request.retries,
            reservation=request.reservation,
        )
