"""What the service can be asked, in one place: HTTP and command line say it in their own words."""

from collections.abc import Callable, Sequence
from datetime import timedelta
from random import SystemRandom

from bench_service.jobs.analyses import AnalysisDesk
from bench_service.jobs.campaigns.desk import CampaignDesk
from bench_service.jobs.driver import BenchDriver, TrueTriad
from bench_service.jobs.errors import IllegalTransition, NotDriving, NotFound
from bench_service.jobs.job import Job, JobState
from bench_service.jobs.live import LiveBoard
from bench_service.jobs.planning import CONTEXT, Plan, Planner, register
from bench_service.jobs.request import JobRequest, fingerprint
from bench_service.jobs.store import Stores
from bench_service.jobs.stored import BenchStop, Idempotency, StoredResult
from bench_service.jobs.worker import Worker
from bench_service.wall_clock import new_id, now
from procedures.core.errors import BadParameter

SEEDS = SystemRandom()
CRASHED_IMPORT = timedelta(hours=1)
"""An import that is not sealed after this long will never be: its process is gone."""


class BenchService:
    """The machine room's front desk. Every verb is complete when it returns."""

    def __init__(
        self,
        stores: Stores,
        driver: BenchDriver,
        planner: Planner,
        worker: Worker | None,
        code_version: str,
        live: LiveBoard | None = None,
    ) -> None:
        self.live = live or LiveBoard(stores.live)
        self.stores = stores
        self.driver = driver
        self.planner = planner
        self.code_version = code_version
        self.analyses = AnalysisDesk(stores, planner, code_version)
        self._worker = worker
        self.campaigns = CampaignDesk(stores, planner, driver, self.analyses, self.submit, self.cancel)

    def register(self) -> None:
        """Remember the bench and its units, and forget what crashed imports left."""
        self.stores.units.put_bench(self.driver.description)
        self.stores.recordings.discard_open_imports(now() - CRASHED_IMPORT)
        for unit in self.driver.mounted():
            register(self.stores, unit)

    def begin(self, warm_up: Sequence[Callable[[], object]] = ()) -> None:
        """Begin to work, beside the first answers. The bench's lease must be held.

        `warm_up` is called once the engine runs and the numerics are loaded.
        """
        if self._worker is not None:
            self._worker.begin([lambda: (self.planner.catalog, self.analyses.methods), *warm_up])
            self.campaigns.conductor.begin()

    def ready(self) -> None:
        """Return once requests can be served in full. Raises `StorageFailure`, `NotDriving`."""
        self.stores.jobs.counts()
        if self._worker is not None:
            self._worker.require_engine()

    def stop(self) -> None:
        """End the service: the running job is left for the next start, the bench made safe."""
        self.campaigns.conductor.stop()
        if self._worker is not None:
            self._worker.shut_down()

    def submit(self, request: JobRequest, idempotency_key: str | None = None) -> Job:
        """Plan, store and queue a job. Raises what `Planner.plan` raises, `BadParameter` for an axis limit."""
        plan = self.planner.plan(request.procedure, request.unit, request.parameters, request.bench)
        if plan.violations:
            raise BadParameter("stations", plan.violations[0], "beyond an axis limit of the bench")
        if request.seed is not None and not plan.context.bench.simulated:
            raise BadParameter("seed", request.seed, "only a simulated bench has one")
        if self._worker is None:
            raise NotDriving("this process does not drive a bench; ask the service that does")
        register(self.stores, plan.context.unit)
        job = self._new_job(request, plan)
        key = None if idempotency_key is None else Idempotency(f"jobs:{idempotency_key}", fingerprint(request))
        stored = self.stores.jobs.add(job, key)
        self._wake()
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

    def stop_bench(self, bench_id: str, reason: str) -> Job | None:
        """Stop what the bench is doing, until it is released; the job that was running, if any.

        Its bench is safe once that job is cancelled. Jobs in the queue wait.
        """
        if bench_id != self.driver.description.id:
            raise NotFound("bench", bench_id)
        self.stores.units.stop_bench(BenchStop(bench_id, now(), reason))
        running = self.running_job()
        if running is None:
            return None
        try:
            return self.cancel(running.id)
        except IllegalTransition:
            return None

    def release_bench(self, bench_id: str) -> None:
        """Let a stopped bench work again; the jobs in its queue go on."""
        if bench_id != self.driver.description.id:
            raise NotFound("bench", bench_id)
        self.stores.units.release_bench(bench_id)
        self._wake()

    def running_job(self) -> Job | None:
        """The job that drives the bench now."""
        return self.stores.queue.running(self.driver.description.id)

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
        )
