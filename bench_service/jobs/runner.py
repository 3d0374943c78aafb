"""The steps of a job, each safe to repeat: the engine calls them, and knows nothing of their content."""

import logging
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from threading import Event, Lock

from bench_service.bench.driven import ShuttingDown
from bench_service.bench.driver import BenchDriver
from bench_service.bench.live.tap import LiveTap
from bench_service.bench.live.values import LiveBoard
from bench_service.bench.make_safe import Obstacle, SafetyOutcome, end_safely, has_register, over_new_link, still_unsafe
from bench_service.bench.processes import ProcessIdentity
from bench_service.bench.session import BenchSession
from bench_service.evidence.catalogue import AnyProcedure
from bench_service.evidence.job_analysis import analysed, recordings_of
from bench_service.evidence.spread_processes import SpreadProcesses
from bench_service.jobs.as_planned import require_as_planned
from bench_service.jobs.planning import Planner
from bench_service.jobs.queue import QueueEntry
from bench_service.jobs.retries import try_again
from bench_service.jobs.stop_queries import StopQueries
from bench_service.jobs.stores import JobStores
from bench_service.model.context import context_document, context_of
from bench_service.model.errors import ServiceError
from bench_service.model.job import Failure, Job, JobState
from bench_service.model.records import BenchStop, Idempotency, StoredResult
from bench_service.wall_clock import monotonic_s, now
from procedures.bench import BenchNeeds
from procedures.bench.errors import BenchError, Stopped
from procedures.core.errors import DomainError
from procedures.core.limits import Verdict
from procedures.procedure import Outcome

AGAIN_S = 1.0
"""Interval between two attempts at devices of a stopped bench that could not be made safe [s]."""

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class StepOutcome:
    """Outcome of a job's step for the workflow; small, because the engine stores it."""

    failure: Failure | None = None
    cancelled: bool = False
    paused: bool = False

    @property
    def good(self) -> bool:
        return self.failure is None and not self.cancelled and not self.paused


