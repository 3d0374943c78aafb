"""The job engine, DBOS, behind four verbs. The only file that knows it.

One queue per bench with one job at a time, one step per station, steps that may be repeated. An operator's cancel is a
flag of our own that the steps see (a cancelled DBOS workflow would free the bench while it still moves); the workflow
then makes the bench safe and ends. The version is the procedures' contract, not a hash of the sources, so a
new build goes on with the jobs of the old one.
"""

import json
import logging
from collections.abc import Callable
from threading import Event
from typing import Any

from dbos import DBOS, DBOSConfig, Serializer, SetEnqueueOptions, SetWorkflowID
from pydantic import TypeAdapter

from bench_service.jobs.errors import ServiceError
from bench_service.jobs.job import Failure, Job, JobState
from bench_service.jobs.runner import JobRunner, StepOutcome
from bench_service.jobs.session import ShuttingDown
from bench_service.jobs.store import JobStore
from bench_service.wall_clock import now

PROCEDURE_ABI = "1"
"""Raise it when stored workflows can no longer be continued by this code."""
SHUT_DOWN_S = 20.0
"""How long the running job may take to leave the bench safe when the service ends [s]."""
RETRY_S = 0.5
"""How often a bad end that could not be written is tried again [s]."""
MAX_RECOVERIES = 50
"""How often a job may take the service down before it is given up."""

OUTCOME = TypeAdapter(StepOutcome)
log = logging.getLogger(__name__)


class JsonSerializer(Serializer):
    """Step outputs as JSON: a database that can be read, and no pickle in it."""

    def serialize(self, data: Any) -> str:
        if isinstance(data, Exception):
            return json.dumps({"error": f"{type(data).__name__}: {data}"})
        return json.dumps(data)

    def deserialize(self, serialized_data: str) -> Any:
        data = json.loads(serialized_data)
        if isinstance(data, dict) and set(data) == {"error"}:
            return RuntimeError(data["error"])
        return data

    def name(self) -> str:
        return "json"


