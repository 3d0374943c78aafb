"""Faults of a campaign's step that are seen before anything moves: each is refused by its field."""

from collections.abc import Collection
from typing import Any

from pydantic import ValidationError

from bench_service.campaigns.campaign import Campaign, Step, StepLimit
from bench_service.campaigns.power import half_width
from procedures.core.errors import BadParameter
from procedures.core.limits import Limit
from procedures.core.units import converted
from procedures.procedure import PredictedUncertainty


def require_sources(campaign: Campaign) -> None:
    """Refuse a limit without a source. Raises `BadParameter`; campaigns that were stored without sources still run."""
    for number, step in enumerate(campaign.steps):
        for position, limit in enumerate(step.limits):
            if not limit.source.strip():
                allowed = f"the origin of the limit of {limit.quantity}: a standard, a table, a preview's uncertainty"
                raise BadParameter(f"steps.{number}.limits.{position}.source", limit.source, allowed)


def valid_parameters(validate: Any, parameters: dict[str, Any], where: str) -> None:
    try:
        validate(parameters)
    except ValidationError as error:
        raise first_fault(error, where) from error


def first_fault(error: ValidationError, where: str) -> BadParameter:
    """Return the first fault of a step's parameters as an error to raise, with the step in its path."""
    first = error.errors(include_url=False)[0]
    path = ".".join(str(part) for part in (where, "parameters", *first["loc"]))
    return BadParameter(path, first.get("input"), first["msg"])


def require_known(step: Step, where: str, names: tuple[str, ...] | None) -> None:
    """Refuse a limit or trend on a quantity that the result can never have, where its quantities are known (`names`
    None: they are not). Raises `BadParameter`.
    """
    if names is None:
        return
    for kind, wanted in (("limits", step.limits), ("trends", step.trends)):
        for position, one in enumerate(wanted):
            if one.quantity not in names and not one.quantity.startswith("/"):
                allowed = f"a quantity of {step.does}: {', '.join(names) or 'it has none'}"
                raise BadParameter(f"{where}.{kind}.{position}.quantity", one.quantity, allowed)


def require_possible(step: Step, where: str) -> None:
    """Refuse a step that contradicts itself: nothing could pass, or nothing would ever be judged. Raises
    `BadParameter`.
    """
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


def require_calibrations(step: Step, where: str, calibrating: Collection[str]) -> None:
    """Refuse a method that takes calibrations of a step which gives none. Raises `BadParameter`."""
    for position, name in enumerate(step.calibrations_of):
        if name not in calibrating:
            allowed = f"a step that calibrates: {', '.join(sorted(calibrating)) or 'none before this one does'}"
            raise BadParameter(f"{where}.calibrations_of.{position}", name, allowed)


def unresolved(limit: StepLimit, where: str, predicted: tuple[PredictedUncertainty, ...]) -> list[str]:
    """Return a warning for a limit narrower than the predicted uncertainty of its quantity, else nothing. Raises
    `BadParameter` where limit and quantity have units of different kinds.
    """
    found = next((p for p in predicted if p.about(limit.quantity)), None)
    if found is None:
        return []
    try:
        uncertainty = converted(found.standard_uncertainty, found.unit, limit.unit)
    except ValueError as error:
        raise BadParameter(f"{where}.unit", limit.unit, f"{limit.quantity}: {error}") from error
    width = half_width(Limit(limit.unit, limit.maximum, limit.minimum))
    sign_alone = width == 0.0 and None in (limit.minimum, limit.maximum)
    if uncertainty <= width or sign_alone:
        return []
    return [
        f"the limit of {limit.quantity} cannot be resolved: ±{width:.3g} {limit.unit} is asked for, the plan's "
        f"standard uncertainty is {uncertainty:.3g} {limit.unit}"
    ]
