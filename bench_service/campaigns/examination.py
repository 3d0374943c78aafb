"""Examines a campaign against catalogue, unit and bench, before anything moves: its plan, and its faults."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import Any

from pydantic import ValidationError

from bench_service.campaigns.campaign import Campaign, DecisionRule, Step, StepLimit
from bench_service.campaigns.decision import in_words, rule_of, rule_of_check
from bench_service.campaigns.expected_unit import NO_CALIBRATIONS, NO_CORRECTIONS, Progress
from bench_service.campaigns.faults import (
    first_fault,
    require_calibrations,
    require_known,
    require_possible,
    unresolved,
    valid_parameters,
)
from bench_service.campaigns.gates import require_consistent
from bench_service.campaigns.power import LimitPreview, preview
from bench_service.jobs.planning import Plan, Planner
from bench_service.jobs.procedure_calls import (
    expected_averaging_time_of,
    planned_checks_of,
    quantities_of,
    resolved,
    stations_of,
)
from bench_service.model.errors import NotFound
from procedures.core.errors import BadParameter, DomainError, NoCalibration
from procedures.core.limits import Limit, PlannedCheck
from procedures.core.units import HOUR, converted
from procedures.procedure import Context, PredictedUncertainty


@dataclass(frozen=True)
class StepPlan:
    """The plan of one step of a campaign: stations, duration, size of its data, warnings, gates and limits."""

    name: str
    does: str
    left_out: str = ""
    """The reason why the step will not be done; empty: it will."""
    stations: int = 0
    duration_s: float = 0.0
    data_bytes: int = 0
    warnings: tuple[str, ...] = ()
    gates: tuple[str, ...] = ()
    """The earlier steps and their verdicts without which it is left out, as sentences."""
    limits: tuple[LimitPreview, ...] = ()
    """The limits that can be told beforehand: those of the procedure, then the campaign's own."""


@dataclass(frozen=True)
class Examination:
    """The plan of a campaign on a unit, step by step; each warning names its step."""

    steps: tuple[StepPlan, ...]
    duration_s: float
    data_bytes: int
    warnings: tuple[str, ...]
    decision: str = ""
    """The rule by which values are held to limits, in words."""
    false_alarm: float = 0.0
    """Probability that the unit as recorded fails a limit of known false alarm, were they independent."""


def _require_stated(rule: DecisionRule, levels: Sequence[float]) -> None:
    """Refuse a stated chance of false alarms that the levels exceed together. Raises `BadParameter`.

    Bonferroni's bound, which holds for dependent tests as well: the chance of any is at most the sum.
    """
    stated, together = rule.false_alarm, sum(levels)
    if stated is not None and together > stated * (1.0 + 1e-9):
        enough = f"at least {together:.3g}: so much have the {len(levels)} tests of significance together"
        way_out = f"with a level of {stated / len(levels):.2g} each, they would do"
        raise BadParameter("decision.false_alarm", stated, f"{enough} ({way_out})")


def _previews(planned: Sequence[PlannedCheck], params: Any) -> list[LimitPreview]:
    """Foresee a procedure's or method's own checks, by the decision rules of its parameters where it has some."""
    rules = getattr(params, "decision", None)
    return [preview(one, rule_of_check(rules, one.check)) for one in planned]


_CORRECTED = "predicted without the share of the thermal correction, which an earlier step is to give"
_EXPECTED = "predicted with the calibration that earlier steps are to give, at nominal scale factors"


