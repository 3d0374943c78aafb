"""Foresight of limits against draws of the measured value, and the decision rule against its definition."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from pydantic_core import to_jsonable_python

from bench_service.campaigns.campaign import Campaign, DecisionRule, StepLimit
from bench_service.campaigns.decision import decided, rule_of
from bench_service.campaigns.judgement import Judgement, judge
from bench_service.campaigns.power import beyond, preview, smallest_step
from procedures.core.limits import Limit, PlannedCheck, Verdict, check

DRAWS = 40_000
SURE = 4.0
"""Standard deviations of a frequency over the draws that it may be off: chance 6e-5."""


def close(frequency: float, expected: float) -> bool:
    return abs(frequency - expected) <= SURE * np.sqrt(max(expected * (1.0 - expected), 1e-4) / DRAWS)


@pytest.mark.parametrize(("true", "u"), [(4.0, 0.5), (2.0, 1.5), (1.0, 0.1)])
def test_the_scatter_of_three_launches(true: float, u: float) -> None:
    planned = PlannedCheck("scatter", Limit("ppm", maximum=2.5), u, 2.0, 1.0)
    rng = np.random.Generator(np.random.PCG64(1))
    values = true * rng.standard_normal((DRAWS, 3)) + u * rng.standard_normal((DRAWS, 3))
    seen = float(np.mean(np.std(values, axis=1, ddof=1) > 2.5))
    assert close(seen, beyond(planned, true, 2.5))


def test_the_smallest_step_between_launches() -> None:
    planned = PlannedCheck("scatter", Limit("ppm", maximum=10.0), 0.3, 2.0, 2.0)
    step = smallest_step(planned, 0.95, 3)
    rng = np.random.Generator(np.random.PCG64(2))
    values = np.hypot(2.0, 0.3) * rng.standard_normal((DRAWS, 3)) + [0.0, 0.0, step]
    assert close(float(np.mean(np.std(values, axis=1, ddof=1) > 10.0)), 0.95)


def test_an_estimate_at_twice_its_limit() -> None:
    found = preview(PlannedCheck("bias", Limit("deg/h", maximum=2.0), 1.0), DecisionRule())
    assert (found.expanded_uncertainty, found.resolved) == (2.0, True)
    assert found.power_at_twice == pytest.approx(0.97725, abs=1e-5)  # Φ(2)
    guarded = preview(PlannedCheck("bias", Limit("deg/h", maximum=2.0), 0.5), DecisionRule(rule="guarded"))
    assert guarded.power_at_twice == pytest.approx(1.0 - 1e-8, abs=1e-7)  # Φ((4 − 1)/0.5)


@pytest.mark.parametrize(
    ("value", "rule", "passed", "said"),
    [
        (0.5, "simple", True, ": pass"),
        (0.9, "simple", True, "conditional pass"),
        (1.1, "simple", False, "conditional fail"),
        (1.5, "simple", False, ": fail"),
        (0.9, "guarded", False, "conditional fail"),
        (0.79, "guarded", True, ": pass"),
        (float("nan"), "simple", False, ": fail"),
    ],
)
def test_the_decision_rule(value: float, rule: str, passed: bool, said: str) -> None:
    made = check("value", value, Limit("1", maximum=1.0), 0.1)
    found = decided(made, DecisionRule.model_validate({"rule": rule}))
    assert found.passed is passed
    assert said in found.note
    assert "U = 0.2 (k = 2)" in found.note


def test_a_value_without_uncertainty_says_so() -> None:
    found = decided(check("value", 0.99, Limit("1", maximum=1.0)), DecisionRule(rule="guarded"))
    assert found.passed
    assert "no stated uncertainty" in found.note


def test_a_limit_may_have_a_rule_of_its_own() -> None:
    made = check("value", 0.9, Limit("1", maximum=1.0), 0.1)
    limit = {"quantity": "gyro.b_x", "unit": "1", "maximum": 1.0, "source": "a test"}
    own = {rule: StepLimit.model_validate({**limit, "rule": rule}) for rule in ("simple", "guarded", None)}
    assert decided(made, rule_of(own["guarded"], DecisionRule())).passed is False
    assert decided(made, rule_of(own["simple"], DecisionRule(rule="guarded"))).passed is True
    assert decided(made, rule_of(own[None], DecisionRule(rule="guarded"))).passed is False


def test_a_campaigns_limit_on_what_was_not_observed_is_inconclusive_above_it() -> None:
    """The step is in error and its reason names the check; a failed check beside it makes the step a failure."""
    walk = check("gyro_x random walk", 0.002, Limit("deg/h", maximum=0.003))
    bound = check("gyro_x bias instability", 0.05, Limit("deg/h", maximum=0.1), bound=True)
    document = {"checks": to_jsonable_python([walk, bound])}
    result: Any = SimpleNamespace(verdict=Verdict.PASS, document=document)

    def judged(*limits: tuple[str, float]) -> Judgement:
        wanted = [{"quantity": q, "unit": "deg/h", "maximum": m, "source": "ours"} for q, m in limits]
        step = {"name": "static", "procedure": "static_run", "limits": wanted}
        campaign = Campaign.model_validate({"name": "trial", "steps": [step]})
        return judge(campaign.steps[0], campaign, result, cast(Any, None))

    assert judged((bound.name, 0.06)).verdict is Verdict.PASS
    undecided = judged((bound.name, 0.04))
    assert (undecided.verdict, undecided.reason) == (
        Verdict.ERROR,
        "gyro_x bias instability, campaign's limit is inconclusive",
    )
    assert judged((bound.name, 0.04), (walk.name, 0.001)).verdict is Verdict.FAIL
