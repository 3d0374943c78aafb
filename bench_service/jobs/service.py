"""Jobs for clients: submit, cancel, pause, resume, change the priority, read results."""

import logging
from collections.abc import Callable
from dataclasses import replace
from random import SystemRandom

from bench_service.bench.driver import BenchDriver, TrueTriad
from bench_service.evidence.units import register
from bench_service.jobs.planning import Plan, Planner
from bench_service.jobs.queue import QueueEntry
from bench_service.jobs.queue_service import QueueService
from bench_service.jobs.stores import JobStores
from bench_service.jobs.worker import Worker
from bench_service.mapping import copied
from bench_service.model.context import context_document
from bench_service.model.errors import NotFound
from bench_service.model.job import Job, JobState
from bench_service.model.records import Idempotency, StoredResult
from bench_service.model.request import JobRequest
from bench_service.telemetry.log_context import about
from bench_service.wall_clock import new_id, now
from procedures.core.errors import BadParameter

log = logging.getLogger(__name__)
SEEDS = SystemRandom()


class JobService:
    """Operations of clients on jobs; each is complete when it returns."""

    def __init__(
        self,
        stores: JobStores,
        planner: Planner,
        queues: QueueService,
        driver: BenchDriver | None,
        worker: Worker | None,
        code_version: str,
        wake: Callable[[str], None],
    ) -> None:
        """Set up with `driver` and `worker` of this process's bench, if any; `wake` has a bench's queue looked at."""
        self._stores = stores
        self._planner = planner
        self._queues = queues
        self._driver = driver
        self._worker = worker
        self._code_version = code_version
        self._wake = wake

    def submit(self, request: JobRequest, key: str | None = None, requested_by: str = "", *, team: str = "") -> Job:
        """Plan a job, refuse it or store and queue it, and return it. Raises the errors of `Planner.plan`,
        `BadParameter` for a violated limit of the bench, a seed or a reservation that does not fit.

        `team`: of the campaign run to which it belongs. A known `key` returns the job that it made.
        """
        idempotency = Idempotency.of("jobs", key, request)
        known = self._stores.keys.made(idempotency, "job")
        if known is not None:
            return self._stores.jobs.get(known)
        plan = self._planner.plan(request.procedure, request.unit, request.parameters, request.bench, request.mounting)
        if plan.violations:
            raise BadParameter("stations", plan.violations[0], "beyond a limit of the bench")
        if request.seed is not None and not plan.context.bench.simulated:
            raise BadParameter("seed", request.seed, "null: only a simulated bench has a seed")
        if request.reservation is not None:
            self._queues.usable(request.reservation, plan.context.bench.id, request.unit)
        register(self._stores.units, plan.context.unit)
        job = replace(self._new_job(request, plan, requested_by), team=team)
        stored = self._stores.jobs.add(job, idempotency)
        self._wake(stored.bench)
        with about(job=stored.id):
            log.info("%s on %s queued", stored.procedure, stored.unit)
        return stored

    def cancel(self, job_id: str, by: str = "", reason: str = "") -> Job:
        """Store the request to cancel a job, with its author and reason, and return the job. Raises `IllegalTransition`
        where it has ended.
        """
        return self._stores.jobs.request_cancel(job_id, now(), by, reason)

    def pause(self, job_id: str) -> Job:
        """Pause a job, a running one before its next station, and return it. Raises `IllegalTransition` where it has
        ended.
        """
        return self._stores.jobs.request_pause(job_id, now())

    def resume(self, job_id: str) -> Job:
        """Requeue a paused or interrupted job with the stations that remain, and return it. Raises
        `IllegalTransition`.
        """
        job = self._stores.jobs.resume(job_id, now())
        self._wake(job.bench)
        return job

    def set_priority(self, job_id: str, priority: int) -> Job:
        """Change the priority of a queued job and return it. Raises `IllegalTransition` where it is not queued."""
        return self._stores.queue.set_priority(job_id, priority, now())

    def running_job(self, bench_id: str) -> QueueEntry | None:
        """Return the bench's job in state running, as the database has it; None where there is none."""
        return self._stores.queue.running(bench_id)

    def driving_job(self, bench_id: str) -> str | None:
        """Return the id of the job that drives a bench now, or None; a job whose end only waits to be written no longer
        drives it.
        """
        if self._worker is not None and self._driver is not None and self._driver.description.id == bench_id:
            driving = self._worker.running_job()
        else:
            driving = self.running_job(bench_id)
        return None if driving is None else driving.id

    def result_of(self, job_id: str) -> StoredResult:
        """Return the result that gave the job its verdict. Raises `NotFound` where it has none (yet)."""
        job = self._stores.jobs.get(job_id)
        if job.result_id is None:
            raise NotFound("result of job", job_id, f"it is {job.state.value}")
        return self._stores.results.get(job.result_id)

    def truth(self, job_id: str) -> tuple[TrueTriad, ...]:
        """Return the true values of a simulated unit in a job, one a triad. Raises `NotFound` on a real bench."""
        job = self._stores.jobs.get(job_id)
        if not job.simulated or job.seed is None:
            raise NotFound("truth of job", job_id, "the truth of a real bench is not known")
        if self._driver is None or self._driver.description.id != job.bench:
            raise NotFound("truth of job", job_id, f"only the process that drives bench {job.bench} has it")
        return self._driver.truth(job.unit, job.seed)

    def _new_job(self, request: JobRequest, plan: Plan, requested_by: str) -> Job:
        bench, created_at = plan.context.bench, now()
        seed = request.seed if request.seed is not None else SEEDS.getrandbits(48)
        return copied(
            Job,
            request,
            id=new_id(),
            procedure_version=plan.procedure.version,
            bench=bench.id,
            state=JobState.QUEUED,
            created_at=created_at,
            queued_at=created_at,
            requested_parameters=request.parameters,
            parameters=plan.parameters.model_dump(mode="json"),
            context=context_document(plan.context),
            mounting=None if plan.context.mounting is None else plan.context.mounting.id,
            stations=plan.stations,
            duration_s=plan.prediction.duration_s,
            code_version=self._code_version,
            simulated=bench.simulated,
            seed=seed if bench.simulated else None,
            retries_left=request.retries,
            requested_by=requested_by,
        )
