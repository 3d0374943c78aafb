"""Calibration of both triads on six faces, by rests and by rotations through 360 degrees (Ferraris' way).

Each axis of the unit points upwards and downwards along the table's outer axis; there the unit rests, and turns through
whole turns there and back. Gravity at the six rests gives the accelerometers' b and K; of the gyros the rests and the
sums of the turns give b, the differences of the turns K, without the Earth's rate. The outer axis must be endless.
"""

from collections.abc import AsyncIterator, Sequence

import numpy as np
from pydantic import Field

from procedures import ferraris, steps
from procedures.analysis.calibration.plan import triad_plan
from procedures.analysis.calibration.station_noise import triad_covariance
from procedures.analysis.calibration.station_plan import windows
from procedures.analysis.own_axes import OWN_AXES
from procedures.analysis.turns.ferraris import (
    END_REST_S,
    face_stations,
    ferraris_estimator,
    ferraris_flaws,
    rests_and_turns,
)
from procedures.analysis.turns.plan import coefficient_names
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core import units
from procedures.core.coefficient_name import CoefficientName
from procedures.core.errors import BadParameter
from procedures.core.imu_model import COEFFICIENT_NAMES
from procedures.core.limits import PlannedCheck
from procedures.core.recording import AXES, Recording, Station
from procedures.ferraris import FerrarisLimits, Result
from procedures.multi_position import predicted
from procedures.procedure import Context, PredictedUncertainty, Prediction, Procedure
from procedures.site_parameters import TableParameters, declared_table
from procedures.table_motion import default_ramp_s, require_possible, require_rest, rest_with_demands
from procedures.triad_checks import RESIDUALS


class Params(TableParameters):
    """Rests, turns, site and limits. None takes the unit's or the bench's value."""

    rest_s: float | None = Field(None, ge=5.0, le=86_400.0, description="at each face; None: the averaging time")
    turns: int = Field(1, ge=1, le=1000, description="whole turns there, and as many back")
    rate_deg_s: float = Field(30.0, ge=0.1, le=3600.0)
    ramp_s: float | None = Field(None, gt=0.0, le=600.0, description="None: what the outer axis' acceleration allows")
    settle_s: float = Field(2.0, ge=0.0, le=3600.0)
    end_rest_s: float | None = Field(
        None, ge=1.0, le=600.0, description="after turns, recorded; None: 2 s, and what the table's demands take"
    )
    limits: FerrarisLimits = Field(default_factory=lambda: FerrarisLimits.model_validate({}))


def resolve(params: Params, context: Context) -> Params:
    """Return the parameters with the rest from the unit, and ramps, site and table accuracy from the bench."""
    ramp_s = default_ramp_s(params.rate_deg_s, context.bench)
    end_rest_s = rest_with_demands(END_REST_S, context.bench)
    own = {"rest_s": context.unit.averaging_time_s, "ramp_s": ramp_s, "end_rest_s": end_rest_s}
    full = params.filled({**own, **declared_table(context)})
    full.require_sources(context, corrected=False)
    return full


def schedule(params: Params) -> tuple[Station, ...]:
    """Return the stations, face after face: a rest, turns there, turns back. Raises `BadParameter` where a rate would
    not be reached.
    """
    if params.rest_s is None or params.ramp_s is None or params.end_rest_s is None:
        raise BadParameter("rest_s", None, "resolve the parameters first: rests and ramp come from unit and bench")
    turns = (params.turns, params.rate_deg_s, params.ramp_s, params.settle_s, params.end_rest_s)
    try:
        return face_stations(params.rest_s, *turns)
    except ValueError as refusal:
        raise BadParameter("turns", params.turns, str(refusal)) from refusal


