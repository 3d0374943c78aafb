"""Every analysis by way of the inspection: the one place where methods and procedures meet their recordings.

A recording is inspected while the analysis reads it. A refusal ends the analysis and names every station that is
refused; warnings come first in the result's own. Where there are outliers the analysis is made again without them.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from procedures.analysis.fitness.findings import Kind
from procedures.analysis.fitness.watched import Inspection, Watch
from procedures.analysis.measured_stations import at_measured_angles
from procedures.analysis.parts import cut
from procedures.core.errors import BadParameter, DomainError, MissingChannel, ProcedureDefect
from procedures.core.limits import BOUND_RULE, Check, OutcomeName, Verdict, decided, verdict
from procedures.core.recording import Recording
from procedures.core.unit import Unit
from procedures.parameters import DecisionRules
from procedures.procedure import (
    Context,
    Evidence,
    JudgedParameters,
    Method,
    P,
    Procedure,
    R,
    RecordedParameters,
    Statement,
)


def analyse_procedure(procedure: Procedure[P, R], recordings: Sequence[Recording], params: P, context: Context) -> R:
    """Return the result of `Procedure.analyse` on inspected recordings. Raises `DomainError`.

    Where the bench declares that its encoders are the better witness, the stations stand at the measured angles, and
    the first warning says so.
    """
    used, sentence = at_measured_angles(recordings) if context.bench.accuracy.measured else (recordings, "")
    outcome = _inspected(
        used, procedure.inspection(params), _checked(procedure, lambda r: procedure.analyse(r, params, context))
    )
    if sentence:
        outcome = outcome.model_copy(update={"warnings": (sentence, *outcome.warnings)})
    return judged(outcome, params)


def analyse_method(method: Method[P, R], evidence: Evidence, params: P, unit: Unit | None) -> R:
    """Return the result of `Method.analyse` on inspected recordings, or on the requested stretch of them. Raises
    `DomainError`. `unit`: the unit of the evidence with its current record; None for a method without one.
    """
    recordings = _stretches(evidence.recordings, params)

    def analyse(watched: Sequence[Recording]) -> R:
        return method.analyse(replace(evidence, recordings=tuple(watched)), params, unit)

    inspection = method.inspection(params, len(recordings))
    return judged(_inspected(recordings, inspection, _checked(method, analyse)), params)


def judged(outcome: R, params: object) -> R:
    """The outcome under the decision rules of its parameters: checks, verdict and statement of conformity.

    A rule can make a pass a fail, never the reverse; a verdict that is an error stays one. A rule for a check that the
    result does not have is a warning: where names are known beforehand it was refused.
    """
    given = params.decision if isinstance(params, JudgedParameters) else None
    rules = DecisionRules.model_validate({}) if given is None else given
    checks = tuple(decided(c, rules.of(c.name)) for c in outcome.checks)
    if not checks:
        return outcome
    final = outcome.verdict
    if final in (Verdict.PASS, verdict(outcome.checks)):
        final = verdict(checks)
    unused = [name for name in rules.by_check if name not in {c.name for c in checks}]
    warnings = tuple(f"the decision rule for {name!r} was not used: there is no such check" for name in unused)
    judged_by_checks = final is not Verdict.ERROR or verdict(checks) is Verdict.ERROR
    statement = _statement(checks, final, rules) if judged_by_checks else None
    changed = {"checks": checks, "verdict": final, "warnings": (*outcome.warnings, *warnings), "statement": statement}
    return outcome.model_copy(update=changed)


def _statement(checks: Sequence[Check], final: Verdict, rules: DecisionRules) -> Statement:
    """A pass is conditional where any value is near its limit, a fail where each value that fails is.

    It is inconclusive where no check fails and one decides nothing.
    """
    near = tuple(c.name for c in checks if c.decision is not None and c.decision.conditional)
    deciding = [c for c in checks if final is Verdict.PASS or not (c.passed or c.inconclusive)]
    sure = [c.decision is None or not c.decision.conditional for c in deciding]
    conditional = not all(sure) if final is Verdict.PASS else bool(deciding) and not any(sure)
    outcome: OutcomeName = "pass" if final is Verdict.PASS else "fail"
    if conditional:
        outcome = "conditional pass" if final is Verdict.PASS else "conditional fail"
    if final is Verdict.ERROR:
        outcome = "inconclusive"
    own = {BOUND_RULE if c.inconclusive else str(rules.of(c.name)) for c in checks if not c.significance}
    return Statement(outcome, "; ".join(sorted(own)) or "test of significance", near)


def _inspected(
    recordings: Sequence[Recording], inspection: Inspection, analyse: Callable[[Sequence[Recording]], R]
) -> R:
    mending = replace(inspection.settings, mends_outliers=True)
    watch = Watch(recordings, replace(inspection, settings=mending))
    outcome = _explained(watch, analyse)
    if watch.mend():
        outcome = _explained(watch, analyse)
    found = (*watch.warnings(), *outcome.warnings)
    return outcome.model_copy(update={"warnings": tuple(dict.fromkeys(found))})


def _checked(
    entry: Procedure[P, R] | Method[P, R], analyse: Callable[[Sequence[Recording]], R]
) -> Callable[[Sequence[Recording]], R]:
    """The analysis, which must give the result that its entry promises, and may not end the program."""

    def checked(recordings: Sequence[Recording]) -> R:
        try:
            outcome: object = analyse(recordings)
        except SystemExit as ended:
            raise ProcedureDefect(f"`analyse` of {entry.name} would end the program with {ended!r}") from ended
        if not isinstance(outcome, entry.result):
            given = type(outcome).__name__
            raise ProcedureDefect(f"`analyse` of {entry.name} gave a {given}, not its {entry.result.__name__}")
        return outcome

    return checked


def _explained(watch: Watch, analyse: Callable[[Sequence[Recording]], R]) -> R:
    """Run the analysis. Where it fails on a recording that is to be refused, the refusal is raised instead, except for
    too few samples: the analysis knows better how many it needs."""
    try:
        return analyse(watch.recordings)
    except (BadParameter, MissingChannel):
        raise
    except (DomainError, ArithmeticError, ValueError):
        watch.refuse(but=Kind.TOO_FEW)
        raise


def _stretches(recordings: Sequence[Recording], params: object) -> tuple[Recording, ...]:
    if not isinstance(params, RecordedParameters):
        return tuple(recordings)
    starts = _each(recordings, "start_s", params.start_s)
    stops = _each(recordings, "stop_s", params.stop_s)
    return tuple(cut(r, start, stop) for r, start, stop in zip(recordings, starts, stops, strict=True))


def _each(
    recordings: Sequence[Recording], field: str, given: float | tuple[float, ...] | None
) -> tuple[float | None, ...]:
    """Expand to one value for each recording. Raises `BadParameter`."""
    if not isinstance(given, tuple):
        return (given,) * len(recordings)
    if len(given) != len(recordings):
        raise BadParameter(field, len(given), f"one number, or one for each of the {len(recordings)} recordings")
    return given
