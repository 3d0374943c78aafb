"""Verification of a calibration: magnitudes in nine orientations that did not make it (thesis 5.1, 5.5).

The thesis verifies with a macro that it does not print. These nine are the plan of a scalar calibration that it cites
in 3.3.2 (its reference [63]): steps of 40°, 10° and 20°, none of which is among the twelve. Its Tables 5.3 and 5.4 are
those of the twelve that made the coefficients; what is shown here is out of sample, in another launch.

The corrected magnitude of gravity and of the Earth's rate is compared with the site's; the table's angles need not be
true for that. What should be seen follows from the calibration's covariance, the unit's stability and the noise of the
dwell.

The residual vectors say more than the magnitudes: which coefficient of which channel moved since the calibration, and
by how many sigma after all others are fitted (`analysis.calibration.diagnosis`). These do depend on the table.
"""

from collections.abc import AsyncIterator, Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from procedures import steps
from procedures.analysis.calibration.diagnosis import LIKELY_P_VALUE
from procedures.analysis.calibration.plan import TriadPlan, basis, triad_plan
from procedures.analysis.calibration.reference import TRIAD_NAMES
from procedures.analysis.calibration.reference_temperature import least_dwell_s, require_correctable
from procedures.analysis.calibration.station_means import launch_warnings
from procedures.analysis.calibration.station_plan import windows
from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.analysis.calibration.triad_verification import (
    TriadVerification,
    calibration_of,
    planned_covariance,
    planned_diagnosis,
    verify_at_reference,
    verify_gyros,
    verify_triad,
)
from procedures.analysis.calibration.verification import predicted_sd
from procedures.analysis.orientation_plan import requirements
from procedures.analysis.recursive_bias.dwell import DwellsSaved, dwells_saved
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core import units
from procedures.core.errors import BadParameter
from procedures.core.limits import SIGNIFICANCE, Check, Limit, PlannedCheck, check, verdict
from procedures.core.recording import Recording, Station
from procedures.core.report import Report
from procedures.core.table_angles import TableAngles
from procedures.dwells import DwellParameters, expected_stations, saved_tables
from procedures.parameters import SupplyParameters, level_check
from procedures.procedure import Context, Outcome, Parameters, PredictedUncertainty, Prediction, Procedure
from procedures.reports import calibration as pictures
from procedures.reports import diagnosis as diagnoses
from procedures.site_parameters import TableParameters, declared_table
from procedures.triad_checks import in_run_limit

Angle = Annotated[float, Field(ge=-360.0, le=360.0)]
Lag = Annotated[float, Field(ge=0.0, le=600.0)]

ORIENTATIONS = tuple((40.0 * i, 10.0 * i, 20.0 * i) for i in range(9))
"""(inner, middle, outer) [deg], steps of 40°, 10° and 20°: the scalar plan that thesis 3.3.2 cites as [63]."""


_OF_PLAN = (
    "None: the limit is the expanded uncertainty predicted by the plan, including the unit's change between launches; "
    "a sound unit exceeds it with probability prediction_p_value_min. A fixed 0.0005 m/s^2 may be exceeded by a sound "
    "unit in another launch, if its accelerometers' scale factors change by 80 ppm"
)


class Limits(Parameters):
    """Requirements on the unit (thesis 4.3, 5.6) and on its agreement with the prediction (this program's own)."""

    gyro_bias_in_run_deg_h: float | None = Field(0.015, gt=0.0, le=1e6, description=_OF_PLAN)
    accelerometer_bias_in_run_m_s2: float | None = Field(0.0005, gt=0.0, le=100.0, description=_OF_PLAN)
    prediction_p_value_min: float = Field(
        0.001, ge=0.0, le=1.0, description="smallest p-value accepted for the chi-square of the errors"
    )


class Params(TableParameters, DwellParameters, SupplyParameters):
    """Orientations of the verification and limits of the unit. None takes the unit's or the bench's value.

    The accuracy of table and azimuth concerns the diagnosis alone; the magnitudes do not depend on it.
    """

    orientations: tuple[tuple[Angle, Angle, Angle], ...] = Field(
        ORIENTATIONS, min_length=2, max_length=200, description="(inner, middle, outer) [deg], in order"
    )
    dwell_s: float | None = Field(None, ge=1.0, le=86_400.0, description="None: the unit's averaging time")
    settle_s: float = Field(2.0, ge=0.0, le=3600.0)
    thermal_correction: Literal["none", "current"] = Field(
        "none", description="current: the unit's thermal correction brings the accelerometers to its reference"
    )
    case_lag_s: Lag = Field(5.0, description="time constant of the case sensor; used by thermal_correction=current")
    converter_lag_s: Lag = Field(5.0, description="time constant of the converter's sensor")
    limits: Limits = Field(default_factory=lambda: Limits.model_validate({}))


