"""Whatever becomes of a campaign run, its JUnit document is one that CI systems read."""

from datetime import UTC, datetime
from typing import Any
from xml.etree import ElementTree

from hypothesis import given
from hypothesis import strategies as st

from bench_service.campaigns.campaign import Campaign
from bench_service.campaigns.junit import document
from bench_service.campaigns.run import ENDED, CampaignRun, StepRun, StepState
from bench_service.model.job import JobState
from procedures.core.limits import Limit, Verdict, check
from tests.service.junit_readers import assert_readable

TEXTS = st.text(st.characters(exclude_categories=()), max_size=20)
"""Control characters and half surrogates too: a driver's message may have anything in it."""
NAMES = st.text(st.characters(exclude_categories=()), min_size=1, max_size=20)
STEP_NAMES = st.from_regex(r"[a-z0-9][a-z0-9_-]{0,9}", fullmatch=True)
MOMENTS = st.none() | st.datetimes(datetime(2020, 1, 1), datetime(2040, 1, 1), timezones=st.just(UTC))
NUMBERS = st.floats(allow_nan=True, allow_infinity=True)
LIMITS = st.builds(Limit, unit=NAMES, maximum=st.none() | st.floats(), minimum=st.floats())
CHECKS = st.builds(check, NAMES, NUMBERS, LIMITS, st.none() | NUMBERS, TEXTS)


@st.composite
def runs(draw: st.DrawFn) -> CampaignRun:
    """Any run, also some that the rules would not let come about."""
    names = draw(st.lists(STEP_NAMES, min_size=1, max_size=4, unique=True))
    steps: list[dict[str, Any]] = [{"name": name, "procedure": "no_operation"} for name in names]
    made = tuple(
        StepRun(
            name,
            "no_operation",
            draw(st.sampled_from(StepState)),
            verdict=draw(st.none() | st.sampled_from(Verdict)),
            checks=tuple(draw(st.lists(CHECKS, max_size=3))),
            reason=draw(TEXTS),
            warnings=tuple(draw(st.lists(TEXTS, max_size=2))),
            job_id=draw(st.none() | TEXTS),
            seed=draw(st.none() | st.integers()),
            started_at=draw(MOMENTS),
            finished_at=draw(MOMENTS),
        )
        for name in names
    )
    return CampaignRun(
        id="run",
        campaign=Campaign.model_validate({"name": "trial", "steps": steps}),
        unit=draw(NAMES),
        bench="sim",
        state=draw(st.sampled_from(JobState)),
        created_at=datetime(2031, 5, 6, tzinfo=UTC),
        steps=made,
        waiting=draw(TEXTS),
        reason=draw(TEXTS),
        verdict=draw(st.none() | st.sampled_from(Verdict)),
    )


def test_an_inconclusive_check_is_an_error_and_no_failure() -> None:
    """The verdict of its step is error, and the reason names it."""
    bound = check("gyro_x bias instability", 0.05, Limit("deg/h", maximum=0.015), bound=True)
    step = StepRun(
        "static", "no_operation", StepState.FAILED, verdict=Verdict.ERROR, checks=(bound,), reason="it is inconclusive"
    )
    campaign = Campaign.model_validate({"name": "trial", "steps": [{"name": "static", "procedure": "no_operation"}]})
    at = datetime(2031, 5, 6, tzinfo=UTC)
    run = CampaignRun("run", campaign, "U", "sim", JobState.FAILED, at, (step,), verdict=Verdict.ERROR)
    (suite,) = ElementTree.fromstring(document(run)).findall("testsuite")
    assert (suite.get("failures"), suite.get("errors")) == ("0", "2")
    assert suite.findall("testcase")[0].find("error").get("type") == "Inconclusive"  # pyright: ignore[reportOptionalMemberAccess]


@given(runs())
def test_every_outcome_is_a_document_that_readers_take(run: CampaignRun) -> None:
    made = document(run)
    assert_readable(made)
    suites = ElementTree.fromstring(made).findall("testsuite")
    assert [suite.get("name") for suite in suites[: len(run.steps)]] == [step.name for step in run.steps]
    said = any(int(suite.get("errors", "")) for suite in suites[: len(run.steps)])
    gave_none = not run.open and run.verdict in (None, Verdict.ERROR)
    assert len(suites) - len(run.steps) == (gave_none and not said), (
        "a verdict that is no step's is an error of the run"
    )
    for suite, step in zip(suites, run.steps, strict=False):
        noted = [out.text for out in suite.iter("system-out")]
        assert len(noted) == bool(step.warnings)
        missed = sum(not c.passed for c in step.checks)
        failures = int(suite.get("failures", ""))
        if step.state in ENDED - {StepState.SKIPPED} and step.verdict is Verdict.FAIL:
            assert failures == max(1, missed), "a step that failed is seen to have failed"
        else:
            assert failures == missed
        if step.verdict not in (Verdict.PASS, Verdict.FAIL) and step.state is not StepState.SKIPPED:
            assert suite.get("errors") == "1", "a step without a verdict is an error"
