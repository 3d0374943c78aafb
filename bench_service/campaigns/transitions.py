"""State changes of a run, as values: nothing here reads a clock, a store or a bench.

Each function returns the changed run, one revision on.
"""

from dataclasses import replace
from datetime import datetime

from bench_service.campaigns.campaign import Campaign
from bench_service.campaigns.judgement import Judgement
from bench_service.campaigns.run import ENDED, CampaignRun, RunRequest, StepRun, StepState, verdict_of
from bench_service.model.job import JobState
from procedures.core.limits import Verdict

RETRY_SEED = 1000
"""Seed increment of a retry: on a simulated bench a retry is another launch."""


def not_begun(run_id: str, request: RunRequest, campaign: Campaign, bench: str, why: str, at: datetime) -> CampaignRun:
    """Return a run that could not begin, kept so that the missing night is seen: failed, with the reason."""
    steps = tuple(StepRun(s.name, s.does, StepState.SKIPPED, reason="the run could not begin") for s in campaign.steps)
    return CampaignRun(
        id=run_id,
        campaign=campaign,
        unit=request.unit,
        bench=bench,
        state=JobState.FAILED,
        created_at=at,
        steps=steps,
        labels=request.labels,
        verdict=Verdict.ERROR,
        reason=why,
        finished_at=at,
    )


def begun(run: CampaignRun, at: datetime) -> CampaignRun:
    """Return the run in state running, with its start time."""
    return _next(run, state=JobState.RUNNING, started_at=at, waiting="")


def waiting(run: CampaignRun, why: str) -> CampaignRun | None:
    """Return the run with its reason for waiting; None where it has this reason already."""
    return None if run.waiting == why else _next(run, waiting=why)


def attempted(run: CampaignRun, index: int, at: datetime) -> CampaignRun:
    """Return the run with its step's next attempt decided; the job is submitted next, under a key of this attempt
    alone.
    """
    step = run.steps[index]
    attempt = step.attempt + 1
    seeded = run.seed is not None and run.step_of(index).procedure is not None
    seed = (run.seed or 0) + index + RETRY_SEED * (attempt - 1) if seeded else None
    changed = replace(step, attempt=attempt, decided=True, seed=seed, started_at=step.started_at or at)
    return _next(_with(run, index, changed), waiting="")


def submitted(run: CampaignRun, index: int, job_id: str) -> CampaignRun:
    """Return the run with the id of the job that was submitted for its step."""
    return _next(_with(run, index, replace(run.steps[index], job_id=job_id)), waiting="")


def observed(run: CampaignRun, index: int, state: StepState, why: str) -> CampaignRun | None:
    """Return the run with its step in the state of the step's job; None where nothing has changed."""
    step = run.steps[index]
    of_run = JobState.PAUSED if state is StepState.PAUSED else JobState.RUNNING
    if (step.state, run.state, run.waiting) == (state, of_run, why):
        return None
    return _next(_with(run, index, replace(step, state=state)), state=of_run, waiting=why)


def judged(run: CampaignRun, index: int, judgement: Judgement, result_id: str, at: datetime) -> CampaignRun:
    """Return the run with the judgement of a step; the stop rules decide whether the next step begins."""
    step = run.steps[index]
    state = StepState.FAILED if judgement.verdict is Verdict.ERROR else StepState.SUCCEEDED
    ended = replace(
        step,
        state=state,
        verdict=judgement.verdict,
        result_id=result_id,
        checks=judgement.checks,
        warnings=judgement.warnings,
        reason=judgement.reason,
        finished_at=at,
    )
    return _after(_with(run, index, ended), index, at)


