"""A campaign as data: procedures in order, with limits, stop rules, and a rule for the seeds of simulated benches.

A document that is no campaign is refused here; one that can never work, in `examination`, so that a stored one can
always be read.
"""

from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from procedures.core.limits import RuleName, bounds
from procedures.core.units import converted

NAME = r"^[a-z0-9][a-z0-9_-]{0,63}$"
TEXT = r"^[^\x00-\x08\x0b-\x1f]*$"
QUANTITY = Field(
    min_length=1,
    max_length=200,
    pattern=TEXT,
    description="Name of a check or of a named estimate of the result (gyro.b_x), or a JSON pointer into its document",
)
Label = Annotated[str, Field(min_length=1, max_length=100, pattern=r"^[^\x00-\x1f]+$")]
Labels = dict[Label, Label]
Name = Annotated[str, Field(pattern=NAME)]


class Document(BaseModel):
    """Base of the parts of a campaign's document: unknown fields are refused, NaN and infinity too."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class StepLimit(Document):
    """An allowed range of one quantity of a step's result, ends included, added to the procedure's own checks."""

    quantity: str = QUANTITY
    unit: str = Field(min_length=1, max_length=32, pattern=TEXT, description="of the limits; deg/h, m/s^2, ppm, 1, …")
    minimum: float | None = None
    maximum: float | None = None
    rule: RuleName | None = Field(None, description="of the decision on this limit; null: the campaign's")
    source: str = Field(
        "", max_length=300, pattern=TEXT, description="where the limit comes from; a new campaign needs it for each"
    )

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.minimum is None and self.maximum is None:
            raise ValueError("a limit needs a minimum, a maximum or both")
        if self.minimum is not None and self.maximum is not None and self.minimum > self.maximum:
            raise ValueError(f"nothing can pass: minimum {self.minimum:g} is above maximum {self.maximum:g}")
        return self

    def __str__(self) -> str:
        return bounds(self.minimum, self.maximum, self.unit)

    def excludes(self, other: "StepLimit") -> bool:
        """Return whether every value that passes the other limit of the same quantity is below this one's minimum."""
        if other.quantity != self.quantity or self.minimum is None or other.maximum is None:
            return False
        try:
            return self.minimum > converted(other.maximum, other.unit, self.unit)
        except ValueError:  # units of different kinds: one of them is refused for its unit
            return False


class TrendRule(Document):
    """Rule that holds a quantity to the control limits of the unit's earlier results of the same procedure and
    parameters.
    """

    quantity: str = QUANTITY
    outcome: Literal["warning", "fail"] = Field("warning", description="what a signal of the chart means")
    at_least: int = Field(8, ge=2, le=500, description="earlier results; with fewer nothing is judged, and it is said")
    last: int = Field(100, ge=2, le=500, description="how many of the earlier results the limits rest on at most")


class Gate(Document):
    """Condition on an earlier step: the step behind the gate begins only once that one has this verdict."""

    step: Name
    verdict: Literal["pass", "fail"] = "pass"


class DecisionRule(Document):
    """Rule of the campaign's decisions on its own limits (ISO/IEC 17025, 7.8.6; ILAC-G8).

    ``U = k·u`` is the expanded uncertainty, k the `coverage_factor`. Under `rule` "guarded" a value is accepted at
    ``limit − r·U`` for a maximum, ``limit + r·U`` for a minimum; r is `guard`. Under "simple", the default, it is
    accepted at the limit and `guard` has no effect. A value without a known uncertainty is accepted simply, and the
    check's note says so.
    """

    rule: Literal["simple", "guarded"] = "simple"
    guard: float = Field(1.0, gt=0.0, le=10.0, description="r of the guarded rule: the guard band is r·U")
    coverage_factor: float = Field(2.0, ge=1.0, le=10.0, description="k of U = k·u; 2 is about 95 %")
    false_alarm: float | None = Field(
        None,
        gt=0.0,
        le=0.5,
        description="chance, stated beforehand, that a sound unit fails any test of significance of all steps: the sum "
        "of their levels (Bonferroni) must stay within it",
    )


