"""Examines a campaign against catalogue, unit and bench, before anything moves: its plan, and its faults."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from pydantic import ValidationError

from bench_service.campaigns.campaign import Campaign, Step, StepLimit
from bench_service.jobs.planning import Plan, Planner, stations_of
from bench_service.model.errors import NotFound
from procedures.core.errors import BadParameter, DomainError, NoCalibration
from procedures.core.units import HOUR, converted
from procedures.procedure import PredictedUncertainty, Procedure

NO_CALIBRATIONS = Procedure.calibrations
"""The `calibrations` of a procedure or method whose results are no calibration."""


@dataclass(frozen=True)
class StepPlan:
    """The plan of one step."""

    name: str
    does: str
    left_out: str = ""
    """The reason why it will not be done."""
    stations: int = 0
    duration_s: float = 0.0
    data_bytes: int = 0
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Examination:
    """The plan of a campaign on a unit; `warnings` name the step that they are of."""

    steps: tuple[StepPlan, ...]
    duration_s: float
    data_bytes: int
    warnings: tuple[str, ...]


@dataclass
class _Progress:
    """The results that earlier steps leave for later ones."""

    calibrated: bool = False
    """True once the unit's current calibration is of this campaign."""
    calibrating: set[str] = field(default_factory=set[str])
    """Steps whose results give calibrations."""
    left_out: set[str] = field(default_factory=set[str])


class Examiner:
    """Examines campaigns in advance; moves and stores nothing."""

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self._catalogue = planner.catalogue

    def examine(self, campaign: Campaign, unit: str, bench: str | None, strict: bool) -> Examination:
        """Preview every step of a campaign. Raises `BadParameter` with the step's field, `NotFound`, `NotMounted`.

        With `strict` the unit is the one that the campaign is about to run on: a step that can only begin with a
        calibration is refused where there will be none; without, it is a warning.
        """
        self._planner.context(unit, bench)
        progress = _Progress()
        plans = tuple(self._step(campaign, k, unit, bench, progress, strict) for k in range(len(campaign.steps)))
        duration_s = sum(plan.duration_s for plan in plans)
        if campaign.window_h is not None and duration_s > campaign.window_h * HOUR:
            needs = f"at least {duration_s / HOUR:.4g} h: so long the steps take by their plans"
            raise BadParameter("window_h", campaign.window_h, needs)
        warnings = _warnings(plans)
        if all(plan.left_out for plan in plans):
            warnings.append("every step is left out: the verdict will be error, because nothing is judged")
        return Examination(plans, duration_s, sum(p.data_bytes for p in plans), tuple(warnings))

    def _step(
        self, campaign: Campaign, index: int, unit: str, bench: str | None, progress: _Progress, strict: bool
    ) -> StepPlan:
        step, where = campaign.steps[index], f"steps.{index}"
        _require_possible(step, where)
        catalog: Mapping[str, Any] = self._catalogue.methods if step.method else self._catalogue.procedures
        missing = [name for name in (*step.calibrations_of, *step.recordings_of) if name in progress.left_out]
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
            _require_calibrations(step, where, progress)
            _valid_parameters(self._catalogue.methods[step.does].params.model_validate, step.parameters, where)
            if self._catalogue.methods[step.does].calibrations is not NO_CALIBRATIONS:
                progress.calibrating.add(step.name)
            return StepPlan(step.name, step.does)
        try:
            plan = self._planner.plan(step.does, unit, step.parameters, bench)
        except ValidationError as error:
            raise _first(error, where) from error
        except BadParameter as error:
            raise BadParameter(f"{where}.parameters.{error.field}", error.value, error.allowed) from error
        except DomainError as error:
            if not isinstance(error, NoCalibration):
                raise BadParameter(f"{where}.parameters", step.does, str(error)) from error
            return self._without_calibration(step, where, unit, bench, progress, strict, error)
        if plan.violations:
            raise BadParameter(f"{where}.parameters", plan.violations[0], "beyond a limit of the bench")
        return self._planned(step, where, plan, progress)

    def _planned(self, step: Step, where: str, plan: Plan, progress: _Progress) -> StepPlan:
        procedure, prediction = plan.procedure, plan.prediction
        names = None if procedure.quantities is None else procedure.quantities(plan.parameters, plan.context)
        _require_known(step, where, names)
        warnings = [*prediction.warnings]
        for position, limit in enumerate(step.limits):
            warnings += _unresolved(limit, f"{where}.limits.{position}", prediction.uncertainties)
        if procedure.calibrations is not NO_CALIBRATIONS:
            progress.calibrated = True
            progress.calibrating.add(step.name)
        return StepPlan(
            step.name, step.does, "", len(plan.stations), prediction.duration_s, plan.data_bytes, tuple(warnings)
        )

    def _without_calibration(
        self,
        step: Step,
        where: str,
        unit: str,
        bench: str | None,
        progress: _Progress,
        strict: bool,
        error: DomainError,
    ) -> StepPlan:
        """The plan of a step whose calibration an earlier step is to give: stations, without a prediction."""
        if strict and not progress.calibrated:
            raise BadParameter(where, step.does, str(error)) from error
        procedure, context = self._catalogue.procedure(step.does), self._planner.context(unit, bench)
        params = procedure.resolve(procedure.params.model_validate(step.parameters), context)
        stations = stations_of(procedure, params)
        _require_known(step, where, None if procedure.quantities is None else procedure.quantities(params, context))
        duration_s = sum(s.power_off_s + s.settle_s + s.record_s for s in stations)
        warning = "not predicted: the calibration that it uses is not there yet"
        return StepPlan(step.name, step.does, "", len(stations), duration_s, 0, (warning,))


