"""Thermal cycle: three launches in the chamber with x, y and z up, from a profile to a correction and its judgement.

Thesis 3.2 and 4.2, paper C. Each run is one launch of about twelve hours: the unit is set by hand, rests switched off,
and is recorded with all its temperature sensors while the chamber goes through soaks and ramps. A leg ends when the
*unit* has soaked, by the slopes of its own sensors. Profile, times and criterion are this program's own: the thesis has
its profile in a figure only.
"""

from collections.abc import AsyncIterator, Sequence
from dataclasses import replace
from typing import Literal

from pydantic import Field

from procedures import chamber_steps
from procedures.analysis.calibration.reference import site_with
from procedures.analysis.fitness.watched import each_watched
from procedures.analysis.thermal.cycle.analysis import KnownOfUnit, analyse_cycle
from procedures.analysis.thermal.cycle.checks import CycleLimits, cycle_checks, planned_cycle_checks
from procedures.analysis.thermal.cycle.results import ThermalCycle
from procedures.analysis.thermal.cycle.runs import CycleSettings
from procedures.analysis.thermal.cycle.series import run_of
from procedures.analysis.thermal.regime import RegimeSettings
from procedures.analysis.turns.plan import UPRIGHT
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core import units
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.frames import upward_axis
from procedures.core.limits import ASKED, verdict
from procedures.core.recording import AXES, Recording, Station
from procedures.core.report import Report
from procedures.core.temperature_profile import ProfileLeg, SoakCriterion, TemperatureProfile
from procedures.core.thermal_correction import Form
from procedures.core.unit_correction import CorrectionKind, UnitCorrection
from procedures.parameters import SupplyParameters
from procedures.procedure import STATIONS, Context, JudgedParameters, Outcome, Prediction, Procedure
from procedures.reports import thermal_figures, thermal_tables
from procedures.thermal_parameters import DEFAULT_LEGS, Leg, Limits, Regime, Soak

LEAST_OFF_S = 3.0 * units.HOUR
"""Least time switched off between runs, three hours (thesis 4.2.1)."""


class Params(JudgedParameters, SupplyParameters):
    """Profile, analysis and limits of the cycle."""

    legs: tuple[Leg, ...] = Field(DEFAULT_LEGS, min_length=1, max_length=100)
    soak: Soak = Field(default_factory=lambda: Soak.model_validate({}))
    unit_margin_c: float = Field(
        30.0, ge=1.0, le=300.0, description="a sensor further outside the targets' span ends the job"
    )
    power_off_s: float = Field(10_800.0, ge=1.0, le=604_800.0, description="before each run, the first too")
    sample_rate_hz: float = Field(100.0, ge=1.0, le=10_000.0)
    cell_s: float = Field(60.0, ge=1.0, le=600.0, description="cells that the fits work on")
    case_lag_s: float = Field(5.0, ge=0.0, le=600.0, description="time constant of the case sensor, by its data sheet")
    converter_lag_s: float | None = Field(
        None, ge=0.0, le=600.0, description="time constant of the converter's sensor; None: found from the readings"
    )
    lag_sd_s: float = Field(0.05, ge=0.0, le=600.0, description="standard uncertainty of each time constant")
    reference_case_c: float = Field(
        20.0, ge=-100.0, le=200.0, description="reading of the case sensor at which the correction does nothing"
    )
    reference_converter_c: float = Field(20.0, ge=-100.0, le=200.0)
    regime: Regime = Field(default_factory=lambda: Regime.model_validate({}))
    static_sensor: Literal["case", "gyros"] = Field(
        "case", description="of the static terms: the case's, or each axis' own gyro's (thesis 4.1)"
    )
    thermometers: Literal["current", "none"] = Field(
        "current", description="current: the unit's current calibration of its thermometers, where it has one"
    )
    form: Form = Field(Form.BOTH, description="which terms of thesis 4.1 act in which regime")
    correction: Literal["fit", "current"] = Field(
        "fit",
        description="fit: find a correction and judge it on the same cycle; current: judge the unit's current "
        "correction on this cycle, which it has not seen",
    )
    gyro_noise: Literal["cycle", "unit"] = Field(
        "cycle", description="noise that the gyros' dependence on temperature is tested against"
    )
    gyro_dependence: Literal["fail", "correct"] = Field(
        "fail",
        description="for a gyro that depends on temperature: fail it (thesis 4.2.3), or judge what a correction leaves "
        "in runs that the correction has not seen",
    )
    gyro_trim_s: float = Field(600.0, ge=0.0, le=86_400.0, description="start of a launch that gyros are not judged by")
    level: float = Field(0.01, gt=0.0, le=0.2, description="chance that a sound set of gyros is said to depend")
    confidence: float = Field(0.95, gt=0.5, lt=1.0, description="confidence level of the intervals")
    gravity_m_s2: float | None = Field(None, ge=9.7, le=9.9, description="None: the site's")
    limits: Limits = Field(default_factory=lambda: Limits.model_validate({}))

    def profile(self) -> TemperatureProfile:
        """Return the profile that the bench drives. Raises `BadParameter`."""
        legs = tuple(ProfileLeg(**leg.model_dump()) for leg in self.legs)
        return TemperatureProfile(legs, SoakCriterion(**self.soak.model_dump()), self.unit_margin_c)

    def settings(self) -> CycleSettings:
        """Return the settings of the numerics. Raises `BadParameter`."""
        return CycleSettings(
            cell_s=self.cell_s,
            case_lag_s=self.case_lag_s,
            converter_lag_s=self.converter_lag_s,
            static=self.static_sensor,
            lag_sd_s=self.lag_sd_s,
            reference_c=(self.reference_case_c, self.reference_converter_c),
            regime=RegimeSettings(**self.regime.model_dump()),
            gyro_trim_s=self.gyro_trim_s,
            level=self.level,
            confidence=self.confidence,
        )


