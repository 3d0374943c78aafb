"""Lineage of a run's numbers: jobs, results, recordings with their hashes, versions, seeds."""

from dataclasses import dataclass
from typing import Any

from bench_service.campaigns.campaign import Step
from bench_service.campaigns.run import CampaignRun, StepRun
from bench_service.campaigns.stores import Stores
from bench_service.model.job import Job
from bench_service.model.records import StoredResult
from procedures.core.limits import Verdict


@dataclass(frozen=True)
class StepLineage:
    """Lineage of one attempt of a step: job, result, recordings with hashes, calibrations, parameters, code version,
    seed.
    """

    step: str
    does: str
    version: str
    """Version of the procedure or method."""
    job: str | None
    state: str
    """State of the job, or of the step of a method."""
    result: str | None
    recordings: tuple[tuple[str, str], ...]
    """(id, content hash) of each recording that the result is based on, or that the job made before it broke off."""
    calibrations: tuple[str, ...]
    """Ids of the calibrations that were used."""
    parameters: dict[str, Any]
    code_version: str
    simulated: bool
    seed: int | None


def recordings_of(run: CampaignRun, step: Step, stores: Stores) -> tuple[str, ...]:
    """Return the ids of the recordings that a method's step takes from the jobs of earlier steps, in the order of the
    steps.
    """
    jobs = [s.job_id for name in step.recordings_of for s in run.steps if s.name == name and s.job_id]
    return tuple(r.info.id for job_id in jobs for r in stores.recordings.of_job(job_id))


def calibrations_of(run: CampaignRun, step: Step, stores: Stores) -> tuple[str, ...]:
    """Return the ids of the calibrations that the results of earlier steps gave, in the order of the steps."""
    results = [s.result_id for name in step.calibrations_of for s in run.steps if s.name == name and s.result_id]
    return tuple(c.id for c in stores.calibrations.of_results(results))


def lineage_of(run: CampaignRun, stores: Stores) -> tuple[StepLineage, ...]:
    """Return the lineage of every attempt of every step, in order; steps that never began have none."""
    found: list[StepLineage] = []
    for step in run.steps:
        for job_id in (*step.earlier_jobs, *((step.job_id,) if step.job_id else ())):
            job = stores.jobs.get(job_id)
            result = stores.results.get(job.result_id) if job.result_id else None
            found.append(_of_job(step, job, result, stores))
        if step.job_id is None and step.result_id is not None:
            found.append(_of_method(step, stores.results.get(step.result_id)))
    return tuple(found)


def failed_calibrations(run: CampaignRun, index: int, stores: Stores) -> str:
    """Return a sentence about the calibrations of earlier steps that failed and so do not count; empty where there is
    none.
    """
    failed = {s.result_id: s.name for s in run.steps[:index] if s.verdict is not Verdict.PASS and s.result_id}
    gave = stores.calibrations.of_results(list(failed))
    names = dict.fromkeys(failed[c.result_id] for c in gave if c.result_id)
    return f"the calibration of {', '.join(names)} did not pass" if names else ""


def _of_job(step: StepRun, job: Job, result: StoredResult | None, stores: Stores) -> StepLineage:
    recordings = (
        tuple((r.info.id, r.info.content_hash) for r in stores.recordings.of_job(job.id))
        if result is None
        else result.recordings
    )
    return StepLineage(
        step=step.name,
        does=job.procedure,
        version=job.procedure_version,
        job=job.id,
        state=job.state.value,
        result=job.result_id,
        recordings=recordings,
        calibrations=() if result is None else result.calibrations,
        parameters=job.parameters,
        code_version=job.code_version if result is None else result.code_version,
        simulated=job.simulated,
        seed=job.seed,
    )


def _of_method(step: StepRun, result: StoredResult) -> StepLineage:
    return StepLineage(
        step=step.name,
        does=result.name,
        version=result.version,
        job=None,
        state=step.state.value,
        result=result.id,
        recordings=result.recordings,
        calibrations=result.calibrations,
        parameters=result.parameters,
        code_version=result.code_version,
        simulated=result.simulated,
        seed=None,
    )