def predict(params: Params, context: Context) -> Prediction:
    """Return duration and the uncertainty of each coefficient of both triads. Raises `BadParameter`, `Undetermined`."""
    params = resolve(params, context)
    stations = schedule(params)
    require_rest("end_rest_s", params.end_rest_s, context.bench)
    require_possible("rate_deg_s", params.rate_deg_s, stations, context.bench)
    spans = windows(stations, context.bench.axis_motion)
    still = [s for s in stations if s.turn is None]
    site = params.site(context)
    plan = triad_plan("accelerometer", context.unit, still, context.bench.axis_motion, site, params.table(site))
    uncertainties = (*_gyro(params, context, stations), *predicted(plan))
    unknown = context.unit.gyro is None or context.unit.accelerometer is None
    warnings = (
        ("the noise of a triad is not known: its share in the uncertainties is not predicted",) if unknown else ()
    )
    basis = "the unit's calibration" if context.unit.known_matrix("gyro") is not None else "nominal scale factors"
    return Prediction(float(spans[-1, 1]), uncertainties, warnings, basis if uncertainties else "")


def _gyro(params: Params, context: Context, stations: Sequence[Station]) -> list[PredictedUncertainty]:
    spans = windows(stations, context.bench.axis_motion)
    noise = triad_covariance(context.unit.gyro, spans)
    if noise is None:
        return []
    site, known = params.site(context), context.unit.known_matrix("gyro")
    motion = rests_and_turns(stations, spans[:, 1] - spans[:, 0], site)
    flaws = ferraris_flaws(motion, params.table(site))
    made = ferraris_estimator(motion, noise, flaws, np.eye(3) if known is None else known)
    total, own = made.covariance.diagonal() ** 0.5, made.noise_covariance.diagonal() ** 0.5
    table = (made.table_per_sd**2).sum(axis=1) ** 0.5
    parts = zip(coefficient_names(()), total.tolist(), own.tolist(), table.tolist(), strict=True)
    return [
        PredictedUncertainty(CoefficientName("gyro", n), "rad/s" if n.startswith("b_") else "1", sd, of_noise, of_table)
        for n, sd, of_noise, of_table in parts
    ]


async def acquire(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    """Move, settle, record at rest or while the table turns, station after station; yield the stream of each."""
    for station in stations:
        yield await steps.record_turn(bench, station)


def analyse(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    """Return the coefficients of both triads by least squares over rests and turns. Raises `UnfitRecording`,
    `MissingChannel`, `Undetermined`.
    """
    params = resolve(params, context)
    site = params.site(context)
    return ferraris.calibrated(recordings, site, params.table(site), context.unit, params.limits)


def quantities(params: Params, context: Context) -> tuple[str, ...]:
    """Return the names of the checks and coefficients that a result will have."""
    scale = tuple(f"gyro scale factor {axis}, 3σ" for axis in AXES)
    residuals = tuple(f"{triad} {RESIDUALS}" for triad in ("gyro", "accelerometer"))
    named = tuple(f"{triad}.{name}" for triad in ("gyro", "accelerometer") for name in COEFFICIENT_NAMES)
    return (*scale, "accelerometer condition number", f"accelerometer{OWN_AXES}", *residuals, *named)


def planned_checks(params: Params, context: Context) -> tuple[PlannedCheck, ...]:
    """Return the planned checks of the scale factors' uncertainty, by the plan, and of the residuals."""
    params = resolve(params, context)
    sd = {u.name: u.standard_uncertainty / units.PPM for u in _gyro(params, context, schedule(params))}
    limit = params.limits.of_scale
    scale = [
        PlannedCheck(f"gyro scale factor {axis}, 3σ", limit, None, None, 3.0 * sd[f"gyro.K{k}{k}"])
        for k, axis in enumerate(AXES, start=1)
        if sd
    ]
    return (*scale, *ferraris.planned_residuals(params.limits, context.unit))


PROCEDURE = Procedure(
    *("ferraris_calibration", "Calibration on six faces, by rests and turns", "1.1.0"),
    *(Params, Result, resolve, schedule, predict, acquire, analyse, ferraris.report, ferraris.calibrations),
    quantities=quantities,
    planned_checks=planned_checks,
)
