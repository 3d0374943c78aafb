"""Measured values against requirements, and the verdict over all checks."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from math import isfinite

from procedures.core.decision import Decision, Rule, decide, inside


class Verdict(StrEnum):
    """Verdict of a finished job on its unit."""

    PASS = "pass"
    FAIL = "fail"
    ERROR = "error"


@dataclass(frozen=True)
class Limit:
    """A requirement on one value, inclusive at both ends, and where it comes from."""

    unit: str
    maximum: float | None = None
    minimum: float | None = None
    source: str = ""


def bounds(minimum: float | None, maximum: float | None, unit: str) -> str:
    """Format the requirement for a reader: ≥ 1 and ≤ 2 deg/h."""
    found = [f"≥ {minimum:g}"] if minimum is not None else []
    found += [f"≤ {maximum:g}"] if maximum is not None else []
    return f"{' and '.join(found)} {unit}"


@dataclass(frozen=True)
class Check:
    """Check of one value against one limit."""

    name: str
    value: float
    limit: Limit
    passed: bool
    standard_uncertainty: float | None = None
    note: str = ""
    degrees_of_freedom: float | None = None
    """Degrees of freedom of the standard uncertainty; None: so many that they do not count."""
    decision: Decision | None = None
    """Rule by which it was decided, and the expanded uncertainty; None in results of versions before it."""
    significance: bool = False
    """True for a test of significance: the value is a p-value and the limit its level."""


@dataclass(frozen=True)
class PlannedCheck:
    """A check that a result will have, and how well the plan measures its value; for decisions before a job.

    The value is an estimate with Gaussian errors, or a root mean square of so many degrees of freedom, as a sample
    standard deviation or a noise coefficient is: then ``value² = (true² + u²)·χ²/ν``.
    """

    check: str
    limit: Limit
    standard_uncertainty: float | None = None
    """Standard uncertainty of the value by the plan, in the limit's unit; of a root mean square the part u of the
    measurement. None: not predicted."""
    degrees_of_freedom: float | None = None
    """Degrees of freedom ν of a root mean square; None: an estimate."""
    expected: float | None = None
    """Value to expect of this unit by its record, without the measurement's part; None: not known."""
    level: float | None = None
    """Of a test of significance: chance that a sound unit fails it."""


def check(
    name: str,
    value: float,
    limit: Limit,
    standard_uncertainty: float | None = None,
    note: str = "",
    degrees_of_freedom: float | None = None,
) -> Check:
    """Compare a value with its limit by simple acceptance. A value that is not finite never passes."""
    passed = (
        isfinite(value)
        and (limit.maximum is None or value <= limit.maximum)
        and (limit.minimum is None or value >= limit.minimum)
    )
    return Check(name, value, limit, passed, standard_uncertainty, note, degrees_of_freedom)


def significance(name: str, p_value: float, level: float, note: str = "", source: str = "") -> Check:
    """Test of significance at a level: fails where the p-value is below it. Such a value has no uncertainty."""
    limit = Limit("1", minimum=level, source=source or "ours: a test of significance")
    return replace(check(name, p_value, limit, note=note), significance=True)


def decided(made: Check, rule: Rule) -> Check:
    """The check under a decision rule, which can make a pass a fail, never the reverse."""
    if made.significance:
        outcome = "pass" if made.passed else "fail"
        return replace(made, decision=Decision(f"test of significance at {made.limit.minimum or 0.0:g}", outcome))
    distance = inside(made.value, made.limit.minimum, made.limit.maximum)
    found = decide(distance, made.passed, made.standard_uncertainty, made.degrees_of_freedom, rule)
    return replace(made, passed=found.outcome.endswith("pass"), decision=found)


def verdict(checks: Iterable[Check]) -> Verdict:
    """Pass where every check passed; no check at all is an error: nothing was judged."""
    outcomes = [c.passed for c in checks]
    if not outcomes:
        return Verdict.ERROR
    return Verdict.PASS if all(outcomes) else Verdict.FAIL
