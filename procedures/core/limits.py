"""Measured values against requirements, the decision rule between them, and the verdict over all checks.

``U = k·u`` is the expanded uncertainty, k Student's factor of the value's degrees of freedom. Simple acceptance passes
a value at its limit; guarded acceptance wants it inside by the guard band ``w = r·U``. A pass or a fail is conditional
where the value lies within U of the limit (ISO/IEC 17025, 7.8.6; ILAC-G8). A value that is only an upper bound of what
was not observed passes inside its limit; outside it is inconclusive: what it bounds may be on either side.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from math import inf, isfinite
from typing import Literal

from procedures.importing import IMPORTING

RuleName = Literal["simple", "guarded"]
OutcomeName = Literal["pass", "conditional pass", "conditional fail", "fail", "inconclusive"]
OURS, SIGNIFICANCE, ASKED = "ours", "ours: a test of significance", "the request"
"""Sources of limits that no document gives: this program's own, its level of a test, one that a request gave."""
BOUND_RULE = "an upper bound of what was not observed: it passes within the limit, and decides nothing outside"
COVERAGE = 0.9545
"""Coverage probability without another wish: k = 2 of a normal distribution."""


@dataclass(frozen=True)
class Rule:
    """Decision rule of one limit: simple or guarded acceptance, guard band, coverage."""

    name: RuleName = "simple"
    guard: float = 1.0
    """Factor r of the guard band r·U; of the guarded rule alone."""
    coverage_probability: float = COVERAGE
    coverage_factor: float | None = None
    """Factor k where it is given; None: of the coverage probability and the degrees of freedom."""

    def __str__(self) -> str:
        return "simple acceptance" if self.name == "simple" else f"guard band of {self.guard:g}·U"


@dataclass(frozen=True)
class Decision:
    """Record of how one value was decided: rule, outcome, expanded uncertainty, guard band."""

    rule: str
    """Rule in words; a test of significance is held at its level, without a guard band."""
    outcome: OutcomeName
    expanded_uncertainty: float | None = None
    """Expanded uncertainty U in the limit's unit; None: the value has no stated uncertainty."""
    coverage_factor: float | None = None
    coverage_probability: float | None = None
    degrees_of_freedom: float | None = None
    """Degrees of freedom of u; None: so many that they do not count, or no uncertainty."""
    guard_band: float = 0.0
    """Guard band w in the limit's unit."""

    @property
    def conditional(self) -> bool:
        """True where the value lies within its expanded uncertainty of the limit."""
        return self.outcome.startswith("conditional")

    @property
    def sentence(self) -> str:
        """Sentence on the decision for a reader: rule, U with its factor and degrees of freedom, outcome."""
        if self.expanded_uncertainty is None:
            return f"{self.rule}: {self.outcome}"
        freedom = "" if self.degrees_of_freedom is None else f", ν = {self.degrees_of_freedom:.3g}"
        band = "" if self.guard_band == 0.0 else f", w = {self.guard_band:.3g}"
        factor = "" if self.coverage_factor is None else f" (k = {self.coverage_factor:.3g}{freedom})"
        return f"{self.rule}{band}, U = {self.expanded_uncertainty:.3g}{factor}: {self.outcome}"


def coverage_factor(probability: float, degrees_of_freedom: float | None) -> float:
    """Return Student's factor k of a two-sided interval (JCGM 100, G.3); None: infinitely many, the normal one."""
    with IMPORTING:
        from scipy.special import ndtri, stdtrit  # a start does without it

    tail = 0.5 * (1.0 + probability)
    if degrees_of_freedom is None or not isfinite(degrees_of_freedom):
        return float(ndtri(tail))
    return float(stdtrit(max(1.0, degrees_of_freedom), tail))


def combined_freedom(parts: list[tuple[float, float | None]]) -> float | None:
    """Effective degrees of freedom of a root of a sum of squares, ``ν = u⁴/Σ(u_i⁴/ν_i)`` (JCGM 100, G.4.1).

    `parts`: contribution u_i and its degrees of freedom, None for infinite. None where all are infinite.
    """
    total = sum(part**2 for part, _ in parts) ** 2
    below = sum(part**4 / freedom for part, freedom in parts if freedom is not None and isfinite(freedom))
    return None if below == 0.0 else total / below


def inside(value: float, minimum: float | None, maximum: float | None) -> float:
    """Return the distance of a value from the nearer limit; negative outside, and for no finite value. A limit that is
    None does not exist.
    """
    below = inf if maximum is None else maximum - value
    above = inf if minimum is None else value - minimum
    found = min(below, above)
    return -inf if found != found or not isfinite(value) else found