class Result(Outcome):
    """Magnitudes of both triads before and after correction, and their agreement with the prediction."""

    triads: tuple[TriadVerification, ...]
    dwells: DwellsSaved | None = Field(
        None, exclude_if=lambda saved: saved is None, description="dwells ended by the stop rule, and the time saved"
    )


def resolve(params: Params, context: Context) -> Params:
    """Return the parameters with dwell, site and table. Raises `BadParameter` for a correction that is missing."""
    full = params.filled({"dwell_s": context.unit.averaging_time_s, **declared_table(context)})
    require_correctable(full.thermal_correction, full.dwell_s, context.unit)
    return full.with_rule(context.unit, least_dwell_s(full.thermal_correction))


def schedule(params: Params) -> tuple[Station, ...]:
    """Return the stations, one an orientation, in order. Raises `BadParameter` where the dwell is not resolved."""
    if params.dwell_s is None:
        raise BadParameter("dwell_s", None, "resolve the parameters first: the dwell comes from the unit")
    return tuple(
        Station(
            i,
            f"inner={inner:g} middle={middle:g} outer={outer:g}",
            TableAngles(outer, middle, inner),
            None,
            params.settle_s,
            params.dwell_s,
            temperatures=params.thermal_correction == "current",
            until=params.until,
            supply_voltage_v=params.supply_voltage_v,
        )
        for i, (inner, middle, outer) in enumerate(params.orientations)
    )


def predict(params: Params, context: Context) -> Prediction:
    """Return duration, and standard deviations of the magnitudes and of each change. Raises `NoCalibration`."""
    params = resolve(params, context)
    plans = [_plan(triad, params, context) for triad in TRIAD_NAMES]
    uncertainties = tuple(u for plan in plans for u in (*_predicted(plan), *_predicted_changes(plan, params, context)))
    stations = schedule(params)
    duration_s = float(windows(expected_stations(stations), context.bench.axis_motion)[-1, 1])
    limits = (params.limits.gyro_bias_in_run_deg_h, params.limits.accelerometer_bias_in_run_m_s2)
    judged = [_in_run(p, params.limits) for p, limit in zip(plans, limits, strict=True) if limit is not None]
    chances = requirements.chances_of_failure(judged)
    warnings = _warnings(plans, params.limits) + chances + params.dwell_warnings(stations)
    return Prediction(duration_s, uncertainties, warnings, basis(plans) if uncertainties else "")