class Examiner:
    """Plans campaigns on a unit and a bench in advance, and finds their faults; moves and stores nothing."""

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self._catalogue = planner.catalogue

    def examine(self, campaign: Campaign, unit: str, bench: str | None, strict: bool) -> Examination:
        """Preview every step of a campaign, and return the plan of all. Raises `BadParameter` with the step's field or
        `window_h`, `NotFound`, `NotMounted`.

        With `strict` the unit is the one that the campaign is about to run on: a step that can only begin with a
        calibration is refused where there will be none; without, it is a warning.

        `bench` None: the one of jobs that name none.
        """
        self._planner.context(unit, bench)
        require_consistent(campaign)
        progress = Progress()
        plans = tuple(
            replace(
                self._step(campaign, k, unit, bench, progress, strict),
                gates=tuple(f"{gate.step}: {gate.verdict}" for gate in campaign.steps[k].gates),
            )
            for k in range(len(campaign.steps))
        )
        duration_s = sum(plan.duration_s for plan in plans)
        if campaign.window_h is not None and duration_s > campaign.window_h * HOUR:
            needs = f"at least {duration_s / HOUR:.4g} h: so long the steps take by their plans"
            raise BadParameter("window_h", campaign.window_h, needs)
        warnings = _warnings(plans)
        if all(plan.left_out for plan in plans):
            warnings.append("every step is left out: the verdict will be error, because nothing is judged")
        _require_stated(campaign.decision, [one.level for p in plans for one in p.limits if one.level is not None])
        sound = prod(1.0 - one.false_alarm for p in plans for one in p.limits if one.false_alarm is not None)
        told = (plans, duration_s, sum(p.data_bytes for p in plans), tuple(warnings), in_words(campaign.decision))
        return Examination(*told, false_alarm=1.0 - sound)

    def _step(
        self, campaign: Campaign, index: int, unit: str, bench: str | None, progress: Progress, strict: bool
    ) -> StepPlan:
        step, where = campaign.steps[index], f"steps.{index}"
        require_possible(step, where)
        catalog: Mapping[str, Any] = self._catalogue.methods if step.method else self._catalogue.procedures
        needed = (*step.calibrations_of, *step.recordings_of, *(gate.step for gate in step.gates))
        missing = [name for name in needed if name in progress.left_out]
        if step.does not in catalog or missing:
            kind = "method" if step.method else "procedure"
            if not step.optional:
                if missing:
                    raise BadParameter(where, missing[0], "a step that is not left out, or make this one optional too")
                allowed = f"one of {', '.join(catalog)} (or optional: true, which leaves the step out)"
                raise BadParameter(f"{where}.{kind}", step.does, allowed)
            progress.left_out.add(step.name)
            why = f"it works on {missing[0]}, which is left out" if missing else f"there is no {kind} {step.does} yet"
            return StepPlan(step.name, step.does, f"left out: {why}")
        if step.method is not None:
            return self._method(step, where, unit, bench, progress)
        try:
            plan, unknown = self._foreseen(step, unit, bench, progress)
        except ValidationError as error:
            raise first_fault(error, where) from error
        except BadParameter as error:
            raise BadParameter(f"{where}.parameters.{error.field}", error.value, error.allowed) from error
        except DomainError as error:
            if not isinstance(error, NoCalibration):
                raise BadParameter(f"{where}.parameters", step.does, str(error)) from error
            return self._without_calibration(step, where, unit, bench, progress, strict, error)
        if plan.violations:
            raise BadParameter(f"{where}.parameters", plan.violations[0], "beyond a limit of the bench")
        return self._planned(step, where, plan, unknown, progress, campaign.decision)

    def _method(self, step: Step, where: str, unit: str, bench: str | None, progress: Progress) -> StepPlan:
        method = self._catalogue.methods[step.does]
        require_calibrations(step, where, progress.calibrating)
        valid_parameters(method.params.model_validate, step.parameters, where)
        if method.calibrations is not NO_CALIBRATIONS:
            progress.calibrating.add(step.name)
        params, record = method.params.model_validate(step.parameters), self._context(unit, bench, progress).unit
        checks = method.planned_checks(params, record, progress.predicted_uncertainties_of(step.calibrations_of))
        limits = tuple(_previews(checks, params))
        coarse = (
            f"{one.check}: the limit of {one.maximum:g} {one.unit} cannot be resolved, U = "
            f"{one.expanded_uncertainty:.3g} {one.unit}"
            for one in limits
            if one.resolved is False and one.expanded_uncertainty is not None
        )
        return StepPlan(step.name, step.does, warnings=tuple(coarse), limits=limits)

    def _context(self, unit: str, bench: str | None, progress: Progress) -> Context:
        """The unit with the record that earlier steps are expected to leave, and the bench."""
        context = self._planner.context(unit, bench)
        return replace(context, unit=progress.record(context.unit))

    def _foreseen(self, step: Step, unit: str, bench: str | None, progress: Progress) -> tuple[Plan, tuple[str, ...]]:
        """The plan on the unit as earlier steps will leave it, as far as that is known, and what is not, in words."""
        stored, parameters, unknown = self._planner.context(unit, bench), step.parameters, ()
        context = replace(stored, unit=progress.record(stored.unit))
        wanted = parameters.get("thermal_correction") == "current" and context.unit.thermal_correction is None
        if wanted and progress.correcting:
            parameters, unknown = {**parameters, "thermal_correction": "none"}, (_CORRECTED,)
        try:
            plan = self._planner.plan_in(context, step.does, parameters)
        except NoCalibration:
            expected = progress.expected(context.unit) if progress.calibrated else None
            if expected is None:
                raise
            plan = self._planner.plan_in(replace(context, unit=expected), step.does, parameters)
            unknown = (*unknown, _EXPECTED)
        return plan, (*unknown, *_of_averaging_time(plan, parameters, progress, stored.unit.averaging_time_s))

    def _planned(
        self, step: Step, where: str, plan: Plan, unknown: tuple[str, ...], progress: Progress, rule: DecisionRule
    ) -> StepPlan:
        procedure, prediction = plan.procedure, plan.prediction
        names = quantities_of(procedure, plan.parameters, plan.context)
        require_known(step, where, names)
        warnings = [*prediction.warnings, *unknown]
        for position, limit in enumerate(step.limits):
            warnings += unresolved(limit, f"{where}.limits.{position}", prediction.uncertainties)
        if procedure.calibrations is not NO_CALIBRATIONS:
            progress.calibrated = True
            progress.calibrating.add(step.name)
            progress.planned[step.name] = prediction.uncertainties
        if procedure.corrections is not NO_CORRECTIONS:
            progress.correcting.add(step.name)
        averaging_time_s = expected_averaging_time_of(procedure, plan.parameters, plan.context)
        if averaging_time_s is not None:
            progress.averaging_time_s, progress.averaging_time_of = averaging_time_s, step.name
        checks = _previews(planned_checks_of(procedure, plan.parameters, plan.context), plan.parameters)
        checks += [
            preview(_of_campaign(limit, prediction.uncertainties), rule_of(limit, rule)) for limit in step.limits
        ]
        told = (len(plan.stations), prediction.duration_s, plan.data_bytes, tuple(warnings))
        return StepPlan(step.name, step.does, "", *told, limits=tuple(checks))

    def _without_calibration(
        self,
        step: Step,
        where: str,
        unit: str,
        bench: str | None,
        progress: Progress,
        strict: bool,
        error: DomainError,
    ) -> StepPlan:
        """The plan of a step whose calibration an earlier step is to give: stations, without a prediction."""
        if strict and not progress.calibrated:
            raise BadParameter(where, step.does, str(error)) from error
        procedure, context = self._catalogue.procedure(step.does), self._context(unit, bench, progress)
        params = resolved(procedure, step.parameters, context)
        stations = stations_of(procedure, params)
        require_known(step, where, quantities_of(procedure, params, context))
        duration_s = sum(s.power_off_s + s.settle_s + s.record_s for s in stations)
        warning = "not predicted: the calibration that it uses is not there yet"
        return StepPlan(step.name, step.does, "", len(stations), duration_s, 0, (warning,))


