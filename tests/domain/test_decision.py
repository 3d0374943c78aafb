"""Decision rules against the definitions of ISO/IEC 17025 (7.8.6) and ILAC-G8, and factors against printed tables."""

from typing import Any

import numpy as np
import pytest

from procedures.core import limits
from procedures.core.errors import BadParameter
from procedures.core.limits import (
    Check,
    Limit,
    Rule,
    Verdict,
    check,
    combined_freedom,
    coverage_factor,
    decided,
    significance,
    verdict,
)
from procedures.inspection import judged
from procedures.procedure import JudgedParameters, Outcome


def outcome(*checks: Check) -> Outcome:
    return Outcome(checks=checks, verdict=verdict(checks))


def rules(**given: Any) -> JudgedParameters:
    return JudgedParameters.model_validate({"decision": given} if given else {})


@pytest.mark.parametrize(
    ("freedom", "factor"), [(1.0, 13.97), (2.0, 4.53), (5.0, 2.65), (10.0, 2.28), (50.0, 2.05), (None, 2.00)]
)
def test_factors_are_those_of_the_guide(freedom: float | None, factor: float) -> None:
    """JCGM 100:2008, table G.2, the column of 95.45 %."""
    assert coverage_factor(0.9545, freedom) == pytest.approx(factor, abs=0.005)


def test_degrees_of_freedom_combine_as_in_the_guides_example() -> None:
    """JCGM 100:2008, G.4.1: relative 0.25 %, 0.57 %, 0.82 % of 9, 4 and 14 degrees give ν = 19 of u = 1.03 %."""
    assert combined_freedom([(0.25, 9.0), (0.57, 4.0), (0.82, 14.0)]) == pytest.approx(19.0, abs=0.3)
    assert combined_freedom([(1.0, None), (2.0, float("inf"))]) is None


@pytest.mark.parametrize(
    ("value", "simple", "guarded"),
    [
        (0.70, "pass", "pass"),
        (0.90, "conditional pass", "conditional fail"),
        (1.10, "conditional fail", "conditional fail"),
        (1.30, "fail", "fail"),
    ],
)
def test_a_value_near_its_limit(value: float, simple: str, guarded: str) -> None:
    """U = 0.2 at k = 2; the guard band is U."""
    made = check("value", value, Limit("1", maximum=1.0), 0.1)
    factor = 2.0
    by_rule = [decided(made, Rule(name, coverage_factor=factor)).decision for name in ("simple", "guarded")]
    assert [d.outcome for d in by_rule if d] == [simple, guarded]
    assert [d.guard_band for d in by_rule if d] == [0.0, pytest.approx(0.2)]
    assert all(d.expanded_uncertainty == pytest.approx(0.2) for d in by_rule if d)


def test_guarded_acceptance_lets_few_bad_values_through() -> None:
    """A true value at the limit passes with 1/2 simply and with Φ(−2) = 0.023 behind a guard band of 2u."""
    dice = np.random.default_rng(1)
    values = 1.0 + 0.1 * dice.normal(size=4000)
    passed = {
        name: np.mean([decided(check("v", v, Limit("1", maximum=1.0), 0.1), Rule(name)).passed for v in values])
        for name in ("simple", "guarded")
    }
    assert passed["simple"] == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(4000))
    assert passed["guarded"] == pytest.approx(0.0228, abs=4 * np.sqrt(0.0228 / 4000))


def test_a_rule_makes_a_pass_a_fail_and_says_so() -> None:
    near, far = check("near", 0.95, Limit("1", maximum=1.0), 0.1), check("far", 0.1, Limit("1", maximum=1.0), 0.1)
    simple = judged(outcome(near, far), rules())
    assert (simple.verdict, simple.statement and simple.statement.outcome) == (Verdict.PASS, "conditional pass")
    assert simple.statement is not None
    assert simple.statement.conditional == ("near",)
    guarded = judged(outcome(near, far), rules(rule="guarded"))
    assert (guarded.verdict, guarded.statement and guarded.statement.outcome) == (Verdict.FAIL, "conditional fail")
    assert guarded.statement is not None
    assert guarded.statement.rule == "guard band of 1·U"
    of_one = judged(outcome(near, far), rules(by_check={"far": "guarded"}))
    assert of_one.verdict is Verdict.PASS
    assert of_one.statement is not None
    assert of_one.statement.rule == "guard band of 1·U; simple acceptance"


def test_a_sure_failure_is_no_conditional_one() -> None:
    near, bad = check("near", 1.05, Limit("1", maximum=1.0), 0.1), check("bad", 3.0, Limit("1", maximum=1.0), 0.1)
    assert (found := judged(outcome(near, bad), rules()).statement) is not None
    assert (found.outcome, found.conditional) == ("fail", ("near",))


def test_tests_of_significance_have_no_guard_band() -> None:
    found = judged(outcome(significance("p", 0.002, 0.001)), rules(rule="guarded"))
    assert found.verdict is Verdict.PASS
    assert found.checks[0].decision is not None
    assert found.checks[0].decision.sentence == "test of significance at 0.001: pass"


