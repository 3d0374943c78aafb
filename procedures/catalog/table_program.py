"""Position program of the table's controller, with a recording at every dwell (thesis appendix Д).

The program is text in the controller's language, or a list of positions that is written as one. Nothing is judged but
that every dwell was recorded whole: the meaning of the means is left to an analysis or a person.
"""

from collections.abc import AsyncIterator, Sequence
from dataclasses import replace
from math import floor
from typing import Annotated, Literal

from pydantic import Field

from procedures import steps
from procedures.analysis.calibration.station_plan import move_time_s, windows
from procedures.analysis.table_program.dialect import AXES, DELAY_MAX_S, Dwell, read_program, refusal
from procedures.analysis.table_program.recorded import DwellRecord, dwell_records, mean_sd
from procedures.analysis.table_program.writing import THESIS_POSITIONS, dwells_at, write_program
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core import units
from procedures.core.errors import BadParameter
from procedures.core.limits import Check, Limit, check, verdict
from procedures.core.recording import Recording, Station
from procedures.core.report import Report, Table
from procedures.core.table_angles import TableAngles
from procedures.procedure import STATIONS, Context, Outcome, Parameters, PredictedUncertainty, Prediction, Procedure

SHORTEST_S = 1.0
"""Least recording of a dwell."""
GRAIN_S = 0.1
"""Recordings are whole multiples of it, so that a station's length is a round number."""

Axis = Literal["inner", "middle", "outer"]
Angle = Annotated[float, Field(ge=-3600.0, le=3600.0)]
Delay = Annotated[float, Field(gt=0.0, le=DELAY_MAX_S)]
Rate = Annotated[float, Field(gt=0.0, le=1e5)]


class Params(Parameters):
    """Program as text or as positions, and the timing of its delays. Neither: the thesis's own program."""

    program: str | None = Field(
        None,
        max_length=50_000,
        description="text: ':mode:position all', ':demand:position 1,deg; p 2,deg; p 3,deg', 'delay s', '% comment'; "
        "axes as in `axes`",
    )
    axes: tuple[Axis, Axis, Axis] = Field(
        AXES, description="axes 1, 2 and 3 of a program's text; the thesis does not name those of its own program"
    )
    positions: tuple[tuple[Angle, Angle, Angle, Delay], ...] | None = Field(
        None,
        min_length=1,
        max_length=500,
        description="(outer, middle, inner) [deg] and delay [s], written as a program; not together with `program`",
    )
    delay_from: Literal["demand", "rest"] = Field(
        "demand",
        description="demand: a delay holds the move and the settling, as on the controller, and the rest of it is "
        "recorded; rest: the whole delay is recorded, after them",
    )
    settle_s: float = Field(2.0, ge=0.0, le=3600.0, description="from standing still to the first sample")
    axis_motion: tuple[tuple[Rate, Rate], tuple[Rate, Rate], tuple[Rate, Rate]] | None = Field(
        None, description="rate [deg/s] and acceleration [deg/s²] of outer, middle, inner axis; None: the bench's"
    )


class Result(Outcome):
    """Program as it was read, and the means of every dwell's recording."""

    program: str
    dwells: tuple[DwellRecord, ...]


def resolve(params: Params, context: Context) -> Params:
    """Return the parameters with the program from the positions or the thesis, and the axes' motion from the bench.
    Raises `BadParameter`.
    """
    if params.program is not None and params.positions is not None:
        raise BadParameter("positions", len(params.positions), "not together with a program: give one of the two")
    if len(set(params.axes)) < len(params.axes):
        raise BadParameter("axes", list(params.axes), "each of inner, middle and outer once")
    given = params.positions
    text = write_program(dwells_at(THESIS_POSITIONS)) if given is None else write_program(dwells_at(given), params.axes)
    outer, middle, inner = context.bench.axis_motion
    filled = params.filled({"program": text, "axis_motion": (outer, middle, inner)})
    return filled.model_copy(update={"positions": None})


def schedule(params: Params) -> tuple[Station, ...]:
    """Return the stations of the program, one a dwell, in order, labelled by the program's line. The table starts from
    its zero.

    Raises `BadParameter` "program" for a line outside the dialect, and for a delay that moving and settling use up.
    """
    at, stations = TableAngles(), list[Station]()
    for i, dwell in enumerate(_dwells(params)):
        recorded = _recorded_s(dwell, 0.0 if params.delay_from == "rest" else _used_s(dwell, at, params))
        a = dwell.angles
        label = f"line {dwell.line}: outer={a.outer_deg:g} middle={a.middle_deg:g} inner={a.inner_deg:g}"
        stations.append(Station(i, label, a, None, params.settle_s, recorded))
        at = dwell.angles
    return tuple(stations)


