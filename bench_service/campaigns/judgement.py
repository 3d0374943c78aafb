"""Judges a step's result beyond its own checks: by the campaign's limits, and by the unit's history."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import TypeAdapter

from bench_service.campaigns.campaign import Campaign, Step, StepLimit, TrendRule
from bench_service.campaigns.decision import decided, rule_of
from bench_service.campaigns.stores import Stores
from bench_service.evidence.trend import trend_of, value_of
from bench_service.model.errors import NotFound
from bench_service.model.quantities import quantity
from bench_service.model.records import StoredResult
from procedures.core.errors import BadParameter
from procedures.core.limits import Check, Limit, Verdict, check, verdict
from procedures.core.units import converted

CHECKS = TypeAdapter(tuple[Check, ...])


@dataclass(frozen=True)
class Judgement:
    """Verdict of a step, and the checks, warnings and reason behind it."""

    verdict: Verdict
    checks: tuple[Check, ...]
    warnings: tuple[str, ...]
    reason: str = ""


def judge(step: Step, campaign: Campaign, result: StoredResult, stores: Stores) -> Judgement:
    """Return the result's own verdict, made worse where the campaign's limits or trend rules are not met.

    A limit on a quantity that the result lacks, or has in another kind of unit, is an error of the step, unless a check
    has failed: then it is a fail, and the reason names the limit.
    """
    own = checks_of(result.document)
    warnings = list(result.document.get("warnings", []))
    added: list[Check] = []
    failures: list[str] = []
    for limit in step.limits:
        try:
            added.append(_limited(limit, campaign, result.document))
        except (NotFound, BadParameter) as error:
            failures.append(str(error))
    for rule in step.trends:
        try:
            judged, said = _trend(rule, result, stores)
        except NotFound as error:
            failures.append(str(error))
            continue
        added += judged
        warnings += said
    worst = _worst(result.verdict, own, added)
    worst = Verdict.ERROR if failures and worst is not Verdict.FAIL else worst
    undecided = [f"{c.name} is inconclusive" for c in (*own, *added) if c.inconclusive]
    reasons = (*failures, *(undecided if worst is Verdict.ERROR else ()))
    return Judgement(worst, (*own, *added), tuple(warnings), "; ".join(reasons))


def checks_of(document: dict[str, Any]) -> tuple[Check, ...]:
    """Return the procedure's own checks from the document of a result; empty where it has none."""
    return CHECKS.validate_python(document.get("checks", []))


def _worst(own: Verdict, checks: Sequence[Check], added: Sequence[Check]) -> Verdict:
    """The verdict of a result and of the checks added to its own. An error that its checks do not explain stays one."""
    undecided = own is Verdict.ERROR and any(c.inconclusive for c in checks)
    if added and (own is Verdict.PASS or undecided):
        return verdict((*checks, *added))
    return own


def _limited(limit: StepLimit, campaign: Campaign, document: dict[str, Any]) -> Check:
    found = quantity(document, limit.quantity)
    try:
        size = converted(1.0, found.unit or limit.unit, limit.unit)
    except ValueError as error:
        raise BadParameter("limits.unit", limit.unit, f"{limit.quantity}: {error}") from error
    source = f"campaign {campaign.name}" + (f": {limit.source}" if limit.source else "")
    wanted = Limit(limit.unit, limit.maximum, limit.minimum, source)
    uncertainty = None if found.standard_uncertainty is None else found.standard_uncertainty * size
    made = check(f"{limit.quantity}, campaign's limit", found.value * size, wanted, uncertainty, bound=found.bound)
    return decided(made, rule_of(limit, campaign.decision))


def _trend(rule: TrendRule, result: StoredResult, stores: Stores) -> tuple[list[Check], list[str]]:
    """Judge the newest value against control limits from earlier results of the same plan."""
    unit, now = result.unit or "", quantity(result.document, rule.quantity)
    earlier = stores.results.values(
        unit,
        result.name,
        rule.quantity,
        simulated=result.simulated,
        limit=rule.last,
        before=result.id,
        parameters=result.parameters,
    )
    chart = trend_of([*earlier[::-1], value_of(result, rule.quantity)], unit, result.name, rule.quantity, judged=1)
    known = len(chart.points) - 1
    if known < rule.at_least or chart.limits is None:
        return [], [f"trend of {rule.quantity}: {known} earlier results, {rule.at_least} are needed to judge it"]
    broken = [s.rule for s in chart.signals if s.index == known]
    text = f"trend of {rule.quantity} over {known} results: {'; '.join(broken) or 'no signal'}"
    if rule.outcome == "warning":
        return [], [text] if broken else []
    limit = Limit(now.unit, chart.limits.upper, chart.limits.lower, f"control limits of {known} earlier results")
    name = f"{rule.quantity}, trend"
    return [Check(name, now.value, limit, not broken, now.standard_uncertainty, text)], []
