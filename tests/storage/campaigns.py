"""Campaigns whose jobs end when a test says so: stores are real, bench and engine are not there."""

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

from bench_service.campaigns.campaign import Campaign
from bench_service.campaigns.conductor import Conductor
from bench_service.campaigns.run import CampaignRun, StepRun
from bench_service.campaigns.stores import Stores
from bench_service.evidence.analyses import AnalysisService
from bench_service.evidence.catalogue import Catalogue
from bench_service.model.job import Failure, Job, JobState
from bench_service.model.records import Idempotency, StoredResult
from bench_service.model.request import JobRequest, fingerprint
from bench_service.wall_clock import new_id
from procedures.core.limits import Verdict

NOW = datetime(2031, 5, 6, 7, 8, 9, tzinfo=UTC)


def campaign(*steps: dict[str, Any], **more: Any) -> Campaign:
    """Steps called a, b, c … that do nothing, unless they say otherwise."""
    named = [{"name": "abcdefgh"[k], "procedure": "no_operation", **step} for k, step in enumerate(steps)]
    return Campaign.model_validate({"name": "trial", "steps": named, **more})


def new_run(of: Campaign, **changes: Any) -> CampaignRun:
    """A run that nobody has begun yet, of unit U-1 on bench sim."""
    steps = tuple(StepRun(step.name, step.does) for step in of.steps)
    run = CampaignRun(new_id(), of, "U-1", "sim", JobState.QUEUED, NOW, steps, simulated=True, seed=100)
    return replace(run, **changes)


class Laboratory:
    """Submits, cancels and ends jobs in the stores; what a bench would do in hours."""

    def __init__(self, stores: Stores, new_job: Callable[..., Job]) -> None:
        self.stores = stores
        self._new_job = new_job
        self.requests: list[JobRequest] = []

    def conductor(self, fire: Callable[[], None] = lambda: None) -> Conductor:
        """One of any number."""
        analyses = AnalysisService(self.stores, Catalogue(), self.stores.jobs.get, "abc")
        return Conductor(self.stores, self.submit, self.cancel, analyses, fire)

    def submit(self, request: JobRequest, key: str, *, team: str) -> Job:
        self.requests.append(request)
        job = self._new_job(
            procedure=request.procedure,
            unit=request.unit,
            seed=request.seed,
            labels=request.labels,
            stations=(),
            team=team,
        )
        return self.stores.jobs.add(job, Idempotency(f"jobs:{key}", fingerprint(request)))

    def cancel(self, job_id: str) -> Job:
        return self.stores.jobs.request_cancel(job_id, NOW)

    def jobs(self) -> list[Job]:
        """Oldest first."""
        return list(self.stores.jobs.list(limit=500).items[::-1])

    def end(self, job: Job, verdict: Verdict = Verdict.PASS, **document: Any) -> None:
        """A job ran and gave a result."""
        self.stores.jobs.transition(job.id, JobState.RUNNING, at=NOW)
        result = StoredResult(
            id=new_id(),
            kind="procedure",
            name=job.procedure,
            version="1",
            parameters={},
            document={"checks": [], "warnings": [], **document},
            verdict=verdict,
            recordings=(),
            calibrations=(),
            code_version="abc",
            simulated=True,
            created_at=NOW,
            unit=job.unit,
            job_id=job.id,
        )
        self.stores.results.add(result, idempotency=Idempotency(f"job:{job.id}", job.id))
        self.stores.jobs.transition(job.id, JobState.SUCCEEDED, at=NOW, verdict=verdict, result_id=result.id)

    def break_down(self, job: Job, kind: str = "DeviceFault") -> None:
        """A job failed on the bench."""
        self.stores.jobs.transition(job.id, JobState.RUNNING, at=NOW)
        self.stores.jobs.transition(job.id, JobState.FAILED, at=NOW, failure=Failure(kind, "the table said so"))

    def done(self, run: CampaignRun, *endings: Any) -> CampaignRun:
        """Conduct a run; each ending is what becomes of the next job: a verdict, or "broken"."""
        conductor = self.conductor()
        self.stores.campaigns.add_run(run)
        conductor.advance(run.id)
        for ending in endings:
            (job,) = [j for j in self.jobs() if j.state is JobState.QUEUED]
            if isinstance(ending, Verdict):
                self.end(job, ending)
            else:
                self.break_down(job, ending)
            conductor.advance(run.id)
        return self.stores.campaigns.run(run.id)


def value_check(name: str, value: float, unit: str = "deg/h") -> dict[str, Any]:
    """A check of a result's document that passed."""
    limit = {"unit": unit, "maximum": None, "minimum": None, "source": ""}
    return {"name": name, "value": value, "limit": limit, "passed": True, "standard_uncertainty": None, "note": ""}