def failed(
    run: CampaignRun, index: int, state: StepState, reason: str, at: datetime, final: bool = False
) -> CampaignRun:
    """Return the run after an attempt without a verdict: it is retried where that is allowed, unless it is `final`.

    Final are a refusal that would recur, and a person's decision. Without a retry the step has ended in error.
    """
    step = run.steps[index]
    if step.attempt <= run.step_of(index).retries and not run.cancel_requested and not final:
        again = replace(
            step,
            state=StepState.QUEUED,
            decided=False,
            job_id=None,
            earlier_jobs=(*step.earlier_jobs, *((step.job_id,) if step.job_id else ())),
            reason=f"attempt {step.attempt}: {reason}",
        )
        return _next(_with(run, index, again), state=JobState.RUNNING, waiting="")
    ended = replace(step, state=state, verdict=Verdict.ERROR, reason=reason, finished_at=at)
    return _after(_with(run, index, ended), index, at)


def left_out(run: CampaignRun, index: int, reason: str, at: datetime) -> CampaignRun:
    """Return the run with a step skipped, because an earlier step failed to give what it needs."""
    step = replace(run.steps[index], state=StepState.SKIPPED, reason=reason, finished_at=at)
    return _after(_with(run, index, step), index, at)


def cancelled(run: CampaignRun, at: datetime) -> CampaignRun:
    """Return the run ended by a client's request; its steps that did not end are skipped."""
    skipped = _skipped(run, "the run was cancelled")
    return _next(skipped, state=JobState.CANCELLED, finished_at=at, waiting="", reason="cancelled")


def out_of_time(run: CampaignRun, at: datetime) -> CampaignRun:
    """Return the run ended because its window has closed: unfinished steps are skipped; the verdict is error, or fail
    where a step has failed.
    """
    why = f"the window of {run.campaign.window_h:g} h has closed"
    return ended(_skipped(run, why), at, why)


def ended(run: CampaignRun, at: datetime, reason: str = "") -> CampaignRun:
    """Return the ended run with its verdict. A `reason` for an early end, or a step without a verdict, makes it an
    error unless a step has failed: the unit then has failed, and the reason stands beside it.
    """
    verdict = verdict_of(run)
    without = [s.name for s in run.steps if s.verdict in (None, Verdict.ERROR) and s.state is not StepState.SKIPPED]
    if reason and verdict is not Verdict.FAIL:
        verdict = Verdict.ERROR
    if without and not reason:
        reason = f"no verdict from {', '.join(without)}"
    elif verdict is Verdict.ERROR and not reason:
        reason = "no step was done: nothing was judged"
    state = JobState.FAILED if verdict is Verdict.ERROR else JobState.SUCCEEDED
    return _next(run, state=state, verdict=verdict, finished_at=at, waiting="", reason=reason)


def _after(run: CampaignRun, index: int, at: datetime) -> CampaignRun:
    """Apply the stop rules once a step has ended."""
    step, rules = run.steps[index], run.step_of(index)
    errors = sum(s.verdict is Verdict.ERROR for s in run.steps)
    most = run.campaign.max_errors
    why = ""
    if run.cancel_requested:
        pass
    elif step.verdict is Verdict.ERROR and rules.on_error == "stop":
        why = f"the run stopped: step {step.name} ended in error"
    elif step.verdict is Verdict.FAIL and rules.on_fail == "stop":
        why = f"the run stopped: step {step.name} failed"
    elif most is not None and errors >= most:
        why = f"the run stopped: {errors} steps ended in error, {most} are allowed"
    stopped = _skipped(run, why) if why else run
    if stopped.current is None and not run.cancel_requested:
        return ended(stopped, at)
    return _next(stopped, state=JobState.RUNNING, waiting="")


def _skipped(run: CampaignRun, why: str) -> CampaignRun:
    """The run with every unfinished step marked as skipped, or as cancelled where it had a job."""
    steps = tuple(
        s if s.state in ENDED else replace(s, state=StepState.CANCELLED if s.job_id else StepState.SKIPPED, reason=why)
        for s in run.steps
    )
    return replace(run, steps=steps)


def _with(run: CampaignRun, index: int, step: StepRun) -> CampaignRun:
    return replace(run, steps=(*run.steps[:index], step, *run.steps[index + 1 :]))


def _next(run: CampaignRun, **changes: object) -> CampaignRun:
    return replace(run, revision=run.revision + 1, **changes)  # pyright: ignore[reportArgumentType]
