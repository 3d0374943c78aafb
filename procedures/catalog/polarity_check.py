"""Polarity check, the first and cheapest test of a unit: each axis is turned and tilted once.

Each axis of the unit points upwards in turn, is turned once by 360° about the vertical, and rests. A minute and a half
tells exchanged, reversed and dead channels before hours are spent on a calibration that would only misfit.
"""

from collections.abc import AsyncIterator, Sequence

from pydantic import Field

from procedures import steps
from procedures.analysis.calibration.reference import TRIAD_NAMES
from procedures.analysis.calibration.station_plan import windows
from procedures.analysis.own_axes import wrong_axes
from procedures.analysis.turns.plan import UPRIGHT
from procedures.analysis.turns.polarity import Answers, answers, sentences
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core.errors import BadParameter
from procedures.core.limits import ASKED, OURS, Check, Limit, PlannedCheck, check, verdict
from procedures.core.recording import ACCELEROMETER, AXES, GYRO, TRIADS, Recording, Station
from procedures.core.report import Report, Table
from procedures.core.turn import Turn
from procedures.parameters import largest
from procedures.procedure import Context, JudgedParameters, Outcome, Parameters, Prediction, Procedure
from procedures.table_motion import default_ramp_s, require_possible, require_rest, rest_with_demands

REST_S = 4.0
"""Rest at the end of a recording where the table's demands take no time [s]."""
ACCELERATION_SHARE = 0.5
"""Share of the outer axis' acceleration that the ramps use."""


class Limits(Parameters):
    """Requirements on the answers of a unit that is not calibrated yet (this program's own)."""

    own_min: float = Field(0.5, gt=0.0, le=1.0, description="answer of a channel to its own axis; 1 is nominal")
    own_max: float = Field(1.5, ge=1.0, le=10.0, description="not judged for channels in counts")
    other_max: float = Field(0.2, gt=0.0, le=1.0, description="magnitude of its answers to the other axes")


class Params(JudgedParameters):
    """Rate of the turn and the rest after it. None takes the bench's value."""

    rate_deg_s: float = Field(30.0, ge=1.0, le=360.0)
    ramp_s: float | None = Field(None, gt=0.0, le=60.0, description="None: half of the outer axis' acceleration")
    rest_s: float | None = Field(
        None, ge=1.0, le=600.0, description="at the end of each recording; None: 4 s, and what the table's demands take"
    )
    settle_s: float = Field(2.0, ge=0.0, le=3600.0)
    limits: Limits = Field(default_factory=lambda: Limits.model_validate({}))


class Result(Outcome):
    """Answers of both triads to the three axes, and in words what is wrong."""

    triads: tuple[Answers, ...]
    sentences: tuple[str, ...]


def resolve(params: Params, context: Context) -> Params:
    """Return the parameters with the ramp from the outer axis' acceleration, and the rest from the table's demands: its
    last half is at rest.
    """
    ramp_s = default_ramp_s(params.rate_deg_s, context.bench, ACCELERATION_SHARE)
    rest_s = rest_with_demands(REST_S, context.bench, turns=2)
    return params.filled({"ramp_s": ramp_s, "rest_s": rest_s})


def schedule(params: Params) -> tuple[Station, ...]:
    """Return the stations: axis x, y, z upwards, one turn each. Raises `BadParameter` where the rate would not be
    reached.
    """
    turn = _turn(params)
    if params.rest_s is None:
        raise BadParameter("rest_s", None, "resolve the parameters first: the rest comes from the bench")
    return tuple(
        Station(i, f"{axis} up, one turn", angles, None, params.settle_s, turn.duration_s + params.rest_s, turn=turn)
        for i, (axis, angles) in enumerate(UPRIGHT.items())
    )


def predict(params: Params, context: Context) -> Prediction:
    """Return the duration. Raises `BadParameter` where the table cannot turn so."""
    params = resolve(params, context)
    stations = schedule(params)
    require_rest("rest_s", params.rest_s, context.bench, turns=2)
    require_possible("rate_deg_s", params.rate_deg_s, stations, context.bench)
    basis = "answers are judged by tenths: noise and uncalibrated scale factors do not count"
    return Prediction(float(windows(stations, context.bench.axis_motion)[-1, 1]), basis=basis)


