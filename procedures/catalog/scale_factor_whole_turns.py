"""Gyro scale factor by whole turns (IEEE Std 647: scale factor over whole revolutions at fixed rates).

Each axis of the unit in turn points upwards, along the table's outer axis, and the table makes n whole turns forth and
n back at each of several rates while the unit is recorded. The turned angle is known to an arcsecond out of millions,
the Earth's rate and the bias cancel between forth and back: so scale factors come out to a part in a million, where the
Earth's rate alone leaves some hundred, with asymmetry, nonlinearity and misalignments.
The outer axis must turn without end. The accelerometers are recorded but not judged.
"""

from collections.abc import AsyncIterator, Sequence
from typing import Annotated

from pydantic import Field

from procedures import steps
from procedures.analysis.calibration.reference import site_with
from procedures.analysis.calibration.station_means import launch_warnings
from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.analysis.turns.fit import TERMS, Term
from procedures.analysis.turns.plan import TurnPlan, TurnProgram, bench_time_s, coefficient_names, too_coarse
from procedures.analysis.turns.summary import WholeTurns, analyse_turns
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core import units
from procedures.core.coefficient_name import CoefficientName
from procedures.core.errors import BadParameter
from procedures.core.imu_model import TriadCalibration
from procedures.core.limits import Check, Limit, PlannedCheck, check, verdict
from procedures.core.recording import AXES, Recording, Station
from procedures.core.report import Report
from procedures.core.site import Site
from procedures.parameters import largest, level_check, planned_tests
from procedures.procedure import (
    Context,
    JudgedParameters,
    Outcome,
    Parameters,
    PredictedUncertainty,
    Prediction,
    Procedure,
)
from procedures.reports import whole_turns as pictures
from procedures.reports.calibration import budget_tables
from procedures.site_parameters import Arcsec
from procedures.table_motion import default_ramp_s, require_possible, require_rest, rest_with_demands

Rate = Annotated[float, Field(ge=0.1, le=3600.0)]
TERM_SOURCE = "ours, after thesis 4.3"
RESIDUALS = "gyro residuals, p-value of chi-square"
REST_S = 2.0
"""Rest at the end of a recording where the table's demands take no time [s]."""


class Limits(Parameters):
    """Requirements on the measurement (this program's own), and on the unit by thesis 4.3 (scale factor)."""

    scale_factor_3_sigma_ppm: float = Field(1.0, gt=0.0, le=1e6, description="three standard uncertainties")
    asymmetry_ppm: float = Field(10.0, gt=0.0, le=1e6)
    nonlinearity_ppm: float = Field(10.0, gt=0.0, le=1e6, description="largest nonlinear term at the reference rate")
    residual_p_value_min: float = Field(
        0.001, ge=0.0, le=1.0, description="smallest p-value accepted for the chi-square of the residuals"
    )


class Params(JudgedParameters):
    """Rates and durations of the turns, and limits of the unit. None takes the bench's value."""

    rates_deg_s: tuple[Rate, ...] = Field(
        (10.0, 20.0, 30.0, 40.0, 50.0), min_length=1, max_length=50, description="each forth and back, about each axis"
    )
    turning_s: float = Field(45.0, ge=1.0, le=86_400.0, description="at each rate, to the nearest whole turn")
    ramp_s: float | None = Field(None, gt=0.0, le=600.0, description="None: what the outer axis' acceleration allows")
    rest_s: float | None = Field(
        None, ge=1.0, le=600.0, description="at the end of each recording; None: 2 s, and what the table's demands take"
    )
    settle_s: float = Field(2.0, ge=0.0, le=3600.0)
    terms: tuple[Term, ...] = Field(TERMS, max_length=3, description="to fit beyond bias and matrix")
    reference_rate_deg_s: Rate | None = Field(
        None, description="where the nonlinearity is given; None: the largest of the rates"
    )
    latitude_deg: float | None = Field(None, ge=-90.0, le=90.0)
    azimuth_deg: float | None = Field(None, ge=-360.0, le=360.0, description="heading of the table's zero")
    orthogonality_sd_arcsec: Arcsec | None = Field(
        None, description="standard uncertainty of each of the table's two right angles"
    )
    pointing_sd_arcsec: Arcsec | None = Field(
        None, description="standard uncertainty of each axis' angle, independent at each stop"
    )
    cross_coupling_sd: float = Field(
        0.004,
        ge=0.0,
        le=0.5,
        description="expected of each cross-coupling, for the preview of a unit not yet calibrated",
    )
    make_calibration: bool = Field(
        False,
        description="true: bias and matrix become the unit's current calibration, of the gyro triad alone; its bias is "
        "coarser than that of a calibration at rest",
    )
    limits: Limits = Field(default_factory=lambda: Limits.model_validate({}))