def decide(distance: float, passed: bool, u: float | None, degrees_of_freedom: float | None, rule: Rule) -> Decision:
    """Return the decision on a value `distance` inside its limit, `passed` by simple acceptance, of standard
    uncertainty u.

    A value without a known uncertainty is accepted simply under either rule, and the decision says so.
    """
    if u is None:
        told = "simple acceptance" if rule.name == "simple" else f"{rule}, without effect"
        return Decision(f"{told} (the value has no stated uncertainty)", "pass" if passed else "fail")
    k = coverage_factor(rule.coverage_probability, degrees_of_freedom)
    k = k if rule.coverage_factor is None else rule.coverage_factor
    expanded = k * u
    band = rule.guard * expanded if rule.name == "guarded" else 0.0
    accepted = passed and distance >= band
    near = abs(distance) < expanded
    outcome: OutcomeName = "pass" if accepted else "fail"
    if near:
        outcome = "conditional pass" if accepted else "conditional fail"
    return Decision(str(rule), outcome, expanded, k, rule.coverage_probability, degrees_of_freedom, band)


class Verdict(StrEnum):
    """Verdict of a finished job on its unit: pass, fail, or error where nothing could be judged."""

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
    """Return the requirement as text for a reader: ≥ 1 and ≤ 2 deg/h. A limit that is None is left out."""
    found = [f"≥ {minimum:g}"] if minimum is not None else []
    found += [f"≤ {maximum:g}"] if maximum is not None else []
    return f"{' and '.join(found)} {unit}"


@dataclass(frozen=True)
class Check:
    """Check of one value against one limit: passed or not, with its uncertainty and the decision."""

    name: str
    value: float | None
    """Value in the limit's unit; None: an upper bound that is infinite, as nothing bounds what was not observed."""
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
    bound: bool = False
    """True: nothing was observed, and the value is what it stays below; a value of None: it is unbounded."""

    @property
    def inconclusive(self) -> bool:
        """True for an upper bound outside its limit: no pass, and no evidence of a fail."""
        return self.bound and not self.passed


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
    """Level of a test of significance: the chance that a sound unit fails it."""


def check(
    name: str,
    value: float,
    limit: Limit,
    standard_uncertainty: float | None = None,
    note: str = "",
    degrees_of_freedom: float | None = None,
    bound: bool = False,
) -> Check:
    """Return the check of a value against its limit by simple acceptance. A value that is not finite never passes.

    `bound`: nothing was observed, and the value is what it stays below; one of infinity becomes None, unbounded.
    `standard_uncertainty` None: not known; `degrees_of_freedom` None: infinitely many.
    """
    passed = (
        isfinite(value)
        and (limit.maximum is None or value <= limit.maximum)
        and (limit.minimum is None or value >= limit.minimum)
    )
    held = None if bound and value == inf else value
    return Check(name, held, limit, passed, standard_uncertainty, note, degrees_of_freedom, bound=bound)


def upper_bound(name: str, bound: float, limit: Limit, reason: str = "not observed") -> Check:
    """Return the check of what was not observed, by the value that it stays below; infinity: unbounded."""
    told = "unbounded, nothing limits it from above" if bound == inf else "the value is what it stays below"
    return check(name, bound, limit, note=f"{reason}: {told}", bound=True)


def asked_limit(unit: str, maximum: float, default: float, source: str) -> Limit:
    """Return a largest value with its source: that of the default, unless the request gave another value."""
    return Limit(unit, maximum=maximum, source=source_of(maximum, default, source))


def source_of(value: object, default: object, source: str) -> str:
    """Return the source of a limit: that of the default, unless the request gave another value."""
    return source if value == default else ASKED


def significance(name: str, p_value: float, level: float, note: str = "", source: str = "") -> Check:
    """Return the check of a test of significance at a level: it fails where the p-value is below it. Such a value has
    no uncertainty.
    """
    limit = Limit("1", minimum=level, source=source or SIGNIFICANCE)
    return replace(check(name, p_value, limit, note=note), significance=True)


def decided(made: Check, rule: Rule) -> Check:
    """Return the check under a decision rule, which can make a pass a fail, never the reverse."""
    if made.bound:
        return replace(made, decision=Decision(BOUND_RULE, "pass" if made.passed else "inconclusive"))
    if made.significance:
        outcome = "pass" if made.passed else "fail"
        return replace(made, decision=Decision(f"test of significance at {made.limit.minimum or 0.0:g}", outcome))
    distance = -inf if made.value is None else inside(made.value, made.limit.minimum, made.limit.maximum)
    found = decide(distance, made.passed, made.standard_uncertainty, made.degrees_of_freedom, rule)
    return replace(made, passed=found.outcome.endswith("pass"), decision=found)


def verdict(checks: Iterable[Check]) -> Verdict:
    """Return the verdict over all checks: pass where every one passed, fail where one failed, else error: a check is
    inconclusive, or there is none.
    """
    made = tuple(checks)
    if any(not c.passed and not c.inconclusive for c in made):
        return Verdict.FAIL
    return Verdict.PASS if made and all(c.passed for c in made) else Verdict.ERROR