class Step(Document):
    """One step of a campaign: a procedure on the bench, or a method over the results of earlier steps."""

    name: Name
    procedure: Label | None = None
    method: Label | None = Field(None, description="needs no bench; works on the results of earlier steps")
    calibrations_of: tuple[Name, ...] = Field((), max_length=100, description="of a method: steps that calibrated")
    recordings_of: tuple[Name, ...] = Field((), max_length=100, description="of a method: steps that recorded")
    parameters: dict[str, Any] = Field(default_factory=dict[str, Any])
    limits: tuple[StepLimit, ...] = Field((), max_length=200)
    trends: tuple[TrendRule, ...] = Field((), max_length=50)
    gates: tuple[Gate, ...] = Field(
        (), max_length=100, description="earlier steps that must have passed (or failed); else this one is left out"
    )
    on_fail: Literal["stop", "continue"] = Field("continue", description="when the verdict is fail")
    on_error: Literal["stop", "continue"] = Field("stop", description="when it gave no verdict, after all retries")
    retries: int = Field(0, ge=0, le=10, description="how often an error is answered by a new job")
    optional: bool = Field(False, description="left out, and named, where the catalogue has no such procedure")

    @property
    def does(self) -> str:
        """Name of the step's procedure or method."""
        return self.procedure or self.method or ""

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if (self.procedure is None) == (self.method is None):
            raise ValueError("a step has either a procedure or a method")
        if self.procedure is not None and (self.calibrations_of or self.recordings_of):
            raise ValueError("only a method works on the results of other steps")
        if self.method is not None and not (self.calibrations_of or self.recordings_of):
            raise ValueError("a method needs calibrations_of or recordings_of")
        if self.method is not None and self.trends:
            raise ValueError("only a step with a procedure has trends")
        return self


class Seeds(Document):
    """Seed of a step on a simulated bench: the run's base + the step's number (from 0) + 1000 for every retry.

    The run's base is the one in its request; else, by `rule`, always `base` (every night is the same night), or
    drawn for every run.
    """

    rule: Literal["vary", "repeat"] = "vary"
    base: int = Field(0, ge=0, lt=2**47)

    @model_validator(mode="after")
    def _used(self) -> Self:
        if self.rule == "vary" and self.base:
            raise ValueError(f"base = {self.base} is used by the rule repeat only")
        return self


class Campaign(Document):
    """A campaign as data: its steps in order, their limits, and the rules for stopping before the last of them."""

    name: Name
    title: str = Field("", max_length=200, pattern=TEXT)
    description: str = Field("", max_length=4000, pattern=TEXT)
    steps: tuple[Step, ...] = Field(min_length=1, max_length=100)
    max_errors: int | None = Field(None, ge=1, le=100, description="stop once so many steps ended in error")
    window_h: float | None = Field(
        None, gt=0.0, le=8760.0, description="stop this long after the start; a plan that takes longer is refused"
    )
    labels: Labels = Field(default_factory=Labels, max_length=20)
    decision: DecisionRule = Field(default_factory=lambda: DecisionRule.model_validate({}))
    seeds: Seeds = Field(default_factory=lambda: Seeds.model_validate({}))
    priority: int = Field(10, ge=1, le=1000, description="priority of its jobs; smaller runs first")

    @model_validator(mode="after")
    def _names(self) -> Self:
        known: list[str] = []
        for index, step in enumerate(self.steps):
            if step.name in known:
                raise _fault(("steps", index, "name"), step.name, "each step needs a name of its own")
            for field in ("calibrations_of", "recordings_of"):
                for position, other in enumerate(getattr(step, field)):
                    if other not in known:
                        allowed = f"an earlier step is needed; there is {', '.join(known) or 'none'}"
                        raise _fault(("steps", index, field, position), other, allowed)
            for position, gate in enumerate(step.gates):
                if gate.step not in known:
                    allowed = f"an earlier step is needed; there is {', '.join(known) or 'none'}"
                    raise _fault(("steps", index, "gates", position, "step"), gate.step, allowed)
            known.append(step.name)
        return self

    def step(self, name: str) -> Step:
        """Return the step of that name. Raises `StopIteration` where the campaign has none."""
        return next(step for step in self.steps if step.name == name)


def _fault(where: tuple[str | int, ...], value: str, text: str) -> ValidationError:
    """Make a refusal of one field because of another part of the document."""
    error = PydanticCustomError("campaign", "{text}", {"text": text})
    return ValidationError.from_exception_data("Campaign", [InitErrorDetails(type=error, loc=where, input=value)])
