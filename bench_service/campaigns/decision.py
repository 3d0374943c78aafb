"""Decisions on a campaign's own limits, by the rules of `procedures.core.limits`.

The words are those of ILAC-G8 (4.2.3): a pass or a fail is conditional where the value lies within U of the limit.
"""

from dataclasses import replace

from bench_service.campaigns.campaign import DecisionRule, StepLimit
from procedures.core import limits
from procedures.core.limits import Check, Rule, coverage_factor
from procedures.parameters import DecisionRules


def decided(check: Check, rule: DecisionRule) -> Check:
    """Return the check under the rule of a campaign or of one of its limits (`rule_of`), with the decision in its note.
    A value that is not finite stays a fail.
    """
    made = limits.decided(check, Rule(rule.rule, rule.guard, coverage_factor=rule.coverage_factor))
    said = "" if made.decision is None else made.decision.sentence
    return replace(made, note="; ".join(text for text in (made.note, said) if text))


def rule_of(limit: StepLimit, rule: DecisionRule) -> DecisionRule:
    """Return the decision rule of one limit of a campaign: its own, else the campaign's."""
    return rule if limit.rule is None else rule.model_copy(update={"rule": limit.rule})


def rule_of_check(rules: DecisionRules | None, check: str) -> DecisionRule:
    """Return the decision rule of a procedure's own check, as its parameters have it; simple acceptance without."""
    if rules is None:
        return DecisionRule.model_validate({})
    of = rules.of(check)
    k = coverage_factor(of.coverage_probability, None)
    return DecisionRule.model_validate({"rule": of.name, "guard": of.guard, "coverage_factor": max(1.0, k)})


def in_words(rule: DecisionRule) -> str:
    """Return the decision rule as a sentence for a report."""
    stated = (
        ""
        if rule.false_alarm is None
        else f"; all tests of significance together refuse a sound unit with a chance of at most {rule.false_alarm:g} "
        "(Bonferroni)"
    )
    if rule.rule == "simple":
        told = f"simple acceptance: a value passes at its limit; U = k·u is stated with k = {rule.coverage_factor:g}"
        return told + stated
    band = f"{rule.guard:g}·U, U = k·u with k = {rule.coverage_factor:g}"
    return f"guarded acceptance on the campaign's own limits: a value passes within its limit by {band}{stated}"