class JobRunner:
    """Runs the steps of jobs on the bench of this process, one job at a time; the job engine calls it."""

    def __init__(
        self,
        stores: JobStores,
        planner: Planner,
        driver: BenchDriver,
        code_version: str,
        lease_held: Callable[[], bool],
        live: LiveBoard | None = None,
        retry_scale: float = 1.0,
        stopped: Callable[[], bool] = lambda: False,
        spread: SpreadProcesses | None = None,
    ) -> None:
        """Set up with `lease_held`: returns whether this process holds the bench's lease; called before every station.

        `live`: the board for the bench's live state; None: it is not published.
        `retry_scale`: factor on the pauses before a retry; less than 1 where bench time is not real time.
        `stopped`: returns whether the bench is stopped over its host's stop channel; asks no database.
        `spread`: shares long analyses among processes; None: they are made here.
        """
        self._spread = spread
        self._stores = stores
        self._planner = planner
        self._driver = driver
        self._code_version = code_version
        self._lease_held = lease_held
        self._live = live
        self._retry_scale = retry_scale
        self._stopped = stopped
        self._queries = StopQueries(stores.benches, stores.jobs, driver.description.id, stopped)
        self._by = f"the service, {ProcessIdentity.own()}"
        self._session: BenchSession | None = None
        self._making_safe = Lock()
        """Held while a thread makes the bench of a job safe, the guard's or the job's own; never for a database."""
        self._again_s = 0.0
        self._ending = Event()

    def claim(self, entry: QueueEntry) -> Job | None:
        """Claim a queued job, with its unit's current data, and return it; None where it cannot begin any more."""
        job = self._stores.jobs.get(entry.id)
        context = self._planner.refreshed(context_of(job, self._stores.calibrations.several))
        return self._stores.queue.claim(entry, context_document(context), now())

    def stations(self, job_id: str, attempt: int) -> int:
        """Return the number of a claimed job's stations; with 0 stations nothing moves.

        -1 where there is nothing to do: the job has ended, is paused, or was requeued since.
        """
        job = self._stores.jobs.get(job_id)
        return len(job.stations) if job.state is JobState.RUNNING and job.attempt == attempt else -1

    def acquire(self, job_id: str, index: int) -> StepOutcome:
        """Record one station's samples. An existing recording means that a crash came between storing and noting it.

        Raises `ShuttingDown` when the service is ending.
        """
        if self._ending.is_set():
            raise ShuttingDown
        if self._stopped():  # before any query of the database
            return StepOutcome(cancelled=True)
        jobs, recordings = self._stores.jobs, self._stores.recordings
        if index in {r.info.station.index for r in recordings.of_job(job_id) if r.info.station}:
            jobs.station_done(job_id, index, now(), {})
            return StepOutcome()
        job = jobs.get(job_id)
        if job.cancel_requested or job.state is not JobState.RUNNING or self._queries.wanted(job_id):
            return StepOutcome(cancelled=True)
        if job.pause_requested:
            return StepOutcome(paused=True)
        if job.deadline_at is not None and now() > job.deadline_at:
            late = f"the job's deadline, {job.deadline_at.isoformat()}, has passed before station {index} began"
            return StepOutcome(Failure("DeadlinePassed", late, index))
        if not self._lease_held():
            return StepOutcome(Failure("LeaseLost", "another process may drive this bench now", index))
        try:
            require_as_planned(job, self._planner)
            session = self._session_of(job)
            if self._ending.is_set():  # set while the bench was being opened, when there was no session to end
                raise ShuttingDown
            info = session.record(index)
        except Stopped:
            moved = self._queries.moved_database(job_id)
            return StepOutcome(cancelled=True) if moved is None else StepOutcome(replace(moved, station=index))
        except (BenchError, DomainError, ServiceError) as error:
            return StepOutcome(Failure(type(error).__name__, str(error), index))
        jobs.station_done(
            job_id, index, now(), {"recording": info.id, "samples": info.count, "hash": info.content_hash}
        )
        return StepOutcome()

    def make_safe(self, job_id: str) -> StepOutcome:
        """Leave the bench safe; after a restart in which no session survived, without the procedure.

        Where it cannot be made safe the job ends and the bench is stopped: no other job runs on it until a person has
        looked.
        """
        session = self._session
        if session is None or session.job.id != job_id:
            if self._driver.device_state() is not None:
                with self._making_safe:
                    obstacle = over_new_link(self._driver, self._by)
                return StepOutcome() if obstacle is None else self._not_safe(job_id, obstacle.reason)
            job = self._stores.jobs.get(job_id)
            try:
                session = self._session_of(job)
            except (BenchError, ServiceError) as error:
                return self._not_safe(job_id, Obstacle((str(error),)).reason)
        end = self._end_safely(session)
        with self._making_safe:
            unsafe = still_unsafe(self._driver, self._by, "the job") if end.obstacle is None else end.obstacle.reason
        if unsafe is not None:
            return self._not_safe(job_id, unsafe)
        if end.detour:
            text = f"the bench was made safe over a new link: {end.detour}"
            self._stores.jobs.note(job_id, "note", now(), {"text": text})
        return StepOutcome()

    def stop_now(self) -> None:
        """Leave the running job's station and make the bench safe, also while the job's own thread hangs. Called by the
        stop guard; the job's end is noted by its own thread, as soon as possible.
        """
        session = self._session
        if session is None:
            return
        session.stop()
        if not has_register(self._driver):  # a bench without a register: its one link is the session's
            return
        end = self._end_safely(session)
        if end.obstacle is not None:
            log.error("job %s: %s", session.job.id, end.obstacle)

    def _end_safely(self, session: BenchSession) -> SafetyOutcome:
        def given_back() -> None:
            if self._session is session:
                self._session = None

        with self._making_safe:
            return end_safely(session, self._driver, self._by, given_back)

    def make_safe_again(self) -> None:
        """Make devices safe over a new link that an earlier attempt has given up, once in `AGAIN_S`.

        For a stopped bench without a supervisor: nobody else tries before a person releases it.
        """
        with self._making_safe:
            state = self._driver.device_state()
            if self._session is not None or state is None or state.safe or state.linked:
                return
            if monotonic_s() >= self._again_s:
                obstacle = over_new_link(self._driver, self._by)
                self._again_s = monotonic_s() + AGAIN_S
                if obstacle is not None and not obstacle.busy:
                    log.warning("the stopped bench %s is not safe yet: %s", self._driver.description.id, obstacle)

    def conclude(self, job_id: str) -> StepOutcome:
        """Analyse the recordings, store the result and its calibrations, and end the job with the verdict; may be
        repeated.
        """
        job = self._stores.jobs.get(job_id)
        if job.state is not JobState.RUNNING:  # a crash came after its end was stored, or another attempt has begun
            return StepOutcome()
        procedure = self._planner.catalogue.procedure(job.procedure)
        try:
            recordings = recordings_of(self._stores, job_id)
            context = context_of(job, self._stores.calibrations.several)
            with nullcontext() if self._spread is None else self._spread.used_for(recordings):
                result = analysed(job, context, procedure, job.parameters, recordings, self._code_version)
            stored = self._stores.results.add(
                result.stored,
                result.calibrations,
                idempotency=Idempotency(f"job:{job_id}", job_id),
                corrections=result.corrections,
            )
            self._remember(procedure, result.outcome, stored)
        except (DomainError, ServiceError) as error:
            return StepOutcome(Failure(type(error).__name__, str(error)))
        self._analysis_over()
        self._stores.jobs.transition(job_id, JobState.SUCCEEDED, at=now(), verdict=stored.verdict, result_id=stored.id)
        return StepOutcome()

    def end_early(self, job_id: str, outcome: StepOutcome) -> Job:
        """End a job that was cancelled or failed, retry it, or pause it; its complete recordings are kept."""
        job = self._stores.jobs.get(job_id)
        if job.state is not JobState.RUNNING:  # its end was stored, though the acknowledgement was lost
            return job
        self._stores.recordings.interrupt_open(job_id)
        self._analysis_over()
        if outcome.paused:
            return self._stores.jobs.put_aside(job_id, now())
        again = try_again(self._stores.queue, job, outcome.failure, self._retry_scale)
        if again is not None:
            return again
        to = JobState.CANCELLED if outcome.cancelled else JobState.FAILED
        verdict = None if outcome.cancelled else Verdict.ERROR
        return self._stores.jobs.transition(job_id, to, at=now(), verdict=verdict, failure=outcome.failure)

    def shut_down(self) -> None:
        """Have the session of the running job leave its station and make the bench safe: the service is ending."""
        self._ending.set()
        session = self._session
        if session is not None:
            session.shut_down()

    def _analysis_over(self) -> None:
        if self._spread is not None:
            self._spread.done()

    def running_job(self) -> Job | None:
        """Return the job whose session is open on the bench in this process; None where there is none."""
        session = self._session  # which another thread may close this moment
        return None if session is None else self._stores.jobs.get(session.job.id)

    def _remember(self, procedure: AnyProcedure, outcome: Outcome, stored: StoredResult) -> None:
        """Put a result's findings on its unit into the unit's record; repeated after a crash, it changes nothing."""
        if stored.unit is None:
            return
        unit = self._stores.units.unit(stored.unit)
        found = procedure.learns(outcome, unit, f"result {stored.id}")
        if found != unit:
            self._stores.units.put_unit(found)

    def _not_safe(self, job_id: str, reason: str) -> StepOutcome:
        """Stop the bench, for a reason whose subject is the bench."""
        text, by = f"the bench {reason}", f"the worker, {ProcessIdentity.own()}"
        self._stores.benches.stop_bench_once(BenchStop(self._driver.description.id, now(), reason, by=by))
        self._stores.jobs.note(job_id, "note", now(), {"text": text})
        return StepOutcome(Failure("NotSafe", text))

    def _session_of(self, job: Job) -> BenchSession:
        if self._session is not None and self._session.job.id == job.id:
            return self._session
        procedure = self._planner.catalogue.procedure(
            job.procedure
        )  # before a link is taken, which a failure here would leave open
        self._stores.recordings.interrupt_open(job.id)
        checkpoint = self._stores.recordings.checkpoint(job.id)
        bench = self._driver.open(job.unit, job.seed, checkpoint, BenchNeeds.of(job.stations), job.id)
        if self._spread is not None and bench.description.origin == "simulated":  # a real one takes its hours
            self._spread.begin_for(job.stations, bench.imu)
        live = None if self._live is None else LiveTap(job, bench, self._live)
        stop_wanted = partial(self._queries.wanted, job.id)
        self._session = BenchSession(job, procedure, bench, self._stores.recordings, stop_wanted, live, self._stopped)
        return self._session
