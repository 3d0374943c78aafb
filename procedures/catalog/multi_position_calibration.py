"""Bench calibration in any set of table positions, listed or read from a program of the table's controller.

The thesis's appendix moves the table through fourteen rests by such a program and calibrates from the means; so does
this procedure by default. Positions are (outer, middle, inner) angles of the table, not the (β, γ) of thesis 5.1.
"""

from collections.abc import AsyncIterator, Sequence
from typing import Annotated

from pydantic import Field

from procedures import multi_position, steps
from procedures.analysis.calibration.plan import TriadPlan, basis, triad_plan
from procedures.analysis.calibration.station_plan import windows
from procedures.analysis.table_program.dialect import read_program
from procedures.analysis.table_program.writing import THESIS_POSITIONS
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core.errors import BadParameter
from procedures.core.limits import PlannedCheck
from procedures.core.recording import Recording, Station
from procedures.core.table_angles import TableAngles
from procedures.dwells import DwellParameters, expected_stations
from procedures.multi_position import FitParameters, Inputs, Result
from procedures.parameters import SupplyParameters, largest
from procedures.procedure import Context, Prediction, Procedure
from procedures.site_parameters import TableParameters, declared_table

Angle = Annotated[float, Field(ge=-3600.0, le=3600.0)]
FOURTEEN = tuple(position[:3] for position in THESIS_POSITIONS[1:-1])
"""The rests of the thesis's program (appendix Д) without the home position at its beginning and end."""


class Params(FitParameters, TableParameters, DwellParameters, SupplyParameters):
    """Positions, dwell, site and fit; None takes the unit's or the bench's value, or the thesis's positions."""

    positions: tuple[tuple[Angle, Angle, Angle], ...] | None = Field(
        None,
        min_length=1,
        max_length=500,
        description="(outer, middle, inner) [deg], in order; not together with `program`",
    )
    program: str | None = Field(
        None,
        max_length=50_000,
        description="text in the controller's language, as `table_program` reads it; its delays "
        "are the dwells where `dwell_s` is not given",
    )
    dwell_s: float | None = Field(None, ge=1.0, le=86_400.0, description="None: the program's, or the averaging time")
    settle_s: float = Field(2.0, ge=0.0, le=3600.0)


def resolve(params: Params, context: Context) -> Params:
    """Return the parameters with the thesis's positions where none are given, the dwell from the unit, site and table
    from the bench. Raises `BadParameter`.
    """
    if params.program is not None and params.positions is not None:
        raise BadParameter("positions", len(params.positions), "not together with a program: give one of the two")
    own = {"positions": FOURTEEN} if params.program is None else {}
    dwell = {} if params.program is not None else {"dwell_s": context.unit.averaging_time_s}
    full = params.filled({**own, **dwell, **declared_table(context)})
    full.require_sources(context, corrected=False)
    return full.with_rule(context.unit)


def schedule(params: Params) -> tuple[Station, ...]:
    """Return the stations, one a position, in order. Raises `BadParameter` for a line outside the program's
    language.
    """
    if params.program is not None:
        rests = [(d.angles, params.dwell_s or d.delay_s) for d in read_program(params.program)]
    elif params.positions is None or params.dwell_s is None:
        raise BadParameter("dwell_s", None, "resolve the parameters first: positions and dwell have defaults")
    else:
        rests = [(TableAngles(*position), params.dwell_s) for position in params.positions]
    return tuple(
        Station(
            i,
            f"outer={a.outer_deg:g} middle={a.middle_deg:g} inner={a.inner_deg:g}",
            a,
            None,
            params.settle_s,
            dwell_s,
            until=params.until,
            supply_voltage_v=params.supply_voltage_v,
        )
        for i, (a, dwell_s) in enumerate(rests)
    )


def predict(params: Params, context: Context) -> Prediction:
    """Return duration and the uncertainty of every coefficient. Raises `Undetermined` saying which position to add."""
    params = resolve(params, context)
    stations = schedule(params)
    for triad, inputs in _inputs(params, context).items():
        multi_position.require_determined(params, triad, inputs)
    plans = [_plan(triad, params, context) for triad in params.triads]
    uncertainties = tuple(u for plan in plans for u in multi_position.predicted(plan))
    terms = ("the predicted uncertainties are without the further terms, which take some from b and K",)
    duration_s = float(windows(expected_stations(stations), context.bench.axis_motion)[-1, 1])
    warnings = (terms if params.terms else ()) + params.dwell_warnings(stations)
    return Prediction(duration_s, uncertainties, warnings, basis(plans) if uncertainties else "")


async def acquire(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    """Move, settle, record, position after position; yield the stream of each."""
    for station in stations:
        yield await steps.record_station(bench, station)


def analyse(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    """Return the calibration by least squares over the means of the positions. Raises `UnfitRecording`,
    `Undetermined`.
    """
    params = resolve(params, context)
    return multi_position.calibrated(recordings, params, _inputs(params, context), context.unit)


def _inputs(params: Params, context: Context) -> dict[str, Inputs]:
    site = params.site(context)
    angles = [s.angles for s in schedule(params) if s.angles is not None]
    return multi_position.inputs_at(params.triads, angles, site, params.table(site))


def _plan(triad: str, params: Params, context: Context) -> TriadPlan:
    site, stations = params.site(context), expected_stations(schedule(params))
    return triad_plan(
        triad, context.unit, stations, context.bench.axis_motion, site, params.table(site), params.weighting
    )


def planned_checks(params: Params, context: Context) -> tuple[PlannedCheck, ...]:
    """Return the planned checks of each triad: its design's condition number, and its residuals."""
    params = resolve(params, context)
    limit = largest(params, "condition_max", "1")
    conditions = [PlannedCheck(f"{triad} condition number", limit) for triad in params.triads]
    known = [triad for triad in params.triads if context.unit.triad(triad) is not None]
    return (*conditions, *multi_position.planned_residuals(params, known))


PROCEDURE = Procedure(
    "multi_position_calibration",
    "Calibration in any positions",
    "1.1.0",
    Params,
    Result,
    resolve,
    schedule,
    predict,
    acquire,
    analyse,
    multi_position.report,
    multi_position.calibrations,
    quantities=lambda params, _: multi_position.quantities(params),
    planned_checks=planned_checks,
)