async def acquire(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    """Move, settle, record while the table turns once and rests, axis after axis; yield the stream of each."""
    for station in stations:
        yield await steps.record_turn(bench, station)


def analyse(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    """Return the answers of each channel to each axis, and what they mean. Raises `UnfitRecording`,
    `MissingChannel`.
    """
    turned_s, gravity = _turn(resolve(params, context)).duration_s, context.bench.site.gravity_m_s2
    found = tuple(answers(recordings, triad, turned_s, gravity) for triad in TRIAD_NAMES)
    said, checks = sentences(found), tuple(c for a in found for c in _checks(a, params.limits))
    return Result(checks=checks, verdict=verdict(checks), warnings=said, triads=found, sentences=said)


def quantities(_params: Params, _context: Context) -> tuple[str, ...]:
    """Return the names of the checks that a result will have."""
    return tuple(f"{name}: {what}" for triad in TRIAD_NAMES for name in TRIADS[triad] for what in (OWN, OTHERS))


def report(result: Result) -> Report:
    """Return the report: the answers of every channel to every axis."""
    rows = tuple(
        (name, axis, *row)
        for a in result.triads
        for name, axis, row in zip(TRIADS[a.triad], a.axes, a.matrix, strict=True)
    )
    note = (
        "1: nominal. Gyros: turned angle over 360°; accelerometers: output over gravity. In counts: over the largest."
    )
    table = Table("Answers to each axis", ("channel", "answers to", *(f"axis {a}" for a in AXES)), rows, note)
    return Report(" ".join(f"{s}." for s in result.sentences) or "Every channel answers to its own axis.", (table,))


OWN, OTHERS = "answer to its own axis", "largest answer to another axis"


def _turn(params: Params) -> Turn:
    if params.ramp_s is None:
        raise BadParameter("ramp_s", None, "resolve the parameters first: the ramp comes from the bench")
    try:
        return Turn("outer", 1, params.rate_deg_s, params.ramp_s)
    except ValueError as refusal:
        raise BadParameter("ramp_s", params.ramp_s, str(refusal)) from refusal


def _limits(limits: Limits, relative: bool) -> tuple[Limit, Limit]:
    """Limits of a channel's answer to its own axis and to others; `relative`: of one in counts."""
    most = None if relative else limits.own_max
    asked = ASKED in (limits.source_of("own_min"), OURS if relative else limits.source_of("own_max"))
    own = Limit("1", most, limits.own_min, source=ASKED if asked else OURS)
    return own, largest(limits, "other_max", "1")


def planned_checks(params: Params, context: Context) -> tuple[PlannedCheck, ...]:
    """Return the planned checks of every channel: answers of 1 to its own axis and of 0 to others are nominal."""
    made: list[PlannedCheck] = []
    for channel in (c for c in context.unit.channels if c.name in GYRO + ACCELEROMETER):
        own, other = _limits(params.limits, channel.rate_unit == "count")
        made += (PlannedCheck(f"{channel.name}: {OWN}", own), PlannedCheck(f"{channel.name}: {OTHERS}", other))
    return tuple(made)


def _checks(found: Answers, limits: Limits) -> list[Check]:
    own, other = _limits(limits, found.relative)
    wrong = wrong_axes(found.triad, found.axes)
    made: list[Check] = []
    for i, (name, axis, row) in enumerate(zip(TRIADS[found.triad], found.axes, found.matrix, strict=True)):
        note = f"answers to {axis}" + (f"; {wrong}" if wrong and axis != f"+{AXES[i]}" else "")
        made.append(check(f"{name}: {OWN}", row[i], own, note=note))
        made.append(check(f"{name}: {OTHERS}", max(abs(v) for k, v in enumerate(row) if k != i), other, note=note))
    return made


PROCEDURE = Procedure(
    "polarity_check",
    "Polarity check of both triads",
    "1.1.0",
    Params,
    Result,
    resolve,
    schedule,
    predict,
    acquire,
    analyse,
    report,
    quantities=quantities,
    planned_checks=planned_checks,
)