class Result(Outcome):
    """The gyro triad's coefficients, the scale factor at each rate, and the verdict."""

    gyro: WholeTurns
    make_calibration: bool = False


def resolve(params: Params, context: Context) -> Params:
    """Return the parameters with ramps, site and table accuracy from the bench, and the reference rate from the
    rates.
    """
    site, accuracy = context.bench.site, context.bench.accuracy
    fastest = max(params.rates_deg_s)
    defaults = {
        "ramp_s": default_ramp_s(fastest, context.bench),
        "rest_s": rest_with_demands(REST_S, context.bench),
        "reference_rate_deg_s": fastest,
        "latitude_deg": site.latitude_deg,
        "azimuth_deg": site.azimuth_deg,
        "orthogonality_sd_arcsec": accuracy.orthogonality_sd_arcsec,
        "pointing_sd_arcsec": accuracy.pointing_sd_arcsec,
    }
    return params.filled(defaults)


def schedule(params: Params) -> tuple[Station, ...]:
    """Return the stations: axis x, y, z; for each every rate forth and back, one station each."""
    return _program(params).stations()


def predict(params: Params, context: Context) -> Prediction:
    """Return the duration, every coefficient's uncertainty, and whether 3σ of the scale factor comes within its limit.

    Raises `Undetermined` where the rates cannot separate the terms, `BadParameter` where the table cannot turn so.
    """
    params = resolve(params, context)
    require_rest("rest_s", params.rest_s, context.bench)
    require_possible("rates_deg_s", params.rates_deg_s, schedule(params), context.bench)
    plan = _plan(params, context)
    made = plan.estimator()
    duration_s, per_axis_s = bench_time_s(plan)
    if made is None:
        return Prediction(duration_s, (), ("the noise of the gyro triad is not known: nothing is predicted",))
    noise, total = made.noise_covariance.diagonal() ** 0.5, made.covariance.diagonal() ** 0.5
    table = (made.table_per_sd**2).sum(axis=1) ** 0.5
    parts = zip(coefficient_names(params.terms), total.tolist(), noise.tolist(), table.tolist(), strict=True)
    uncertainties = tuple(
        PredictedUncertainty(
            CoefficientName("gyro", name), "rad/s" if name.startswith("b_") else "1", sd, of_noise, of_table
        )
        for name, sd, of_noise, of_table in parts
    )
    basis = "whole turns; " + (
        "the unit's calibration" if context.unit.known_matrix("gyro") is not None else "nominal scale factors"
    )
    note = f"; bench time about each axis {', '.join(f'{a} {t:.0f} s' for a, t in zip(AXES, per_axis_s, strict=True))}"
    return Prediction(duration_s, uncertainties, _warnings(params, plan), basis + note)