class Engine:
    """Runs jobs of one bench, in this process, durably."""

    def __init__(
        self,
        database_url: str,
        connection: dict[str, Any],
        bench_id: str,
        poll_s: float,
        runner: JobRunner,
        jobs: JobStore,
    ) -> None:
        self._queue = f"bench:{bench_id}"
        self._poll_s = poll_s
        self._runner = runner
        self._jobs = jobs
        self._last = StepOutcome()
        self._ending = Event()
        self._idle = Event()
        self._idle.set()
        config: DBOSConfig = {
            "name": "bench",
            "system_database_url": database_url,
            "db_engine_kwargs": connection,
            "executor_id": f"bench:{bench_id}",
            "application_version": PROCEDURE_ABI,
            "serializer": JsonSerializer(),
            "log_level": "WARNING",
            "console_log_level": "ERROR",
            "max_executor_threads": 8,
            "notification_listener_polling_interval_sec": 1.0,
        }
        DBOS(config=config)

        @DBOS.workflow(name="run_job", max_recovery_attempts=MAX_RECOVERIES)
        def run_job(job_id: str, attempt: int = 1) -> None:
            self._idle.clear()
            try:
                self._run_job(job_id, attempt)
            finally:
                self._idle.set()

        self._workflow = run_job

    def launch(self) -> None:
        """Start working; jobs that a dead process left go on. The bench's lease must be held."""
        DBOS.listen_queues([self._queue])
        DBOS.launch()
        DBOS.register_queue(
            self._queue,
            concurrency=1,
            worker_concurrency=1,
            polling_interval_sec=self._poll_s,
            on_conflict="always_update",
        )
        self._reconcile()

    def enqueue(self, job: Job) -> None:
        """Queue a job's present attempt; queueing it twice is a no-op."""
        with SetWorkflowID(_workflow_id(job)), SetEnqueueOptions(priority=job.priority):
            DBOS.enqueue_workflow(self._queue, self._workflow, job.id, job.attempt)

    def shut_down(self) -> None:
        """Stop working, once the running job has left the bench safe; it goes on after the next start."""
        self._ending.set()
        self._idle.wait(SHUT_DOWN_S)
        DBOS.destroy(destroy_registry=True)

    def _run_job(self, job_id: str, attempt: int) -> None:
        runner = self._runner
        runner.wait_for_release(job_id)
        try:
            self._last = StepOutcome()
            count: int = _step("prepare", lambda: runner.prepare(job_id, attempt))
            if count < 0:
                return
            outcome = self._stations(job_id, count)
            if count > 0:
                safe = self._checked("safe", lambda: runner.make_safe(job_id))
                outcome = outcome if not outcome.good else safe
            if outcome.good:
                outcome = self._checked("conclude", lambda: runner.conclude(job_id))
        except ShuttingDown:
            runner.make_safe(job_id)
            raise
        except Exception as error:  # a defect, or books that cannot be kept: the job must still end, and the bench safe
            log.exception("job %s failed inside the service", job_id)
            runner.make_safe(job_id)
            unexpected = StepOutcome(Failure("InternalError", f"{type(error).__name__}: {error}"))
            outcome = unexpected if self._last.good else self._last
        if not outcome.good:
            self._end(job_id, outcome)

    def _end(self, job_id: str, outcome: StepOutcome) -> None:
        """Note a bad end, as soon as it can be: while the disk is full the job waits, and the bench is safe already."""
        while True:
            try:
                job = self._runner.end_early(job_id, outcome)
                if job.state is JobState.QUEUED:  # the wish to pause was taken back while the bench was made safe
                    self.enqueue(job)
                return
            except ServiceError as error:
                log.warning("the end of job %s cannot be noted yet: %s", job_id, error)
            if self._ending.wait(RETRY_S):
                raise ShuttingDown

    def _checked(self, name: str, work: Callable[[], StepOutcome]) -> StepOutcome:
        """A step with an outcome; the last one is remembered, should the engine's own books fail after it."""

        def run() -> Any:
            self._last = work()
            return OUTCOME.dump_python(self._last)

        return OUTCOME.validate_python(_step(name, run))

    def _stations(self, job_id: str, count: int) -> StepOutcome:
        runner = self._runner
        for index in range(count):
            outcome = self._checked(f"station {index}", lambda k=index: runner.acquire(job_id, k))
            if not outcome.good:
                return outcome
        return StepOutcome()

    def _reconcile(self) -> None:
        """Make our jobs and the engine's workflows agree after a crash or a change of version."""
        for state in (JobState.QUEUED, JobState.RUNNING):
            cursor: str | None = None
            while True:
                page = self._jobs.list(state=state, after=cursor, limit=200)
                for job in page.items:
                    self._reconcile_job(job)
                cursor = page.next
                if cursor is None:
                    break

    def _reconcile_job(self, job: Job) -> None:
        if f"bench:{job.bench}" != self._queue:
            return
        status = DBOS.get_workflow_status(_workflow_id(job))
        if status is None:
            self.enqueue(job)
        elif status.status in ("ERROR", "CANCELLED", "MAX_RECOVERY_ATTEMPTS_EXCEEDED"):
            failure = Failure("EngineGaveUp", f"the job engine ended this job as {status.status}")
            self._jobs.transition(job.id, JobState.INTERRUPTED, at=now(), failure=failure)
        elif status.app_version not in (None, PROCEDURE_ABI):
            failure = Failure(
                "OtherVersion", f"begun by version {status.app_version} of the procedures, this is {PROCEDURE_ABI}"
            )
            self._jobs.transition(job.id, JobState.INTERRUPTED, at=now(), failure=failure)


def _workflow_id(job: Job) -> str:
    """The first attempt has the job's own id, each later one its number with it."""
    return job.id if job.attempt == 1 else f"{job.id}:{job.attempt}"


def _step(name: str, work: Any) -> Any:
    """Run a step once: after a crash a finished one gives its stored output."""
    return DBOS.run_step({"name": name}, work)
