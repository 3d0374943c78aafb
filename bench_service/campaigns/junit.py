"""A campaign run as JUnit XML for a CI system: the run is the document, a step a suite, a check a case.

A check that missed its limit is a failure, an inconclusive one or a step without a verdict an error, a step left out is
skipped. A step that has no check of its own still has one case, so that nothing is lost between the lines; a run whose
verdict is no step's (it could not begin, was cancelled or ran out of time before a step) has a suite of its own for it.
"""

import re
from datetime import datetime
from math import isfinite
from typing import TYPE_CHECKING

from bench_service.campaigns.run import ENDED, CampaignRun, StepRun, StepState
from procedures.core.limits import Check, Verdict, bounds

if TYPE_CHECKING:
    from junitparser import TestCase, TestSuite

NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that no XML 1.0 document can have."""

RUN = "(run)"
"""A suite's name that no step can have."""

DECLARATION = b"<?xml version='1.0' encoding='utf-8'?>\n"


def document(run: CampaignRun) -> bytes:
    """Return a run as JUnit XML, UTF-8 with its declaration. Open steps of an open run are errors: they have no verdict
    yet.
    """
    from junitparser import JUnitXml

    whole = JUnitXml(_text(f"{run.campaign.name} {run.unit}"))
    suites = [_suite(run, step) for step in run.steps]
    if not run.open and run.verdict in (None, Verdict.ERROR) and not any(suite.errors for suite in suites):
        suites.append(_of_the_run(run))
    for suite in suites:
        whole.add_testsuite(suite)
    whole.update_statistics()
    whole._elem.attrib.pop("skipped")  # pyright: ignore[reportPrivateUsage]  Jenkins' schema has it at suites alone
    return DECLARATION + whole.tostring()


def _of_the_run(run: CampaignRun) -> "TestSuite":
    """A suite with one error for the run itself: it has no verdict, and no step shows the reason."""
    from junitparser import Error, TestCase

    suite = _dated(run, RUN, run.started_at)
    case = TestCase(RUN, f"{run.campaign.name}.{RUN}", _seconds(run.started_at, run.finished_at))
    case.result = [Error(_text(run.reason or "no verdict"), run.state.value.capitalize())]
    suite.add_testcase(case)
    suite.update_statistics()
    return suite


def _dated(run: CampaignRun, name: str, at: datetime | None) -> "TestSuite":
    from junitparser import TestSuite

    suite = TestSuite(name)
    suite.timestamp = (at or run.created_at).strftime("%Y-%m-%dT%H:%M:%S")
    suite.hostname = run.bench
    return suite


def _suite(run: CampaignRun, step: StepRun) -> "TestSuite":
    suite = _dated(run, step.name, step.started_at)
    properties = {
        "campaign": run.campaign.name,
        "campaign_run": run.id,
        "unit": run.unit,
        "does": step.does,
        "job": step.job_id,
        "result": step.result_id,
        "seed": step.seed,
        "simulated": str(run.simulated).lower(),
        "verdict": step.verdict and step.verdict.value,
    }
    for name, value in properties.items():
        if value is not None:
            suite.add_property(name, _text(str(value)))
    cases = _cases(run, step)
    if step.warnings:
        cases[-1].system_out = _text("\n".join(step.warnings))
    for case in cases:
        suite.add_testcase(case)
    suite.update_statistics()
    return suite


def _cases(run: CampaignRun, step: StepRun) -> list["TestCase"]:
    """One case per check, and one for the step itself where no check shows its outcome."""
    from junitparser import Error, Failure, Skipped

    cases = [_checked(run, step, check) for check in step.checks]
    missed = any(not (check.passed or check.inconclusive) for check in step.checks)
    verdict_is_said = bool(cases) and (step.verdict is Verdict.PASS or (step.verdict is Verdict.FAIL and missed))
    if step.state in (StepState.SUCCEEDED, StepState.FAILED) and verdict_is_said:
        cases[0].time = _seconds(step.started_at, step.finished_at)
        return cases
    whole = _case(run, step, step.name)
    whole.time = _seconds(step.started_at, step.finished_at)
    if step.state is StepState.SKIPPED:
        whole.result = [Skipped(_text(step.reason or "skipped"))]
    elif step.state not in ENDED:
        whole.result = [Error(_text(f"not ended: {step.state.value} {run.waiting}".strip()), "NotEnded")]
    elif step.verdict is Verdict.ERROR:
        whole.result = [Error(_text(step.reason or "no verdict"), "Error")]
    elif step.verdict is Verdict.FAIL and not missed:
        whole.result = [Failure(_text(step.reason or "the verdict is fail"), "Verdict")]
    elif step.verdict is None:
        whole.result = [Error(_text(step.reason or step.state.value), step.state.value.capitalize())]
    return [*cases, whole]


def _checked(run: CampaignRun, step: StepRun, check: Check) -> "TestCase":
    from junitparser import Error, Failure

    case = _case(run, step, check.name)
    if check.inconclusive:
        case.result = [Error(_text(f"inconclusive: {_sentence(check)}"), "Inconclusive")]
    elif not check.passed:
        failure = Failure(_text(_sentence(check)), "Limit")
        failure.text = _text(check.note or _sentence(check))
        case.result = [failure]
    return case


def _case(run: CampaignRun, step: StepRun, name: str) -> "TestCase":
    from junitparser import TestCase

    return TestCase(_text(name), f"{run.campaign.name}.{step.name}", 0.0)


def _sentence(check: Check) -> str:
    """The value and its limit, as a sentence for a person."""
    limit = check.limit
    value = "unbounded" if check.value is None else "no finite number"
    if check.value is not None and isfinite(check.value):
        value = f"{check.value:.6g}"
    uncertainty = "" if check.standard_uncertainty is None else f" ± {check.standard_uncertainty:.2g}"
    return f"{check.name} = {value}{uncertainty} {limit.unit}, limit {bounds(limit.minimum, limit.maximum, limit.unit)}"


def _seconds(begun: datetime | None, ended: datetime | None) -> float:
    """Duration [s] to the millisecond, by the wall clock; 0 where the clock was set back: no sign, no exponent."""
    return 0.0 if begun is None or ended is None else max(0.0, round((ended - begun).total_seconds(), 3))


def _text(text: str) -> str:
    return NOT_XML.sub("�", text)
