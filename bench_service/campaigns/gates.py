"""Gates between steps: what must have happened before a step begins, and gates that no run could pass."""

from bench_service.campaigns.campaign import Campaign
from bench_service.campaigns.run import CampaignRun, StepRun, StepState
from procedures.core.errors import BadParameter
from procedures.core.limits import Check, Verdict, bounds

MOST_CHECKS = 4
"""Failed checks that a reason names; the step has them all."""


def closed(run: CampaignRun, index: int) -> str:
    """Return the reason why a step may not begin; empty where its gates are open, or it has none."""
    steps = {step.name: step for step in run.steps}
    found: list[str] = []
    for gate in run.step_of(index).gates:
        step = steps[gate.step]
        if step.verdict is not Verdict(gate.verdict):
            found.append(f"{gate.step} {_became_of(step)}, and this step begins only after its {gate.verdict}")
    return "" if not found else f"gate: {'; '.join(found)}"


def require_consistent(campaign: Campaign) -> None:
    """Refuse gates that contradict each other: no run could ever begin the step. Raises `BadParameter` by the field.

    A step that begins after another's pass inherits that one's gates, for they were open then.
    """
    implied: dict[str, dict[str, str]] = {}
    for number, step in enumerate(campaign.steps):
        wanted: dict[str, str] = {}
        for position, gate in enumerate(step.gates):
            where = f"steps.{number}.gates.{position}"
            of_gate = {**implied[gate.step], gate.step: gate.verdict}
            for name, verdict in of_gate.items():
                other = wanted.setdefault(name, verdict)
                if other != verdict:
                    value = f"{gate.step}: {gate.verdict}"
                    allowed = f"no run could begin {step.name}: its gates want {name} to pass and to fail"
                    raise BadParameter(where, value, allowed)
            if gate.verdict == "fail" and campaign.step(gate.step).on_fail == "stop":
                allowed = f"no run could begin {step.name}: on_fail of {gate.step} is stop, which ends the run"
                raise BadParameter(where, f"{gate.step}: fail", allowed)
        implied[step.name] = wanted


def _became_of(step: StepRun) -> str:
    if step.state is StepState.SKIPPED:
        return "was left out"
    if step.verdict is Verdict.PASS:
        return "passed"
    if step.verdict is Verdict.FAIL:
        failed = [_sentence(c) for c in step.checks if not (c.passed or c.inconclusive)]
        more = f" and {len(failed) - MOST_CHECKS} more" if len(failed) > MOST_CHECKS else ""
        return f"failed ({', '.join(failed[:MOST_CHECKS])}{more})"
    return f"gave no verdict ({step.reason})" if step.reason else "gave no verdict"


def _sentence(check: Check) -> str:
    limit = check.limit
    value = "unbounded" if check.value is None else f"{check.value:.4g}"
    return f"{check.name} = {value}, limit {bounds(limit.minimum, limit.maximum, limit.unit)}"
