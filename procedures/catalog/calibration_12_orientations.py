"""Bench calibration: both triads from twelve known orientations (thesis 3.3.3-3.3.6, 5.1-5.5).

The unit is set to each orientation and rests there for the averaging time; least squares over the station means
gives bias, scale factors and cross-couplings of gyros (from the Earth's rate) and accelerometers (from gravity). The
weights allow for the unit's noise and the table's declared accuracy; weighting="noise" is the thesis's own. With
thermal_correction="current" the accelerometers' means are first brought to the reference temperatures (thesis 4.1).
"""

from collections.abc import AsyncIterator, Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from procedures import steps
from procedures.analysis.calibration.estimator import Weighting
from procedures.analysis.calibration.plan import TriadPlan, basis, in_sample_covariance, triad_plan
from procedures.analysis.calibration.reference import TRIAD_NAMES
from procedures.analysis.calibration.reference_temperature import ThermalShare, least_dwell_s, require_correctable
from procedures.analysis.calibration.scalar import require_scalar_determined
from procedures.analysis.calibration.station_means import launch_warnings
from procedures.analysis.calibration.station_plan import THESIS_ORIENTATIONS, windows
from procedures.analysis.calibration.summary import TriadSummary
from procedures.analysis.calibration.triad_analysis import (
    AccelerometerSettings,
    analyse_accelerometers,
    analyse_gyros,
    suspected,
)
from procedures.analysis.orientation_plan.requirements import (
    in_run_check,
    in_run_unresolved,
    run_to_run_requirements,
    unresolved,
)
from procedures.analysis.own_axes import OWN_AXES
from procedures.analysis.recursive_bias.dwell import DwellsSaved, dwells_saved
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core import units
from procedures.core.errors import BadParameter, Undetermined
from procedures.core.frames import orientation_beta_gamma, orientation_gamma_beta
from procedures.core.imu_model import COEFFICIENT_NAMES, TriadCalibration
from procedures.core.limits import SIGNIFICANCE, Limit, PlannedCheck, verdict
from procedures.core.recording import Recording, Station
from procedures.core.report import Report
from procedures.dwells import DwellParameters, expected_stations, saved_tables
from procedures.multi_position import predicted
from procedures.parameters import SupplyParameters
from procedures.procedure import Context, Outcome, Parameters, Prediction, Procedure
from procedures.reports import calibration as pictures
from procedures.site_parameters import TableParameters, declared_table
from procedures.triad_checks import RESIDUALS, in_run_limit, triad_checks

Angle = Annotated[float, Field(ge=-360.0, le=360.0)]
Lag = Annotated[float, Field(ge=0.0, le=600.0)]

_NOT_PREDICTED = (
    "the predicted uncertainties are without the thermal correction's share, which depends on the temperatures to come"
)


class Limits(Parameters):
    """Requirements on the unit (thesis 4.3, 5.6) and on the calibration itself (this program's own)."""

    gyro_bias_in_run_deg_h: float = Field(0.015, gt=0.0, le=1e6)
    gyro_bias_run_to_run_deg_h: float = Field(0.015, gt=0.0, le=1e6)
    gyro_scale_run_to_run_ppm: float | None = Field(
        10.0, gt=0.0, le=1e6, description="None: whole turns are to give the scale factor"
    )
    accelerometer_bias_in_run_m_s2: float = Field(0.0005, gt=0.0, le=100.0)
    accelerometer_bias_run_to_run_m_s2: float = Field(0.0005, gt=0.0, le=100.0)
    accelerometer_scale_run_to_run_ppm: float = Field(200.0, gt=0.0, le=1e6)
    residual_p_value_min: float = Field(
        0.001, ge=0.0, le=1.0, description="smallest p-value accepted for the chi-square of the residuals"
    )
    condition_max: float = Field(
        100.0, ge=1.0, le=1e9, description="largest condition number of the column-scaled design"
    )


class Params(TableParameters, DwellParameters, SupplyParameters):
    """Orientations, dwell, site and limits of the calibration. None takes the unit's or the bench's value."""

    orientations: tuple[tuple[Angle, Angle], ...] = Field(
        THESIS_ORIENTATIONS, min_length=1, max_length=200, description="(β, γ) [deg], in order"
    )
    rotation_order: Literal["x_after_z", "z_after_x"] = Field(
        "x_after_z", description="x_after_z: β about x after γ about z, the order of the thesis"
    )
    dwell_s: float | None = Field(None, ge=1.0, le=86_400.0, description="None: the unit's averaging time")
    settle_s: float = Field(2.0, ge=0.0, le=3600.0)
    weighting: Weighting = Field(
        "noise_and_table",
        description="noise_and_table: least squares that allows for the table's declared accuracy; noise: the table's "
        "angles as commanded (the thesis), their uncertainty added afterwards",
    )
    scalar_check: bool = Field(True, description="cross-check with the magnitude of gravity alone")
    thermal_correction: Literal["none", "current"] = Field(
        "none", description="current: the unit's thermal correction brings the accelerometers to its reference"
    )
    case_lag_s: Lag = Field(5.0, description="time constant of the case sensor; used by thermal_correction=current")
    converter_lag_s: Lag = Field(5.0, description="time constant of the converter's sensor")
    limits: Limits = Field(default_factory=lambda: Limits.model_validate({}))