def predict(params: Params, context: Context) -> Prediction:
    """Return duration, and the standard uncertainty of each channel's mean over the shortest dwell."""
    params = resolve(params, context)
    stations = schedule(params)
    spans = windows(stations, context.bench.axis_motion)
    shortest = min(range(len(stations)), key=lambda i: stations[i].record_s)
    found: list[PredictedUncertainty] = []
    unknown: list[str] = []
    for channel in context.unit.channels:
        noise = context.unit.channel_noise(channel)
        if noise is None:
            unknown.append(channel.name)
            continue
        sd = mean_sd(noise, *spans[shortest].tolist())
        name = f"{channel.name}.mean over {stations[shortest].record_s:g} s, the shortest dwell"
        found.append(PredictedUncertainty(name, channel.rate_unit, sd, sd))
    warnings = (_unknown(unknown),) if unknown else ()
    basis = "the unit's noise as declared or last found" if found else ""
    return Prediction(float(spans[-1, 1]), tuple(found), warnings, basis)


async def acquire(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    """Move, settle, record, dwell after dwell; yield the stream of each."""
    for station in stations:
        yield await steps.record_station(bench, station)


def analyse(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    """Return the means of every channel at every dwell. Raises `UnfitRecording` where the recordings are of another
    program.
    """
    params = resolve(params, context)
    dwells = dwell_records(recordings, schedule(params), context.unit)
    checks = tuple(_whole(d) for d in dwells)
    unknown = [m.channel for m in dwells[0].means if not m.from_noise]
    warnings = (_unknown(unknown),) if unknown else ()
    program = write_program(_dwells(params), params.axes)
    return Result(checks=checks, verdict=verdict(checks), warnings=warnings, program=program, dwells=dwells)


def report(result: Result) -> Report:
    """Return the report: every channel's mean, a row a dwell, and a table of the standard uncertainties."""
    names = [(m.channel, *units.DISPLAY.get(m.unit, (m.unit, 1.0))) for m in result.dwells[0].means]
    columns = ("dwell", *(f"{name}, {unit}" for name, unit, _ in names))
    means = tuple(
        (d.label, *(m.mean / size for m, (_, _, size) in zip(d.means, names, strict=True))) for d in result.dwells
    )
    sds = tuple(
        (
            d.label,
            *(
                None if m.standard_uncertainty is None else m.standard_uncertainty / size
                for m, (_, _, size) in zip(d.means, names, strict=True)
            ),
        )
        for d in result.dwells
    )
    places = tuple(
        (d.label, d.outer_deg, d.middle_deg, d.inner_deg, d.start_s, d.samples_planned, d.samples_recorded)
        for d in result.dwells
    )
    where = ("dwell", "outer, deg", "middle, deg", "inner, deg", "start, s", "samples planned", "recorded")
    summary = f"{len(result.dwells)} dwells of the program were recorded; nothing else is judged."
    note = "Of the noise of the unit where it is known, else of the scatter within the dwell."
    return Report(
        summary,
        (
            Table("Mean outputs", columns, means),
            Table("Standard uncertainties of the means", columns, sds, note),
            Table("Dwells", where, places),
        ),
    )


def _dwells(params: Params) -> tuple[Dwell, ...]:
    if params.program is None:
        raise BadParameter("program", None, "resolve the parameters first: the program is written from the positions")
    return read_program(params.program, params.axes)


def _used_s(dwell: Dwell, at: TableAngles, params: Params) -> float:
    """Time of a delay used before the recording: the least time to move, and the settling [s]."""
    if params.axis_motion is None:
        raise BadParameter(
            "axis_motion", None, "resolve the parameters first: the rates of the axes come from the bench"
        )
    return move_time_s(at, dwell.angles, params.axis_motion) + params.settle_s


def _recorded_s(dwell: Dwell, used_s: float) -> float:
    """Time of a delay left for the recording [s]. Raises `BadParameter` where hardly anything is left."""
    left = GRAIN_S * floor((dwell.delay_s - used_s) / GRAIN_S + 1e-6) if used_s > 0.0 else dwell.delay_s
    if left < SHORTEST_S:
        expected = f"a delay of at least {used_s + SHORTEST_S:.3g} s, of which moving and settling take {used_s:.3g} s"
        raise refusal(dwell.line, f"delay {dwell.delay_s:g}", expected)
    return round(left, 6)


def _whole(d: DwellRecord) -> Check:
    planned = float(d.samples_planned)
    limit = Limit("samples", planned, planned, source="the program's delay")
    return check(f"{d.label}: samples recorded", float(d.samples_recorded), limit)


def _unknown(channels: Sequence[str]) -> str:
    return (
        f"the noise of {', '.join(channels)} is not known: the uncertainty of a mean comes from the scatter within its "
        "dwell, which does not show noise slower than that"
    )


PROCEDURE = Procedure(
    "table_program",
    "Program of table positions",
    "2.1.0",
    Params,
    Result,
    resolve,
    schedule,
    predict,
    acquire,
    analyse,
    report,
    inspection=lambda _: replace(STATIONS, temperatures=True),
)