def _of_averaging_time(
    plan: Plan, parameters: Mapping[str, Any], progress: Progress, stored_s: float
) -> tuple[str, ...]:
    """The sentence on an averaging time that an earlier step is to give, where the plan's parameters follow it."""
    if progress.averaging_time_s is None:
        return ()
    unit, procedure = plan.context.unit, plan.procedure
    stored = replace(plan.context, unit=replace(unit, averaging_time_s=stored_s))
    if resolved(procedure, parameters, stored) == plan.parameters:
        return ()
    return (
        f"predicted with the averaging time of {unit.averaging_time_s:g} s that step {progress.averaging_time_of} is "
        f"expected to find, by the noise of the unit's record; that record has {stored_s:g} s until then",
    )


def _warnings(plans: Sequence[StepPlan]) -> list[str]:
    """The warnings before a campaign begins; one that several steps share is given once."""
    said: dict[str, list[str]] = {}
    for plan in plans:
        for warning in (plan.left_out,) if plan.left_out else plan.warnings:
            said.setdefault(warning, []).append(plan.name)
    return [f"step{'s' if len(names) > 1 else ''} {', '.join(names)}: {text}" for text, names in said.items()]


def _of_campaign(limit: StepLimit, predicted: Sequence[PredictedUncertainty]) -> PlannedCheck:
    """A campaign's limit with the predicted uncertainty of its quantity."""
    found = next((p for p in predicted if p.about(limit.quantity)), None)
    u = None if found is None else converted(found.standard_uncertainty, found.unit, limit.unit)
    name = f"{limit.quantity}, campaign's limit"
    return PlannedCheck(name, Limit(limit.unit, limit.maximum, limit.minimum, limit.source), u)


def step_field(campaign: Campaign, name: str) -> int:
    """Return the index (from 0) of the step of that name. Raises `NotFound`, naming the campaign's steps."""
    for index, step in enumerate(campaign.steps):
        if step.name == name:
            return index
    raise NotFound("step", name, f"campaign {campaign.name} has {', '.join(s.name for s in campaign.steps)}")
