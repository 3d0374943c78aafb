"""Bases of parameter models, checks that follow from them alone, and the decision rules of every verdict."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field

from procedures.core.errors import BadParameter
from procedures.core.limits import (
    COVERAGE,
    OURS,
    SIGNIFICANCE,
    Check,
    Limit,
    PlannedCheck,
    Rule,
    RuleName,
    significance,
    source_of,
)


class Parameters(BaseModel):
    """Base of every parameter model: unknown names are refused, NaN and infinity too."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    def filled(self, defaults: Mapping[str, Any]) -> Self:
        """Return the parameters with each None replaced by its default, where there is one."""
        return self.model_copy(update={name: value for name, value in defaults.items() if getattr(self, name) is None})

    def source_of(self, limit: str, own: str = OURS) -> str:
        """Return the source of the limit in this field: `own` for the field's default, the request for other values."""
        return source_of(getattr(self, limit), type(self).model_fields[limit].default, own)


def planned_tests(params: Parameters, field: str, *checks: str) -> tuple[PlannedCheck, ...]:
    """Return planned tests of significance, each at the level in this field; none where the level is zero or null."""
    level: float | None = getattr(params, field)
    if not level:
        return ()
    limit = Limit("1", minimum=level, source=params.source_of(field, SIGNIFICANCE))
    return tuple(PlannedCheck(name, limit, level=level) for name in checks)


def level_check(params: Parameters, field: str, check: str, p_value: float, note: str = "") -> Check:
    """Return the check of a test of significance at the level in this field (`core.limits.significance`)."""
    return significance(check, p_value, getattr(params, field), note, params.source_of(field, SIGNIFICANCE))


def largest(params: Parameters, field: str, unit: str, source: str = OURS) -> Limit:
    """Return the largest value in this field as a limit; `source` is that of the field's default."""
    return Limit(unit, maximum=getattr(params, field), source=params.source_of(field, source))


class DecisionRules(Parameters):
    """Rules by which a result's values are held to their limits (ISO/IEC 17025, 7.8.6; ILAC-G8)."""

    rule: RuleName = Field(
        "simple", description="simple: a value passes at its limit; guarded: inside it by the guard band r·U"
    )
    guard: float = Field(1.0, gt=0.0, le=10.0, description="r of the guarded rule")
    coverage_probability: float = Field(
        COVERAGE, gt=0.5, lt=1.0, description="of U = k·u; k is Student's factor of the value's degrees of freedom"
    )
    by_check: dict[str, RuleName] = Field(
        default_factory=dict[str, RuleName], max_length=200, description="another rule for a check, by its name"
    )

    def of(self, check: str) -> Rule:
        """Return the decision rule of the check with this name."""
        return Rule(self.by_check.get(check, self.rule), self.guard, self.coverage_probability)

    def require_known(self, checks: Sequence[str]) -> None:
        """Refuse a rule for a check that a result will not have. Raises `BadParameter` by the check."""
        for name in self.by_check:
            if name not in checks:
                raise BadParameter("decision.by_check", name, f"one of {', '.join(checks)}")


class JudgedParameters(Parameters):
    """Base of the parameters of procedures and methods that give a verdict: the decision rules."""

    decision: DecisionRules | None = Field(
        None,
        exclude_if=lambda rules: rules is None,
        description="how values are held to their limits; None: simple acceptance, U at 95.45 %",
    )


class SupplyParameters(Parameters):
    """The voltage of the unit's supply, of procedures that test a unit at other voltages than the nominal one."""

    supply_voltage_v: float | None = Field(
        None,
        gt=0.0,
        le=1000.0,
        exclude_if=lambda voltage: voltage is None,
        description="of the unit's supply, set before the unit is switched on; None: the bench's nominal voltage",
    )


Second = Annotated[float, Field(ge=0.0, le=1e9)]


class RecordedParameters(JudgedParameters):
    """Base of the parameters of methods that work on recordings, or on a stretch of them."""

    start_s: Second | tuple[Second, ...] | None = Field(
        None, description="from this second of each recording; a list: one for each"
    )
    stop_s: Second | tuple[Second, ...] | None = Field(
        None, description="up to this second of each recording; a list: one for each"
    )