class Result(Outcome):
    """Thermal correction, and the performance of it and of the gyros over temperature."""

    cycle: ThermalCycle


def resolve(params: Params, context: Context) -> Params:
    """Return the parameters with gravity at the site of the bench."""
    return params.filled({"gravity_m_s2": context.bench.site.gravity_m_s2})


def schedule(params: Params) -> tuple[Station, ...]:
    """Return the stations of the cycle, one a run, x, y and z up; `record_s` is the longest that it may take."""
    profile = params.profile()
    return tuple(
        Station(
            i,
            f"{axis} up",
            UPRIGHT[axis],
            record_s=profile.longest_s,
            power_off_s=params.power_off_s,
            temperatures=True,
            sample_rate_hz=params.sample_rate_hz,
            profile=profile,
            supply_voltage_v=params.supply_voltage_v,
        )
        for i, axis in enumerate(AXES)
    )


def predict(params: Params, context: Context) -> Prediction:
    """Return the duration and name what is missing. Raises `BadParameter` where the cycle could give nothing."""
    params.settings()
    _require_possible(params, context)
    basis = (
        "each soak begins with the end of its ramp, or when its least time is over; uncertainties of temperature "
        "coefficients are not predicted: they rest on how the unit's own temperatures part on ramps, which the cycle "
        "itself is to show"
    )
    return Prediction(
        len(AXES) * (params.power_off_s + params.profile().expected_s()), (), _warnings(params, context), basis
    )


