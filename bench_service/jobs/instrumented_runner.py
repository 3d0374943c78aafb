"""The steps of a job, instrumented: lines of the log, and spans of the job's trace."""

import logging
from collections.abc import Callable
from contextlib import AbstractContextManager

from bench_service.bench.driver import BenchDriver
from bench_service.bench.live.values import LiveBoard
from bench_service.evidence.spread_processes import SpreadProcesses
from bench_service.jobs.planning import Planner
from bench_service.jobs.queue import QueueEntry
from bench_service.jobs.runner import JobRunner, StepOutcome
from bench_service.jobs.stores import JobStores
from bench_service.model.job import Job
from bench_service.model.request import CAMPAIGN_RUN
from bench_service.telemetry.log_context import about
from bench_service.telemetry.tracing import Found, Traces

log = logging.getLogger(__name__)


class InstrumentedRunner(JobRunner):
    """A `JobRunner` that writes a log line and a span of the job's trace for each step."""

    def __init__(
        self,
        stores: JobStores,
        planner: Planner,
        driver: BenchDriver,
        code_version: str,
        lease_held: Callable[[], bool],
        live: LiveBoard,
        retry_scale: float,
        traces: Traces,
        stopped: Callable[[], bool],
        spread: SpreadProcesses,
    ) -> None:
        super().__init__(stores, planner, driver, code_version, lease_held, live, retry_scale, stopped, spread)
        self._traces = traces
        self._campaign: tuple[str, str | None] = ("", None)
        """The job that began last, and the campaign run that it belongs to."""

    def claim(self, entry: QueueEntry) -> Job | None:
        job = super().claim(entry)
        if job is not None:
            self._campaign = (job.id, job.labels.get(CAMPAIGN_RUN))
        return job

    def stations(self, job_id: str, attempt: int) -> int:
        if self._campaign[0] != job_id:  # begun by a process that died
            self._campaign = (job_id, self._stores.jobs.get(job_id).labels.get(CAMPAIGN_RUN))
        with self._about(job_id, "begin"):
            count = super().stations(job_id, attempt)
            if count >= 0:
                log.info("started, attempt %d, %d stations", attempt, count)
            return count

    def acquire(self, job_id: str, index: int) -> StepOutcome:
        with (
            self._about(job_id, f"station {index}"),
            self._traces.part(job_id, f"station {index}", **{"bench.station": index}) as found,
        ):
            outcome = super().acquire(job_id, index)
            _tell(found, outcome, f"station {index}", "recorded")
            return outcome

    def make_safe(self, job_id: str) -> StepOutcome:
        with self._about(job_id, "safe"), self._traces.part(job_id, "make safe") as found:
            outcome = super().make_safe(job_id)
            _tell(found, outcome, "bench", "made safe")
            return outcome

    def conclude(self, job_id: str) -> StepOutcome:
        with self._about(job_id, "conclude"):
            with self._traces.part(job_id, "analysis") as found:
                outcome = super().conclude(job_id)
                _tell(found, outcome, "analysis", "done")
                job = self._stores.jobs.get(job_id) if outcome.good else None
                if job is not None and job.verdict is not None:
                    found.update({"bench.verdict": job.verdict.value, "bench.result": job.result_id or ""})
            if job is not None:
                self._ended(job)
            return outcome

    def end_early(self, job_id: str, outcome: StepOutcome) -> Job:
        with self._about(job_id, "end"):
            job = super().end_early(job_id, outcome)
            self._ended(job)
            return job

    def _about(self, job_id: str, step: str) -> AbstractContextManager[None]:
        known, campaign = self._campaign
        return about(job=job_id, campaign=campaign if known == job_id else None, step=step)

    def _ended(self, job: Job) -> None:
        why = "" if job.failure is None else f": {job.failure.kind}: {job.failure.message}"
        verdict = "" if job.verdict is None else f", verdict {job.verdict.value}"
        log.info("ended as %s%s%s", job.state.value, verdict, why)
        self._traces.ended(job)


def _tell(found: Found, outcome: StepOutcome, what: str, done: str) -> None:
    """Write a step's outcome to the log and to its span."""
    if outcome.failure is not None:
        found["error"] = f"{outcome.failure.kind}: {outcome.failure.message}"
        log.warning("%s: %s: %s", what, outcome.failure.kind, outcome.failure.message)
    elif outcome.good:
        log.info("%s %s", what, done)
    else:
        found["bench.ended_by"] = "cancel" if outcome.cancelled else "pause"
        log.info("%s not begun or not finished: the job is to %s", what, "end" if outcome.cancelled else "pause")
