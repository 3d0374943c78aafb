"""The job engine, DBOS, behind four verbs. The only file that imports it.

Jobs wait in the service's own table (`bench_service.jobs.dispatcher`); here a claimed job is run, as a workflow that
survives the process: one step per station, steps that may be repeated. An operator's cancel is a flag of the service
that the steps see (a cancelled DBOS workflow would free the bench while it still moves); the workflow then makes the
bench safe and ends. The version is the procedures' contract, not a hash of the sources, so a new build resumes the jobs
of the old one.
"""

import json
import logging
from collections.abc import Callable, Generator
from contextlib import contextmanager
from threading import Event, Lock
from typing import Any

from dbos import DBOS, DBOSConfig, Serializer, SetWorkflowID
from pydantic import TypeAdapter

from bench_service.bench.driven import ShuttingDown
from bench_service.jobs.dispatcher import Unfinished
from bench_service.jobs.queue import QueueEntry
from bench_service.jobs.runner import JobRunner, StepOutcome
from bench_service.model.errors import NotUnderstood, ServiceError, StorageFailure, StorageFull, UnfitValue
from bench_service.model.job import Failure, Job
from bench_service.telemetry.defects import described

PROCEDURE_ABI = "1"
"""Version of the workflows' contract: raise it when this code can no longer continue stored workflows."""
RETRY_S = 0.5
"""Interval between two attempts to write a bad end that could not be written [s]."""
LISTEN_S = 0.1
"""Interval at which DBOS looks for messages on SQLite [s]. Nobody sends any, so that a look costs nothing; but the
service's end waits for the next one."""
MAX_RECOVERIES = 50
"""Maximum number of times that a job may take the service down before it is given up."""

ALIVE = frozenset({"PENDING", "ENQUEUED"})
"""States of a workflow that DBOS runs, or will run after it recovered it."""

OUTCOME = TypeAdapter(StepOutcome)
log = logging.getLogger(__name__)