def _warnings(plans: Sequence[StepPlan]) -> list[str]:
    """The warnings before a campaign begins; one that several steps share is given once."""
    said: dict[str, list[str]] = {}
    for plan in plans:
        for warning in (plan.left_out,) if plan.left_out else plan.warnings:
            said.setdefault(warning, []).append(plan.name)
    return [f"step{'s' if len(names) > 1 else ''} {', '.join(names)}: {text}" for text, names in said.items()]


def _valid_parameters(validate: Any, parameters: dict[str, Any], where: str) -> None:
    try:
        validate(parameters)
    except ValidationError as error:
        raise _first(error, where) from error


def _first(error: ValidationError, where: str) -> BadParameter:
    """The first fault of a step's parameters, with the step in its path."""
    first = error.errors(include_url=False)[0]
    path = ".".join(str(part) for part in (where, "parameters", *first["loc"]))
    return BadParameter(path, first.get("input"), first["msg"])


def _require_known(step: Step, where: str, names: tuple[str, ...] | None) -> None:
    """Refuse a limit or trend on a quantity that the result can never have, where its quantities are known."""
    if names is None:
        return
    for kind, wanted in (("limits", step.limits), ("trends", step.trends)):
        for position, one in enumerate(wanted):
            if one.quantity not in names and not one.quantity.startswith("/"):
                allowed = f"a quantity of {step.does}: {', '.join(names) or 'it has none'}"
                raise BadParameter(f"{where}.{kind}.{position}.quantity", one.quantity, allowed)


def _require_possible(step: Step, where: str) -> None:
    """Refuse a step that contradicts itself: nothing could pass, or nothing would ever be judged."""
    for position, limit in enumerate(step.limits):
        for earlier in step.limits[:position]:
            if earlier.excludes(limit) or limit.excludes(earlier):
                allowed = f"what passes {earlier} too, an earlier limit of {limit.quantity}"
                raise BadParameter(f"{where}.limits.{position}", str(limit), allowed)
    for position, rule in enumerate(step.trends):
        if rule.at_least > rule.last:
            allowed = f"at most {rule.last}: of so many results the limits are made"
            raise BadParameter(f"{where}.trends.{position}.at_least", rule.at_least, allowed)
    for kind, names in (("calibrations_of", step.calibrations_of), ("recordings_of", step.recordings_of)):
        for position, name in enumerate(names):
            if name in names[:position]:
                raise BadParameter(f"{where}.{kind}.{position}", name, "each step once: given twice it counts as two")


def _require_calibrations(step: Step, where: str, progress: _Progress) -> None:
    """Refuse a method on calibrations of a step that gives none."""
    for position, name in enumerate(step.calibrations_of):
        if name not in progress.calibrating:
            allowed = (
                f"a step that calibrates: {', '.join(sorted(progress.calibrating)) or 'none before this one does'}"
            )
            raise BadParameter(f"{where}.calibrations_of.{position}", name, allowed)


def _unresolved(limit: StepLimit, where: str, predicted: tuple[PredictedUncertainty, ...]) -> list[str]:
    """Warn of a limit narrower than the predicted uncertainty of its quantity; refuse a unit of another kind."""
    found = next((p for p in predicted if p.about(limit.quantity)), None)
    if found is None:
        return []
    try:
        uncertainty = converted(found.standard_uncertainty, found.unit, limit.unit)
    except ValueError as error:
        raise BadParameter(f"{where}.unit", limit.unit, f"{limit.quantity}: {error}") from error
    width = (
        0.5 * (limit.maximum - limit.minimum)
        if limit.maximum is not None and limit.minimum is not None
        else abs(limit.maximum if limit.maximum is not None else limit.minimum or 0.0)
    )
    sign_alone = width == 0.0 and None in (limit.minimum, limit.maximum)
    if uncertainty <= width or sign_alone:
        return []
    return [
        f"the limit of {limit.quantity} cannot be resolved: ±{width:.3g} {limit.unit} is asked for, the plan's "
        f"standard uncertainty is {uncertainty:.3g} {limit.unit}"
    ]


def step_field(campaign: Campaign, name: str) -> int:
    """Index of a step by name. Raises `NotFound`."""
    for index, step in enumerate(campaign.steps):
        if step.name == name:
            return index
    raise NotFound("step", name, f"campaign {campaign.name} has {', '.join(s.name for s in campaign.steps)}")
