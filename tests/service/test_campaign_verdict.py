"""A fail stays a fail, whatever else of the same run or step gave no verdict."""

from datetime import UTC, datetime, timedelta
from types import SimpleNamespace
from typing import Any, cast

import pytest
from pydantic_core import to_jsonable_python

from bench_service.campaigns import transitions
from bench_service.campaigns.campaign import Campaign
from bench_service.campaigns.judgement import Judgement, judge
from bench_service.campaigns.run import CampaignRun, StepRun, StepState
from bench_service.model.job import JobState
from procedures.core.limits import Check, Limit, Verdict, check, verdict

AT = datetime(2031, 5, 6, tzinfo=UTC)
PASS, FAIL, ERROR = Verdict.PASS, Verdict.FAIL, Verdict.ERROR
MAXIMUM = Limit("deg/h", maximum=1.0)
WITHIN = check("bias", 0.5, MAXIMUM)
BEYOND = check("bias", 2.0, MAXIMUM)
UNDECIDED = check("flicker", 2.0, MAXIMUM, bound=True)


def run_of(*verdicts: Verdict | None, **more: Any) -> CampaignRun:
    """A running campaign whose steps have these verdicts; None: the step has not begun."""
    names = [f"s{k}" for k in range(len(verdicts))]
    steps = [{"name": name, "procedure": "no_operation", "on_error": "continue"} for name in names]
    campaign = Campaign.model_validate({"name": "trial", "steps": steps, **more})
    states = {None: StepState.QUEUED, ERROR: StepState.FAILED}
    made = tuple(
        StepRun(name, "no_operation", states.get(v, StepState.SUCCEEDED), verdict=v)
        for name, v in zip(names, verdicts, strict=True)
    )
    return CampaignRun("run", campaign, "U", "sim", JobState.RUNNING, AT, made, started_at=AT)


@pytest.mark.parametrize(
    ("verdicts", "expected", "state", "reason"),
    [
        ((PASS, PASS), PASS, JobState.SUCCEEDED, ""),
        ((PASS, FAIL), FAIL, JobState.SUCCEEDED, ""),
        ((PASS, ERROR), ERROR, JobState.FAILED, "no verdict from s1"),
        ((ERROR, FAIL), FAIL, JobState.SUCCEEDED, "no verdict from s0"),
        ((FAIL, PASS, ERROR), FAIL, JobState.SUCCEEDED, "no verdict from s2"),
    ],
)
def test_the_verdict_of_a_run(verdicts: Any, expected: Verdict, state: JobState, reason: str) -> None:
    ended = transitions.ended(run_of(*verdicts), AT)
    assert (ended.verdict, ended.state, ended.reason) == (expected, state, reason)


@pytest.mark.parametrize(("first", "expected"), [(FAIL, FAIL), (PASS, ERROR)])
def test_a_window_that_closes_takes_no_fail_back(first: Verdict, expected: Verdict) -> None:
    ended = transitions.out_of_time(run_of(first, None, window_h=1.0), AT + timedelta(hours=2))
    assert (ended.verdict, ended.reason) == (expected, "the window of 1 h has closed")
    assert ended.steps[1].state is StepState.SKIPPED


def test_a_step_that_is_inconclusive_beside_one_that_failed() -> None:
    """By the transitions of a run, not by a run that was made ended."""
    run = transitions.judged(run_of(FAIL, None), 1, Judgement(ERROR, (UNDECIDED,), (), "it is inconclusive"), "r", AT)
    assert (run.verdict, run.state, run.reason) == (FAIL, JobState.SUCCEEDED, "no verdict from s1")


@pytest.mark.parametrize(
    ("own", "quantity", "expected"),
    [
        ((WITHIN,), "bias", PASS),
        ((WITHIN,), "scale", ERROR),
        ((BEYOND,), "scale", FAIL),
        ((BEYOND, UNDECIDED), "scale", FAIL),
        ((WITHIN, UNDECIDED), "bias", ERROR),
        ((BEYOND, UNDECIDED), "bias", FAIL),
    ],
)
def test_the_verdict_of_a_step(own: tuple[Check, ...], quantity: str, expected: Verdict) -> None:
    """`scale` is in no result: a limit on it is an error, except beside a check that failed."""
    limit = {"quantity": quantity, "unit": "deg/h", "maximum": 5.0, "source": "ours"}
    campaign = Campaign.model_validate(
        {"name": "trial", "steps": [{"name": "a", "procedure": "no_operation", "limits": [limit]}]}
    )
    result = SimpleNamespace(verdict=verdict(own), document={"checks": to_jsonable_python(own)})
    found = judge(campaign.steps[0], campaign, cast(Any, result), cast(Any, None))
    assert found.verdict is expected
    assert ("scale" in found.reason) == (quantity == "scale")