class JsonSerializer(Serializer):
    """Serializer of the outputs of steps as JSON for DBOS: a database that can be read, and no pickle in it."""

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
    """Runs jobs of one bench durably, in this process. One engine is one DBOS application, named after its bench.

    H1: an operator's cancel is a flag that the steps see, so the bench is never free before it is safe.
    H2: one process has the bench's lease, and `_one_at_a_time` lets one workflow in whatever DBOS recovers.
    H3: DBOS recovers over a queue that every worker of an application polls: so each bench is an application.
    H4: a job whose workflow is of another version is reported as such (`unfinished`), and its workflow is ended.
    """

    def __init__(
        self,
        database_url: str,
        connection: dict[str, Any],
        bench_id: str,
        runner: JobRunner,
        understood: Callable[[Exception], Exception],
        ending_s: float,
    ) -> None:
        """Set up with `understood`: translates errors of the engine's own database into the service's own classes.

        `ending_s`: time that the running job may take to leave the bench safe when the service ends [s].
        """
        self._ending_s = ending_s
        self._understood = understood
        self._version = f"{bench_id}:{PROCEDURE_ABI}"
        self._runner = runner
        self._last = StepOutcome()
        self._ending = Event()
        self._one_at_a_time = Lock()
        config: DBOSConfig = {
            "name": f"bench-{bench_id}",
            "system_database_url": database_url,
            "db_engine_kwargs": connection,
            "executor_id": f"bench:{bench_id}",
            "application_version": self._version,
            "serializer": JsonSerializer(),
            "log_level": "WARNING",
            "console_log_level": "ERROR",
            "max_executor_threads": 8,
            "notification_listener_polling_interval_sec": LISTEN_S,
        }
        self._dbos = DBOS(config=config)

        @DBOS.workflow(name="run_job", max_recovery_attempts=MAX_RECOVERIES)
        def run_job(job_id: str, attempt: int) -> None:
            with self._one_at_a_time:
                self._run_job(job_id, attempt)

        self._workflow = run_job

    def launch(self) -> None:
        """Start working on jobs; jobs orphaned by a dead process resume. The bench's lease must be held.

        Raises the error that kept it from starting; then nothing is left running.
        """
        try:
            DBOS.listen_queues([])
            with _failure_said_once():
                DBOS.launch()
            self._never_wait_for_the_database()
        except Exception as error:
            DBOS.destroy(destroy_registry=True)
            raise self._understood(error) from error

    def run(self, job: Job) -> None:
        """Run a claimed job as a workflow, and block until it has ended. Raises `ShuttingDown`, or the error that kept
        its workflow unwritten.
        """
        with SetWorkflowID(_workflow_id(job), workflow_id_reuse_policy="reject"):
            handle = DBOS.start_workflow(self._workflow, job.id, job.attempt)
        handle.get_result()

    def unfinished(self, job: QueueEntry) -> Unfinished:
        """Return the state of a running job's workflow; one of another version of the service is cancelled, and counts
        as gone.
        """
        status = DBOS.get_workflow_status(_workflow_id(job))
        if status is None:
            return Unfinished()
        if status.app_version != self._version:
            if status.status in ALIVE:
                DBOS.cancel_workflow(status.workflow_id)  # or an older version that is started again would resume it
            begun = f"begun by version {status.app_version} of the procedures; this is {self._version}"
            return Unfinished(gone=Failure("OtherVersion", begun))
        if status.status in ALIVE:
            return Unfinished(alive=True)
        return Unfinished(gone=Failure("EngineGaveUp", f"the job engine ended this job as {status.status}"))

    def shut_down(self) -> None:
        """Stop working, and wait until the running job has left the bench safe; it resumes after the next start."""
        self._ending.set()
        if self._one_at_a_time.acquire(timeout=self._ending_s):
            self._one_at_a_time.release()
        DBOS.destroy(destroy_registry=True)

    def _never_wait_for_the_database(self) -> None:
        """Make DBOS fail at once without its database: otherwise it would block a step, and the bench stay as it is.

        Its `DBOSClient` has a setting for this; for an application only the field behind it can be set.
        """
        books = self._dbos._sys_db  # pyright: ignore[reportPrivateUsage]
        if not hasattr(books, "_retry_connection_errors"):
            raise RuntimeError("this DBOS cannot be told not to wait for its database: see Engine.launch")
        books._retry_connection_errors = False  # pyright: ignore[reportPrivateUsage]

    def _run_job(self, job_id: str, attempt: int) -> None:
        runner = self._runner
        if self._ending.is_set():
            raise ShuttingDown
        self._last = StepOutcome()
        try:
            count = runner.stations(job_id, attempt)
            if count < 0:
                return
            outcome = self._stations(job_id, count)
            if outcome.good and count > 0:
                outcome = self._checked("safe", lambda: runner.make_safe(job_id))
            if outcome.good:  # no step of its own: it may be repeated, and its end is in the service's own tables
                outcome = runner.conclude(job_id)
        except ShuttingDown:
            self._make_safe(job_id)
            raise
        except (Exception, SystemExit) as error:  # the job must still end, and the bench be safe
            self._make_safe(job_id)
            unexpected = self._unexpected(job_id, error)
            outcome = unexpected if self._last.good else self._last
        if not outcome.good:
            self._end(job_id, outcome)

    def _make_safe(self, job_id: str) -> None:
        """Make an open bench safe at once after any other end of a job, whether or not the database answers."""
        while True:
            try:
                self._runner.make_safe(job_id)
                return
            except ServiceError as error:
                log.warning("the bench of job %s is not known yet: %s", job_id, error)
            if self._ending.wait(RETRY_S):
                return

    def _end(self, job_id: str, outcome: StepOutcome) -> None:
        """Write a bad end as soon as possible: while the disk is full the job waits, and the bench is safe already.

        An end that can never be written is left to the dispatcher, which sees a job whose workflow has ended.
        """
        while True:
            try:
                self._runner.end_early(job_id, outcome)
                return
            except (NotUnderstood, UnfitValue):  # its end cannot be written: the dispatcher interrupts it
                return
            except (StorageFull, StorageFailure) as error:
                log.warning("the end of job %s cannot be stored yet: %s", job_id, error)
            if self._ending.wait(RETRY_S):
                raise ShuttingDown

    def _checked(self, name: str, work: Callable[[], StepOutcome]) -> StepOutcome:
        """Run a step with an outcome; the last outcome is kept, should the engine's own database fail after it."""

        def run() -> Any:
            self._last = work()
            return OUTCOME.dump_python(self._last)

        return OUTCOME.validate_python(_step(name, run))

    def _stations(self, job_id: str, count: int) -> StepOutcome:
        for index in range(count):
            outcome = self._checked(f"station {index}", lambda k=index: self._station(job_id, k))
            if not outcome.good:
                return outcome
        return StepOutcome()

    def _station(self, job_id: str, index: int) -> StepOutcome:
        """Record one station's samples. After a bad outcome make the bench safe before the engine notes it."""
        try:
            outcome = self._runner.acquire(job_id, index)
        except (Exception, SystemExit) as error:
            outcome = self._unexpected(job_id, error)
        if not outcome.good:
            self._make_safe(job_id)
        return outcome

    def _unexpected(self, job_id: str, raised: Exception | SystemExit) -> StepOutcome:
        """The outcome of an unexpected error: a defect, or a failure of the database."""
        error = self._understood(raised) if isinstance(raised, Exception) else raised
        refused = isinstance(error, ServiceError)
        said = str(error) if refused else described(error)
        log.error("job %s failed inside the service: %s", job_id, said, exc_info=None if refused else error)
        return StepOutcome(Failure(type(error).__name__ if refused else "InternalError", said))


@contextmanager
def _failure_said_once() -> Generator[None]:
    """Drop the traceback that DBOS logs of a failed launch: it raises the error too, and the caller reports it."""
    logger = logging.getLogger("dbos")

    def dropped(record: logging.LogRecord) -> bool:
        return record.exc_info is None

    logger.addFilter(dropped)
    try:
        yield
    finally:
        logger.removeFilter(dropped)


def _workflow_id(job: Job | QueueEntry) -> str:
    """The id of a job's workflow: each attempt is a workflow of its own."""
    return f"{job.id}/{job.attempt}"


def _step(name: str, work: Any) -> Any:
    """Run a step once: after a crash a finished one gives its stored output."""
    return DBOS.run_step({"name": name}, work)