class Result(Outcome):
    """Coefficients of both triads, their goodness of fit at the stations, and the verdict."""

    triads: tuple[TriadSummary, ...]
    thermal: ThermalShare | None = Field(
        None,
        exclude_if=lambda share: share is None,
        description="thermal correction of the accelerometers, where it was applied",
    )
    dwells: DwellsSaved | None = Field(
        None, exclude_if=lambda saved: saved is None, description="dwells ended by the stop rule, and the time saved"
    )


def resolve(params: Params, context: Context) -> Params:
    """Return the parameters with the dwell from the unit, and site and table accuracy from the bench. Raises
    `BadParameter` for a correction that the unit does not have.
    """
    full = params.filled({"dwell_s": context.unit.averaging_time_s, **declared_table(context)})
    require_correctable(full.thermal_correction, full.dwell_s, context.unit)
    full.require_sources(context, full.thermal_correction == "current")
    return full.with_rule(context.unit, least_dwell_s(full.thermal_correction))


def schedule(params: Params) -> tuple[Station, ...]:
    """Return the stations of the calibration, one an orientation, in the order given. Raises `BadParameter` where the
    dwell is not resolved.
    """
    turn = orientation_beta_gamma if params.rotation_order == "x_after_z" else orientation_gamma_beta
    if params.dwell_s is None:
        raise BadParameter("dwell_s", None, "resolve the parameters first: the dwell comes from the unit")
    return tuple(
        Station(
            i,
            f"β={beta:g} γ={gamma:g}",
            turn(beta, gamma),
            None,
            params.settle_s,
            params.dwell_s,
            temperatures=params.thermal_correction == "current",
            until=params.until,
            supply_voltage_v=params.supply_voltage_v,
        )
        for i, (beta, gamma) in enumerate(params.orientations)
    )


def predict(params: Params, context: Context) -> Prediction:
    """Return duration, the uncertainty of every coefficient, and the limits out of reach. Raises `Undetermined`."""
    params = resolve(params, context)
    stations = schedule(params)
    plans = [_plan(triad, params, context) for triad in TRIAD_NAMES]
    _require_scalar(params, plans[1])
    uncertainties = tuple(u for plan in plans for u in predicted(plan))
    thermal = (_NOT_PREDICTED,) if params.thermal_correction == "current" else ()
    thermal += params.dwell_warnings(stations)
    duration_s = float(windows(expected_stations(stations), context.bench.axis_motion)[-1, 1])
    rests_on = basis(plans) if uncertainties else ""
    return Prediction(duration_s, uncertainties, _warnings(params, plans) + thermal, rests_on)