async def acquire(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    """Move, settle, record, station after station; yield the stream of each."""
    for station in stations:
        yield await steps.record_station(bench, station)


def analyse(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    """Return the corrected means' magnitudes, judged. Raises `NoCalibration`, `UnfitRecording`."""
    params = resolve(params, context)
    site = params.site(context)
    used = context.unit.thermal_correction if params.thermal_correction == "current" else None
    table = params.table(site)
    of_gyros = None if used is None else context.unit.gyro_correction
    doubts, gyro = (), verify_gyros(recordings, site, context.unit, table, of_gyros)
    if used is None:
        accelerometer = verify_triad(recordings, "accelerometer", site, context.unit, table)
    else:
        accelerometer, doubts = verify_at_reference(
            recordings, site, context.unit, used, (params.case_lag_s, params.converter_lag_s), table
        )
    triads = (gyro, accelerometer)
    plans = [_plan(triad, params, context) for triad in TRIAD_NAMES]
    checks = tuple(c for t, p in zip(triads, plans, strict=True) for c in _checks(t, params.limits, p))
    warnings = _warnings(plans, params.limits) + launch_warnings(recordings) + doubts + _moved(triads)
    saved = dwells_saved(recordings)
    return Result(checks=checks, verdict=verdict(checks), warnings=warnings, triads=triads, dwells=saved)


def quantities(params: Params, context: Context) -> tuple[str, ...]:
    """Return the names of the checks that a result will have."""
    checks = ("bias in run, δ/√3", "errors as predicted, p-value of chi-square")
    return tuple(f"{triad} {c}" for triad in TRIAD_NAMES for c in checks)


def planned_checks(params: Params, context: Context) -> tuple[PlannedCheck, ...]:
    """Return the planned checks of each triad: bias in run (error per axis δ/√3, out of sample), and the p-value of the
    errors. Raises `NoCalibration`.
    """
    params = resolve(params, context)
    plans = [_plan(triad, params, context) for triad in TRIAD_NAMES]
    level = params.limits.prediction_p_value_min
    limit = Limit("1", minimum=level, source=params.limits.source_of("prediction_p_value_min", SIGNIFICANCE))
    name = "errors as predicted, p-value of chi-square"
    found = [_in_run(p, params.limits) for p in plans]
    return (*found, *(PlannedCheck(f"{triad} {name}", limit, level=level) for triad in TRIAD_NAMES))


def report(result: Result) -> Report:
    """Return the report: diagnosis, and tables and figures of the thesis (5.3, 5.4; 5.6-5.12), here out of sample."""
    magnitudes = [t.magnitudes for t in result.triads]
    figures = [figure for m in magnitudes for figure in pictures.magnitude_figures(m)]
    table = pictures.magnitude_table(magnitudes, "Verification, out of sample: other orientations and another launch")
    found = diagnoses.diagnosis_tables([t.diagnosis for t in result.triads if t.diagnosis is not None])
    said = " ".join(t.diagnosis.sentence if t.diagnosis else t.not_diagnosed for t in result.triads)
    return Report(
        said, (table, *saved_tables(result.dwells), *found, *figures, *(pictures.station_table(m) for m in magnitudes))
    )


def _moved(triads: Sequence[TriadVerification]) -> tuple[str, ...]:
    """Sentences on residual vectors that show a change; the magnitudes may pass all the same."""
    found = [t.diagnosis for t in triads if t.diagnosis is not None]
    return tuple(d.sentence for d in found if d.named or d.p_value_unchanged < LIKELY_P_VALUE)


def _plan(triad: str, params: Params, context: Context) -> TriadPlan:
    """Plan of a triad without the table's uncertainty, because magnitudes do not depend on the table's attitude."""
    calibration_of(context.unit, triad)
    site = params.site(context)
    stations = expected_stations(schedule(params))
    return triad_plan(triad, context.unit, stations, context.bench.axis_motion, site, TableUncertainty())


def _predicted(plan: TriadPlan) -> list[PredictedUncertainty]:
    covariance = planned_covariance(plan)
    if covariance is None:
        return []
    unit = calibration_of(plan.unit, plan.triad).input_unit
    errors = np.sqrt(np.diagonal(covariance)).tolist()
    names = [f"{plan.triad}.magnitude {s.label}" for s in plan.stations]
    spread = predicted_sd(covariance)
    return [
        PredictedUncertainty(f"{plan.triad}.sd after correction", unit, spread, spread),
        *(PredictedUncertainty(name, unit, error, error) for name, error in zip(names, errors, strict=True)),
    ]


def _predicted_changes(plan: TriadPlan, params: Params, context: Context) -> list[PredictedUncertainty]:
    """Standard uncertainty of each change that the plan can tell from all others, from noise and table together."""
    site = params.site(context)
    found = planned_diagnosis(plan, site, params.table(site))
    return [
        PredictedUncertainty(f"{plan.triad}.change of {c.name}", c.unit, c.standard_uncertainty, c.standard_uncertainty)
        for c in (() if found is None else found.changes)
        if c.standard_uncertainty is not None
    ]


def _warnings(plans: Sequence[TriadPlan], limits: Limits) -> tuple[str, ...]:
    deg_h = units.DEG_PER_HOUR
    gyro, accelerometer = plans
    bias, force = limits.gyro_bias_in_run_deg_h, limits.accelerometer_bias_in_run_m_s2
    in_run = (
        None if bias is None else requirements.in_run_unresolved(gyro, bias * deg_h, "deg/h", deg_h),
        None if force is None else requirements.in_run_unresolved(accelerometer, force, "m/s^2", 1.0),
    )
    found = [w for w in in_run if w is not None]
    for plan in plans:
        record = plan.unit.triad(plan.triad)
        if plan.noise_covariance() is None or record is None:
            found.append(f"the noise of the {plan.triad} triad is not known: its errors are not judged by a prediction")
        elif record.bias_run_to_run_sd == 0.0:
            found.append(
                f"nothing is known of how the {plan.triad} biases change from launch to launch: the prediction holds "
                "only for the launch of the calibration"
            )
    return tuple(found)


def _in_run(plan: TriadPlan, limits: Limits) -> PlannedCheck:
    given, level = in_run_limit(plan.triad, limits), limits.prediction_p_value_min
    if given.maximum is None and level == 0.0:
        raise BadParameter("limits.prediction_p_value_min", level, "above 0: the limit of the plan is made with it")
    covariance, of_plan = planned_covariance(plan), level or requirements.IN_RUN_LEVEL
    return requirements.in_run_check(plan, given.maximum, covariance, of_plan, given.source)


def _checks(t: TriadVerification, limits: Limits, plan: TriadPlan) -> list[Check]:
    m, planned = t.magnitudes, _in_run(plan, limits)
    size = units.DISPLAY[m.unit][1]
    checks = [check(planned.check, m.per_axis / size, planned.limit, m.per_axis_sd / size, "", len(m.after) - 1.0)]
    if t.p_value is not None:
        name = f"{m.triad} errors as predicted, p-value of chi-square"
        checks.append(level_check(limits, "prediction_p_value_min", name, t.p_value))
    return checks


PROCEDURE = Procedure(
    *("verification_9_orientations", "Verification in nine orientations", "1.3.0"),
    *(Params, Result, resolve, schedule, predict, acquire, analyse, report),
    uses_calibration=TRIAD_NAMES,
    uses_corrections=lambda params: ("thermal", "gyros") if params.thermal_correction == "current" else (),
    quantities=quantities,
    planned_checks=planned_checks,
)
