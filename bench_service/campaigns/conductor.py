"""Advances campaign runs: reads the database, takes the next step of each open run, and keeps no state itself.

Any number of processes may conduct: a decision is written before it is acted on, acting twice gives the same job (its
key is the run, the step and the attempt), and a change is only stored by a process that has read the run's last
revision. So a process may be killed anywhere, and another one, or its successor, continues. A method, which may take
long, is computed in the background, under such a key too.
"""

import logging
from collections.abc import Callable, Sequence
from threading import Event, Thread
from typing import Protocol

from bench_service.background import BackgroundTasks
from bench_service.campaigns import gates, transitions
from bench_service.campaigns.judgement import judge
from bench_service.campaigns.lineage import calibrations_of, failed_calibrations, recordings_of
from bench_service.campaigns.run import CampaignRun, StepState
from bench_service.campaigns.run_log import tell
from bench_service.campaigns.stores import Stores
from bench_service.evidence.analyses import AnalysisRequest, AnalysisService
from bench_service.model.errors import (
    BenchBusy,
    IllegalTransition,
    NotDriving,
    Overloaded,
    ServiceError,
    StorageFailure,
    StorageFull,
)
from bench_service.model.job import FINAL, Job, JobState
from bench_service.model.records import BenchStop, StoredResult, reasons_of
from bench_service.model.request import CAMPAIGN_RUN, JobRequest
from bench_service.telemetry.log_context import about
from bench_service.wall_clock import now
from procedures.core.errors import DomainError, NoCalibration

BUSY_S = 0.2
"""Interval between two looks while a run is open [s]."""
IDLE_S = 1.0
"""Interval between two looks for runs of other processes, and for schedules that are due [s]."""
LEAVE_S = 10.0
"""Time that the end of the service waits for the look that is under way [s]."""
METHODS_LEAVE_S = 1.0
"""Time that the end of the service waits for methods under way [s]; the next start begins them again."""
HOPELESS = ("BadParameter", "Undetermined", "MissingChannel", "NotMounted")
"""Refusals that would recur: no retry helps."""

log = logging.getLogger(__name__)


class Submit(Protocol):
    """Function that submits a job to the queue; repeated with its key it returns the same job."""

    def __call__(self, request: JobRequest, key: str, *, team: str) -> Job: ...


