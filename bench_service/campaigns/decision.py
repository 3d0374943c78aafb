"""Decisions on a campaign's own limits: expanded uncertainty, guard band, and how sure a pass or a fail is.

ISO/IEC 17025 wants the rule of a statement of conformity (7.8.6); the words are those of ILAC-G8:09/2019, 4.2.3: a pass
or a fail is conditional where the value lies within U of the limit.
"""

from dataclasses import replace
from math import inf

from bench_service.campaigns.campaign import DecisionRule
from procedures.core.limits import Check, Verdict


def decided(check: Check, rule: DecisionRule) -> Check:
    """The check under the rule: its outcome, with the rule, U and the kind of pass or fail in its note.

    A value that is not finite stays a fail.
    """
    if check.standard_uncertainty is None:
        return replace(check, note=_joined(check.note, "simple acceptance: its uncertainty is not known"))
    expanded = rule.coverage_factor * check.standard_uncertainty
    band = rule.guard * expanded if rule.rule == "guarded" else 0.0
    inside = _inside(check)
    passed = check.passed and inside >= band
    sure = "" if abs(inside) >= expanded else "conditional "
    how = "simple acceptance" if rule.rule == "simple" else f"guard band {band:.3g} (r = {rule.guard:g})"
    outcome = Verdict.PASS if passed else Verdict.FAIL
    text = f"{how}, U = {expanded:.3g} {check.limit.unit} (k = {rule.coverage_factor:g}): {sure}{outcome.value}"
    return replace(check, passed=passed, note=_joined(check.note, text))


def in_words(rule: DecisionRule) -> str:
    """The rule as a sentence for a report."""
    stated = (
        ""
        if rule.false_alarm is None
        else f"; all tests of significance together refuse a sound unit with a chance of at most {rule.false_alarm:g} "
        "(Bonferroni)"
    )
    if rule.rule == "simple":
        told = f"simple acceptance: a value passes at its limit; U = k·u is told with k = {rule.coverage_factor:g}"
        return told + stated
    band = f"{rule.guard:g}·U, U = k·u with k = {rule.coverage_factor:g}"
    return f"guarded acceptance on the campaign's own limits: a value passes within its limit by {band}{stated}"


def _inside(check: Check) -> float:
    """Distance of the value from the nearer limit; negative outside, and for no finite value."""
    limit = check.limit
    below = inf if limit.maximum is None else limit.maximum - check.value
    above = inf if limit.minimum is None else check.value - limit.minimum
    found = min(below, above)
    return -inf if found != found else found


def _joined(*texts: str) -> str:
    return "; ".join(text for text in texts if text)