async def acquire(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    """Move, settle, record while the table turns, station after station; yield the stream of each."""
    for station in stations:
        yield await steps.record_turn(bench, station)


def analyse(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    """Return the scale factors by generalised least squares over the integrated outputs of all stations. Raises
    `UnfitRecording`, `Undetermined`.
    """
    params = resolve(params, context)
    plan = _plan(params, context)
    found = analyse_turns(
        recordings,
        plan.site,
        plan.uncertainty,
        context.unit.gyro,
        params.terms,
        params.reference_rate_deg_s or max(params.rates_deg_s),
    )
    checks = _checks(found, params)
    return Result(
        checks=checks,
        verdict=verdict(checks),
        warnings=_warnings(params, plan) + launch_warnings(recordings),
        gyro=found,
        make_calibration=params.make_calibration,
    )


def calibrations(result: Result) -> tuple[TriadCalibration, ...]:
    """Return the calibration of the gyro triad where the parameters ask for it."""
    return (result.gyro.calibration,) if result.make_calibration else ()


def report(result: Result) -> Report:
    """Return the report: coefficients, scale factor over the rates, checks."""
    found = result.gyro
    figures, budgets = pictures.rate_figures(found), budget_tables("gyro", found.budgets)
    return Report(sections=(pictures.turns_table(found), *figures, *budgets, pictures.rate_table(found)))


def _program(params: Params) -> TurnProgram:
    if params.ramp_s is None or params.rest_s is None:
        raise BadParameter("ramp_s", None, "resolve the parameters first: ramps and rests come from the bench")
    return TurnProgram(params.rates_deg_s, params.turning_s, params.ramp_s, params.rest_s, params.settle_s)


def _plan(params: Params, context: Context) -> TurnPlan:
    site = _site(params, context)
    right, pointing = params.orthogonality_sd_arcsec or 0.0, params.pointing_sd_arcsec or 0.0
    level, azimuth = context.bench.accuracy.level_sd_arcsec, site.azimuth_sd_arcsec
    uncertainty = TableUncertainty(right, pointing, level, azimuth, latitude_sd_arcsec=site.latitude_sd_arcsec)
    reference = params.reference_rate_deg_s or max(params.rates_deg_s)
    return TurnPlan(
        _program(params),
        context.unit,
        context.bench.axis_motion,
        site,
        uncertainty,
        params.terms,
        reference * units.DEG,
        params.cross_coupling_sd,
    )


def _site(params: Params, context: Context) -> Site:
    return site_with(context.bench.site, params.latitude_deg, None, params.azimuth_deg, None)


def _warnings(params: Params, plan: TurnPlan) -> tuple[str, ...]:
    made = plan.estimator()
    coarse = None if made is None else too_coarse(plan, made, params.limits.scale_factor_3_sigma_ppm)
    if made is None:
        return ("the noise of the gyro triad is not known: uncertainties come from the residuals alone",)
    return () if coarse is None else (coarse,)


def planned_checks(params: Params, context: Context) -> tuple[PlannedCheck, ...]:
    """Return the planned checks of three standard uncertainties of each scale factor, and on the terms."""
    params = resolve(params, context)
    made = _plan(params, context).estimator()
    if made is None:
        return ()
    deviations_ppm = (made.covariance.diagonal() ** 0.5 / units.PPM).tolist()
    sd = dict(zip(coefficient_names(params.terms), deviations_ppm, strict=True))
    of_scale = largest(params.limits, "scale_factor_3_sigma_ppm", "ppm")
    found: list[PlannedCheck] = []
    for number, axis in enumerate(AXES, start=1):
        three = 3.0 * sd[f"K{number}{number}"]
        found.append(PlannedCheck(f"gyro scale factor {axis}, 3σ", of_scale, None, None, three))
        for term in params.terms:
            name, limit = _named(term, params.limits)
            found.append(PlannedCheck(f"gyro {name} {axis}", limit, sd[f"{term}_{axis}"]))
    return (*found, *planned_tests(params.limits, "residual_p_value_min", RESIDUALS))


def _named(term: Term, limits: Limits) -> tuple[str, Limit]:
    """Name of a term in its check, and its limit."""
    if term == "asymmetry":
        return "asymmetry", largest(limits, "asymmetry_ppm", "ppm", TERM_SOURCE)
    return f"nonlinearity, {term}", largest(limits, "nonlinearity_ppm", "ppm", TERM_SOURCE)


def _checks(found: WholeTurns, params: Params) -> tuple[Check, ...]:
    limits, ppm = params.limits, units.PPM
    of_scale = largest(limits, "scale_factor_3_sigma_ppm", "ppm")
    checks: list[Check] = []
    for number, axis in enumerate(AXES, start=1):
        k = found.coefficient(f"K{number}{number}")
        checks.append(check(f"gyro scale factor {axis}, 3σ", 3.0 * k.standard_uncertainty / ppm, of_scale))
        for term in params.terms:
            name, limit = _named(term, limits)
            c = found.coefficient(f"{term}_{axis}")
            checks.append(check(f"gyro {name} {axis}", abs(c.estimate) / ppm, limit, c.standard_uncertainty / ppm))
    if found.p_value is not None:
        checks.append(level_check(limits, "residual_p_value_min", RESIDUALS, found.p_value))
    return tuple(checks)


def quantities(params: Params, _context: Context) -> tuple[str, ...]:
    """Return the names of the checks and coefficients that a result will have."""
    terms = (_named(term, params.limits)[0] + " {}" for term in params.terms)
    checks = (f"gyro {name.format(axis)}" for name in ("scale factor {}, 3σ", *terms) for axis in AXES)
    return (*checks, RESIDUALS, *(f"gyro.{name}" for name in coefficient_names(params.terms)))


PROCEDURE = Procedure(
    *("scale_factor_whole_turns", "Gyro scale factor by whole turns", "1.2.0"),
    *(Params, Result, resolve, schedule, predict, acquire, analyse, report, calibrations),
    quantities=quantities,
    planned_checks=planned_checks,
)