def test_a_value_without_uncertainty_says_so() -> None:
    found = judged(outcome(check("x", 0.99, Limit("1", maximum=1.0))), rules(rule="guarded"))
    assert found.verdict is Verdict.PASS
    assert found.checks[0].decision is not None
    assert "without effect (the value has no stated uncertainty): pass" in found.checks[0].decision.sentence


def test_a_rule_for_no_check_is_refused_or_said() -> None:
    given = rules(by_check={"nothing": "guarded"}).decision
    assert given is not None
    with pytest.raises(BadParameter, match=r"decision\.by_check"):
        given.require_known(["something"])
    found = judged(outcome(check("x", 0.5, Limit("1", maximum=1.0))), rules(by_check={"nothing": "guarded"}))
    assert "'nothing' was not used" in found.warnings[-1]


@pytest.mark.parametrize("rule", ["simple", "guarded"])
def test_an_upper_bound_outside_its_limit_decides_nothing(rule: str) -> None:
    """Its quantity may lie on either side of the limit: no pass, and no evidence of a fail."""
    limit = Limit("1", maximum=1.0)
    above, below = check("above", 1.2, limit, bound=True), check("below", 0.8, limit, bound=True)
    good, bad = check("good", 0.5, limit, 0.01), check("bad", 1.5, limit, 0.01)
    found = judged(outcome(above, below, good), rules(rule=rule))
    assert [c.decision and c.decision.outcome for c in found.checks] == ["inconclusive", "pass", "pass"]
    assert [c.inconclusive for c in found.checks] == [True, False, False]
    assert found.verdict is Verdict.ERROR
    assert found.statement is not None
    assert found.statement.outcome == "inconclusive"
    assert "decides nothing" in found.statement.rule
    failed = judged(outcome(above, bad), rules(rule=rule))
    assert (failed.verdict, failed.statement and failed.statement.outcome) == (Verdict.FAIL, "fail")
    assert judged(outcome(below, good), rules(rule=rule)).verdict is Verdict.PASS


def test_a_guard_band_makes_an_undecided_result_a_failed_one() -> None:
    near, above = (
        check("near", 0.95, Limit("1", maximum=1.0), 0.1),
        check("b", 2.0, Limit("1", maximum=1.0), bound=True),
    )
    assert judged(outcome(near, above), rules()).verdict is Verdict.ERROR
    assert judged(outcome(near, above), rules(rule="guarded")).verdict is Verdict.FAIL
    own = Outcome(checks=(near,), verdict=Verdict.ERROR)  # an error for another reason stays one
    assert judged(own, rules()).verdict is Verdict.ERROR


def test_a_value_that_is_no_number_never_passes() -> None:
    assert not decided(check("x", float("nan"), Limit("1", maximum=1.0), 0.1), Rule()).passed


def test_stored_results_of_before_have_no_decision() -> None:
    assert Outcome.model_validate({"verdict": "pass"}).statement is None
    assert "decision" not in JudgedParameters.model_validate({}).model_dump()


@pytest.mark.parametrize(
    ("value", "passed"),
    [(-2.001, False), (-2.0, True), (0.0, True), (1.0, True), (1.001, False)]
    + [(float(text), False) for text in ("nan", "inf", "-inf")],
)
def test_limits_hold_at_both_ends_and_let_nothing_through_that_is_not_finite(value: float, passed: bool) -> None:
    assert check("v", value, Limit("1", maximum=1.0, minimum=-2.0)).passed is passed


@pytest.mark.parametrize(
    ("rule", "freedom", "sentence"),
    [
        (Rule(coverage_factor=2.0), None, "simple acceptance, U = 0.2 (k = 2): conditional pass"),
        (
            Rule("guarded", 0.5, coverage_factor=2.0),
            None,
            "guard band of 0.5·U, w = 0.1, U = 0.2 (k = 2): conditional fail",
        ),
        (Rule(), 5.0, "simple acceptance, U = 0.265 (k = 2.65, ν = 5): conditional pass"),
    ],
)
def test_a_decision_reads_as_rule_band_uncertainty_and_outcome(
    rule: Rule, freedom: float | None, sentence: str
) -> None:
    """0.05 inside the limit; Student's factor of five degrees of freedom is 2.65 (JCGM 100, table G.2)."""
    found = decided(check("v", 0.95, Limit("1", maximum=1.0), 0.1, degrees_of_freedom=freedom), rule).decision
    assert found is not None
    assert found.sentence == sentence


def test_a_value_without_uncertainty_has_no_guard_band() -> None:
    found = decided(check("v", 0.95, Limit("1", maximum=1.0)), Rule("guarded")).decision
    assert found is not None
    assert (found.guard_band, found.expanded_uncertainty) == (0.0, None)


def test_a_limit_names_the_source_of_its_default_unless_the_request_gave_another_value() -> None:
    assert limits.asked_limit("1", 3.0, 3.0, "thesis 5.6") == Limit("1", maximum=3.0, source="thesis 5.6")
    assert limits.asked_limit("1", 2.0, 3.0, "thesis 5.6") == Limit("1", maximum=2.0, source=limits.ASKED)
    assert limits.ASKED not in ("", "thesis 5.6")