async def acquire(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    """Move, settle, record, station after station; yield the stream of each."""
    for station in stations:
        yield await steps.record_station(bench, station)


def analyse(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    """Return the coefficients of both triads by least squares over the station means, with checks. Raises
    `UnfitRecording`, `Undetermined`.
    """
    params = resolve(params, context)
    site = params.site(context)
    uncertainty = params.table(site)
    plans = [_plan(triad, params, context) for triad in TRIAD_NAMES]
    _require_scalar(params, plans[1])
    gyro, accelerometer = (context.unit.triad(triad) for triad in TRIAD_NAMES)
    warm = params.thermal_correction == "current"
    of_gyros = context.unit.gyro_correction if warm else None
    first = analyse_gyros(recordings, site, uncertainty, gyro, params.weighting, of_gyros)
    correction = context.unit.thermal_correction if warm else None
    settings = AccelerometerSettings(
        params.scalar_check, params.weighting, correction, (params.case_lag_s, params.converter_lag_s)
    )
    second, fit, share, doubts = analyse_accelerometers(recordings, site, uncertainty, accelerometer, settings)
    triads = suspected([first, (second, fit)])
    checks = tuple(
        c for t in triads for c in triad_checks(t, in_run_limit(t.calibration.triad, params.limits), params.limits)
    )
    warnings = _warnings(params, plans) + launch_warnings(recordings) + doubts
    return Result(
        checks=checks,
        verdict=verdict(checks),
        warnings=warnings,
        triads=triads,
        thermal=share,
        dwells=dwells_saved(recordings),
    )


def calibrations(result: Result) -> tuple[TriadCalibration, ...]:
    """Return the calibrations that the result gives, one a triad."""
    return tuple(t.calibration for t in result.triads)


def quantities(params: Params, context: Context) -> tuple[str, ...]:
    """Return the names of the checks and coefficients that a result will have."""
    checks = (" bias in run, δ/√3", " condition number", OWN_AXES, f" {RESIDUALS}")
    return tuple(f"{triad}{n}" for triad in TRIAD_NAMES for n in (*checks, *(f".{c}" for c in COEFFICIENT_NAMES)))


def planned_checks(params: Params, context: Context) -> tuple[PlannedCheck, ...]:
    """Return the planned checks of the error per axis δ/√3, in sample."""
    params = resolve(params, context)
    level, source = params.limits.residual_p_value_min, params.limits.source_of("residual_p_value_min", SIGNIFICANCE)
    limit = Limit("1", minimum=level, source=source)
    found: list[PlannedCheck] = []
    for triad in TRIAD_NAMES:
        plan, in_run = _plan(triad, params, context), in_run_limit(triad, params.limits)
        found.append(in_run_check(plan, in_run.maximum, in_sample_covariance(plan), source=in_run.source))
    return (*found, *(PlannedCheck(f"{triad} {RESIDUALS}", limit, level=level) for triad in TRIAD_NAMES))


def report(result: Result) -> Report:
    """Return the report: coefficients, scalar cross-checks, budgets, residuals and magnitudes (thesis Tables 5.1-5.4,
    fig. 5.6-5.12).
    """
    magnitudes = [t.magnitudes for t in result.triads]
    tables = [pictures.triad_table(t) for t in result.triads]
    tables += [table for t in result.triads if (table := pictures.scalar_table(t)) is not None]
    tables += [pictures.sample_table(result.triads)]
    tables += [pictures.budget_table(t.calibration.triad, t.budgets) for t in result.triads if t.budgets]
    figures = [f for t in result.triads for f in pictures.triad_figures(t)]
    stations = [pictures.station_table(m) for m in magnitudes]
    thermal = [] if result.thermal is None else pictures.thermal_tables(result.thermal, magnitudes[0].labels)
    return Report(sections=(*tables, *saved_tables(result.dwells), *thermal, *figures, *stations))


def _plan(triad: str, params: Params, context: Context) -> TriadPlan:
    site, stations = params.site(context), expected_stations(schedule(params))
    uncertainty = params.table(site)
    return triad_plan(triad, context.unit, stations, context.bench.axis_motion, site, uncertainty, params.weighting)


def _require_scalar(params: Params, accelerometer: TriadPlan) -> None:
    """Refuse a set that the cross-check cannot use; the error names the way without it."""
    if not params.scalar_check:
        return
    directions = accelerometer.vectors / np.linalg.norm(accelerometer.vectors, axis=1)[:, None]
    try:
        require_scalar_determined("the nine scalar accelerometer parameters", directions)
    except Undetermined as lost:
        way_out = "scalar_check=false calibrates linearly where the linear model is determined"
        what = f"the nine scalar accelerometer parameters ({way_out})"
        raise Undetermined(what, lost.lost, lost.rank, lost.wanted, lost.condition) from lost


def _warnings(params: Params, plans: Sequence[TriadPlan]) -> tuple[str, ...]:
    """Warnings of limits that the plan cannot resolve, and of triads with unknown noise."""
    limits = params.limits
    wanted = run_to_run_requirements(
        limits.gyro_bias_run_to_run_deg_h,
        limits.gyro_scale_run_to_run_ppm,
        limits.accelerometer_bias_run_to_run_m_s2,
        limits.accelerometer_scale_run_to_run_ppm,
    )
    by_triad = {plan.triad: plan for plan in plans}
    found = [unresolved(by_triad[r.triad], r) for r in wanted]
    deg_h = units.DEG_PER_HOUR
    found += [
        in_run_unresolved(by_triad["gyro"], limits.gyro_bias_in_run_deg_h * deg_h, "deg/h", deg_h, in_sample=True),
        in_run_unresolved(
            by_triad["accelerometer"], limits.accelerometer_bias_in_run_m_s2, "m/s^2", 1.0, in_sample=True
        ),
    ]
    unknown = [
        f"the noise of the {p.triad} triad is not known: its uncertainties come from the scatter within the dwells and "
        "the residuals, which do not show noise slower than the job"
        for p in plans
        if p.at_dwell() is None
    ]
    return tuple(w for w in (*found, *unknown) if w is not None)


PROCEDURE = Procedure(
    *("calibration_12_orientations", "Calibration in twelve orientations", "1.6.0"),
    *(Params, Result, resolve, schedule, predict, acquire, analyse, report, calibrations),
    uses_corrections=lambda params: ("thermal", "gyros") if params.thermal_correction == "current" else (),
    quantities=quantities,
    planned_checks=planned_checks,
)