class Conductor:
    """Thread that advances every open campaign run and starts due schedules, from `begin` to `stop`. Keeps no state:
    all is in the database.
    """

    def __init__(
        self,
        stores: Stores,
        submit: Submit,
        cancel: Callable[[str], Job],
        analyses: AnalysisService,
        fire_schedules: Callable[[], None],
    ) -> None:
        self._stores = stores
        self._submit = submit
        self._cancel = cancel
        self._analyses = analyses
        self._fire_schedules = fire_schedules
        self._ending = Event()
        self._wanted = Event()
        self._thread: Thread | None = None
        self._methods = BackgroundTasks(self.nudge)

    def begin(self) -> None:
        """Start the thread that advances runs."""
        self._thread = Thread(target=self._work, name="conductor", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the conductor's thread and wait for it, within a limit; runs stay as they are."""
        self._ending.set()
        self._wanted.set()
        if self._thread is not None:
            self._thread.join(LEAVE_S)
            self._methods.wait(METHODS_LEAVE_S)

    def nudge(self) -> None:
        """Have the thread look at once, after a new request."""
        self._wanted.set()

    def look(self) -> bool:
        """Start due schedules and advance every open run as far as possible; return True where a run is still open."""
        self._fire_schedules()
        runs = self._stores.campaigns.open_runs()
        for run in runs:
            if self._ending.is_set():
                break
            try:
                self.advance(run.id)
            except ServiceError as error:
                log.warning("campaign run %s cannot continue yet: %s", run.id, error)
        return bool(runs)

    def advance(self, run_id: str) -> None:
        """Advance one run, step by step, until it has ended or must wait: for a job, a method, an earlier run of its
        bench, or the release of a stop. Each change is stored. For the conductor's own thread; others call `nudge`.
        """
        campaigns = self._stores.campaigns
        while not self._ending.is_set():
            run = campaigns.run(run_id)
            if not run.open:
                return
            with about(campaign=run.id, campaign_step=None if run.current is None else run.steps[run.current].name):
                changed = self._changed(run)
                if changed is None:
                    return
                if campaigns.save_run(changed, run.revision):
                    tell(run, changed)
                else:
                    self._abandoned(run, changed)

    def _work(self) -> None:
        busy = False
        while not self._ending.is_set():
            self._wanted.wait(BUSY_S if busy else IDLE_S)
            self._wanted.clear()
            if self._ending.is_set():
                return
            try:
                busy = self.look()
            except ServiceError as error:
                log.warning("campaigns cannot continue yet: %s", error)
            except Exception:  # a defect must not end all campaigns; the next look tries again
                log.exception("conducting campaigns failed")

    def _changed(self, run: CampaignRun) -> CampaignRun | None:
        """The run after its next change; None where it waits. May submit or cancel a job, which is safe to repeat."""
        index, at = run.current, now()
        if run.cancel_requested and (index is None or not run.steps[index].decided or run.step_of(index).method):
            return transitions.cancelled(run, at)
        if run.state is JobState.QUEUED:
            return self._begin(run)
        if index is None:
            return transitions.ended(run, at)
        late = run.deadline_at is not None and at > run.deadline_at
        step = run.steps[index]
        try:
            if not step.decided and (why := gates.closed(run, index)):
                return transitions.left_out(run, index, why, at)
            if not step.decided:
                return self._attempt(run, index, late)
            if run.step_of(index).method is not None:
                return self._method(run, index, late)
            if step.job_id is None:
                return transitions.submitted(run, index, self._submitted(run, index).id)
            return self._followed(run, index, late)
        except (StorageFull, StorageFailure, Overloaded):  # nothing can be stored now: the next look tries again
            raise
        except (NotDriving, BenchBusy) as error:  # not the step's fault
            return transitions.waiting(run, str(error))
        except (DomainError, ServiceError) as error:
            if isinstance(error, NoCalibration) and (why := failed_calibrations(run, index, self._stores)):
                return transitions.left_out(run, index, f"left out: {why}; {error}", at)
            kind = type(error).__name__
            return transitions.failed(run, index, StepState.FAILED, f"{kind}: {error}", at, kind in HOPELESS)
        except Exception as error:  # a defect: the run must still end
            log.exception("campaign run %s, step %s failed inside the service", run.id, step.name)
            return transitions.failed(run, index, StepState.FAILED, f"{type(error).__name__}: {error}", at)

    def _begin(self, run: CampaignRun) -> CampaignRun | None:
        """Begin the run, unless another is open: a bench does one at a time, in the order of their requests."""
        for other in self._stores.campaigns.open_runs():
            rival = other.bench == run.bench and other.id != run.id
            if rival and (other.state is not JobState.QUEUED or other.id < run.id):
                return transitions.waiting(run, f"run {other.id} of campaign {other.campaign.name} is open")
        return transitions.begun(run, now())

    def _attempt(self, run: CampaignRun, index: int, late: bool) -> CampaignRun | None:
        if late:
            return transitions.out_of_time(run, now())
        stops = self._stores.benches.standing_stops(run.bench)
        if stops and run.step_of(index).method is None:
            return transitions.waiting(run, _stopped(run.bench, stops))
        return transitions.attempted(run, index, now())

    def _submitted(self, run: CampaignRun, index: int) -> Job:
        step, wanted = run.step_of(index), run.steps[index]
        labels = {**run.campaign.labels, **run.labels}
        labels |= {"campaign": run.campaign.name, CAMPAIGN_RUN: run.id, "step": step.name}
        request = JobRequest(
            procedure=step.does,
            unit=run.unit,
            bench=run.bench,
            parameters=step.parameters,
            priority=run.campaign.priority,
            labels=labels,
            seed=wanted.seed,
            deadline_at=run.deadline_at,
        )
        return self._submit(request, key_of(run, index), team=run.team)

    def _followed(self, run: CampaignRun, index: int, late: bool) -> CampaignRun | None:
        """The run after a look at its step's job."""
        job = self._stores.jobs.get(run.steps[index].job_id or "")
        if (run.cancel_requested or late) and job.state not in FINAL:
            return self._ended_job(run, index, job, late)
        if job.state is JobState.SUCCEEDED:
            result = self._stores.results.get(job.result_id or "")
            return self._judged(run, index, result)
        if job.state in (JobState.FAILED, JobState.CANCELLED, JobState.INTERRUPTED):
            return self._broken(run, index, job)
        why = ""
        stops = self._stores.benches.standing_stops(run.bench) if job.state is JobState.QUEUED else ()
        if stops:
            why = _stopped(run.bench, stops)
        elif job.state is JobState.PAUSED:
            why = f"job {job.id} is paused: resume or cancel it"
        return transitions.observed(run, index, StepState(job.state.value), why)

    def _ended_job(self, run: CampaignRun, index: int, job: Job, late: bool) -> CampaignRun | None:
        """Cancel the job of a run that is to end; the run ends once the job has, because its bench is safe then."""
        if not job.cancel_requested:
            try:
                self._cancel(job.id)
            except IllegalTransition:  # it ended this moment
                return None
        why = f"job {job.id} is being cancelled" + ("" if run.cancel_requested or not late else ": out of time")
        return transitions.waiting(run, why)

    def _broken(self, run: CampaignRun, index: int, job: Job) -> CampaignRun:
        """The run after its step's job ended without a verdict."""
        at = now()
        if run.cancel_requested:
            return transitions.cancelled(run, at)
        if job.cancel_requested and run.deadline_at is not None and at > run.deadline_at:
            return transitions.out_of_time(run, at)
        why = "" if job.failure is None else f"{job.failure.kind}: {job.failure.message}"
        if job.state is JobState.CANCELLED:
            stopped = self._stores.benches.bench_stop(run.bench) is not None  # it may continue once that is released
            said = f"job {job.id} was cancelled" + (" when the bench was stopped" if stopped else "")
            return transitions.failed(run, index, StepState.CANCELLED, said, at, final=not stopped)
        kind = f"job {job.id} {job.state.value}: "
        hopeless = job.failure is not None and job.failure.kind in HOPELESS
        return transitions.failed(run, index, StepState.FAILED, kind + (why or "no reason given"), at, hopeless)

    def _judged(self, run: CampaignRun, index: int, result: StoredResult) -> CampaignRun:
        judgement = judge(run.step_of(index), run.campaign, result, self._stores)
        return transitions.judged(run, index, judgement, result.id, now())

    def _method(self, run: CampaignRun, index: int, late: bool) -> CampaignRun | None:
        """The run after a look at its step's method; an ended run ignores the result, which is stored all the same."""
        key = key_of(run, index)
        result_id = self._methods.outcome(key, lambda: self._work_out(run, index, key))
        if result_id is not None:
            return self._judged(run, index, self._stores.results.get(result_id))
        return transitions.out_of_time(run, now()) if late else transitions.observed(run, index, StepState.RUNNING, "")

    def _work_out(self, run: CampaignRun, index: int, key: str) -> str:
        """Compute the method's result and return its id; a repeated call returns the first result."""
        step = run.step_of(index)
        request = AnalysisRequest(
            step.does,
            recordings=recordings_of(run, step, self._stores),
            calibrations=calibrations_of(run, step, self._stores),
            parameters=step.parameters,
        )
        return self._analyses.run_method(request, key).id

    def _abandoned(self, run: CampaignRun, changed: CampaignRun) -> None:
        """Cancel a job that was submitted in vain: another process changed the run first."""
        index = run.current
        job_id = None if index is None else changed.steps[index].job_id
        if index is None or job_id is None or run.steps[index].job_id is not None:
            return
        fresh = self._stores.campaigns.run(run.id)
        step = fresh.steps[index]
        unresolved = fresh.open and step.decided and step.job_id is None and step.attempt == run.steps[index].attempt
        if unresolved or job_id in (step.job_id, *step.earlier_jobs):
            return
        try:
            self._cancel(job_id)
        except IllegalTransition:
            log.info("job %s of campaign run %s had ended", job_id, run.id)


def key_of(run: CampaignRun, index: int) -> str:
    """Return the idempotency key of the present attempt of a run's step."""
    return f"campaign:{run.id}:{index}:{run.steps[index].attempt}"


def _stopped(bench: str, stops: Sequence[BenchStop]) -> str:
    return f"bench {bench} is stopped until a person releases it: {reasons_of(stops)}"