async def acquire(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    """Switch off, set by hand, rest, switch on, record along the profile, run after run; yield the stream of each."""
    for station in stations:
        axis = station.label.split()[0]
        request = f"Open the chamber, set the unit with its {axis} axis upwards and level, close the door."
        yield await chamber_steps.record_profile(bench, station, request)


def analyse(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    """Read each run once, block by block; fit all of them together, and return the judged correction. Raises
    `UnfitRecording`, `MissingChannel`.
    """
    params = resolve(params, context)
    _require_correction(params, context)
    site = site_with(context.bench.site, None, params.gravity_m_s2, None, None)
    series = each_watched(run_of, recordings, lambda _, recording: (recording, _up(recording)))
    unit = context.unit
    calibration = unit.calibration("accelerometer")
    known = KnownOfUnit(
        unit.converter,
        calibration if calibration is not None and calibration.output_unit == "m/s^2" else None,
        unit.thermal_correction,
        None if unit.gyro is None else unit.gyro.noise,
        unit.thermometers if params.thermometers == "current" else None,
        None if unit.accelerometer is None else unit.accelerometer.noise,
    )
    cycle = analyse_cycle(
        *(series, params.settings(), params.form, site.gravity_m_s2, known),
        judge_current=params.correction == "current",
        noise_from_cycle=params.gyro_noise == "cycle",
    )
    checks = cycle_checks(cycle, _limits(params), correct_gyros=params.gyro_dependence == "correct")
    warnings = (*_withheld(context), *cycle.warnings)
    return Result(checks=checks, verdict=verdict(checks), warnings=warnings, cycle=cycle)


def corrections(result: Result) -> tuple[UnitCorrection, ...]:
    """Return the correction that was fitted, and one of gyros that depend on temperature; none where the unit's own was
    judged.
    """
    if result.cycle.judged != "fit":
        return ()
    gyros = result.cycle.gyro_correction
    accelerometers = UnitCorrection("thermal", result.cycle.correction)
    return (accelerometers,) if gyros is None else (accelerometers, UnitCorrection("gyros", gyros))


def uses_corrections(params: Params) -> tuple[CorrectionKind, ...]:
    """Return the kinds of corrections used: sensors and stage one first, and the unit's own for comparison.

    Where the unit's own is judged, stage one and sensors are those that it was fitted with: parts of it.
    """
    if params.correction == "current":
        return ("thermal",)
    return ("converter", "thermal", *(("thermometers",) if params.thermometers == "current" else ()))


def report(result: Result) -> Report:
    """Return the report with Tables 4.3 to 4.7 and figures 3.15 to 3.17 and 4.11 to 4.16 of the thesis, reworded."""
    cycle = result.cycle
    return Report(thermal_tables.summary(cycle), (*thermal_tables.tables(cycle), *thermal_figures.figures(cycle)))


def _withheld(context: Context) -> tuple[str, ...]:
    """Corrections of the unit that would have been used, and why they were not."""
    kinds: tuple[CorrectionKind, ...] = ("converter", "thermometers")
    return tuple(f"left out: {why}" for kind in kinds if (why := context.unit.why_withheld(kind)))


def _limits(params: Params) -> CycleLimits:
    given = [(params.limits, name) for name in type(params.limits).model_fields]
    sources = {name: ASKED for of, name in (*given, (params, "level")) if of.source_of(name) == ASKED}
    return CycleLimits(**params.limits.model_dump(), level=params.level, sources=sources)


def _up(recording: Recording) -> int:
    """The axis that stood upwards, by the station's attitude."""
    station = recording.info.station
    if station is None or station.angles is None:
        raise UnfitRecording(f"recording {recording.info.id}: the unit's attitude was not recorded")
    up = upward_axis(station.angles)
    if up is None:
        raise UnfitRecording(f"recording {recording.info.id}: no axis of the unit stood upwards")
    return up


def _require_possible(params: Params, context: Context) -> None:
    at = params.legs[0].target_c
    for number, leg in enumerate(params.legs):
        ramp_s = 60.0 * abs(leg.target_c - at) / leg.ramp_c_min
        if ramp_s + leg.least_soak_s > leg.longest_s:
            raise BadParameter(
                f"legs.{number}.longest_s", leg.longest_s, f"at least {ramp_s + leg.least_soak_s:g}, its ramp and soak"
            )
        at = leg.target_c
    if len({leg.target_c for leg in params.legs}) < 3:
        raise BadParameter(
            "legs", [leg.target_c for leg in params.legs], "three temperatures at least, for polynomials of order two"
        )
    _require_correction(params, context)


def _require_correction(params: Params, context: Context) -> None:
    if params.correction == "current" and context.unit.thermal_correction is None:
        why = context.unit.why_withheld("thermal")
        own = why or (
            f"unit {context.unit.serial} has no current thermal correction to judge; one that failed counts only where "
            "it is chosen"
        )
        raise BadParameter("correction", "current", own)


def _warnings(params: Params, context: Context) -> tuple[str, ...]:
    found: list[str] = list(_withheld(context))
    if params.power_off_s < LEAST_OFF_S:
        found.append(
            f"power_off_s = {params.power_off_s:g}: the unit may not be at rest; the thesis leaves it off for 3 h"
        )
    if context.unit.converter is None:
        found.append("no model of the unit's signal converter is known: stage one will be left out")
    if context.unit.calibration("accelerometer") is None:
        found.append("the unit has no calibration: the forces will be those of an ideal, level seat")
    if params.form is not Form.BOTH:
        found.append(f"form {params.form.value!r} is an older model: it leaves what only both sensors together explain")
    return tuple(found)


PROCEDURE = Procedure(
    *("thermal_cycle", "Thermal cycle", "1.2.0"),
    *(Params, Result, resolve, schedule, predict, acquire, analyse, report),
    uses_calibration=("accelerometer",),
    corrections=corrections,
    uses_corrections=uses_corrections,
    quantities=lambda params, _: tuple(one.check for one in planned_cycle_checks(_limits(params))),
    planned_checks=lambda params, _: planned_cycle_checks(_limits(params)),
    inspection=lambda _: replace(STATIONS, temperatures=True),
)
