"""Calibration of the unit's temperature sensors against the chamber, at soaks with the unit switched off.

Thesis 4.2 takes its thermometers as calibrated beforehand and does not say how; this is this program's own way. A unit
that is on is warmer than its air by what it heats itself, so every soak is a cold start: hours off at a temperature,
then two minutes on, brought back to the moment of switching on (`analysis.thermal.thermometers`).
"""

from collections.abc import AsyncIterator, Sequence

import numpy as np
from pydantic import Field

from procedures import chamber_steps
from procedures.analysis.fitness.watched import Inspection
from procedures.analysis.thermal.profile_progress import SENSORS
from procedures.analysis.thermal.thermometers import Calibrated, Soaked, SoakSettings, both_ways, calibrate, read_soaks
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core.errors import BadParameter
from procedures.core.limits import SIGNIFICANCE, Check, Limit, PlannedCheck, check, significance, verdict
from procedures.core.recording import Recording, Station
from procedures.core.report import Report
from procedures.core.temperature_profile import ProfileLeg, SoakCriterion, TemperatureProfile
from procedures.core.unit_correction import UnitCorrection
from procedures.parameters import largest
from procedures.procedure import (
    STATIONS,
    Context,
    JudgedParameters,
    Outcome,
    Parameters,
    PredictedUncertainty,
    Prediction,
    Procedure,
)
from procedures.reports.thermometers import thermometer_report

WORTH_SAYING_C = 0.02
"""A rest of a step that the unit has not followed is worth a warning beyond this [°C]."""
EXPECTED_READING_SD_C = 0.02
"""Standard uncertainty of a cold start's reading that a preview assumes; a result has the one that it found [°C]."""


class Limits(Parameters):
    """Requirements on the sensors (all this program's own)."""

    offset_c: float = Field(2.0, gt=0.0, le=100.0, description="|reading less temperature| at the reference")
    slope: float = Field(0.02, gt=0.0, le=0.5, description="|change of that| a °C")
    level: float = Field(0.01, gt=0.0, le=0.2, description="chance that a sound set fails the tests of line or path")


class Params(JudgedParameters):
    """Soaks, accuracy of the comparison, and limits."""

    temperatures_c: tuple[float, ...] = Field(
        (-40.0, -10.0, 20.0, 60.0, 20.0, -10.0),
        min_length=3,
        max_length=100,
        description="in this order; one that is reached from below and from above shows hysteresis",
    )
    ramp_c_min: float = Field(2.0, ge=0.01, le=100.0)
    soak_s: float = Field(21_600.0, ge=60.0, le=604_800.0, description="switched off at each temperature")
    time_constant_s: float = Field(
        2200.0,
        ge=1.0,
        le=86_400.0,
        description="slowest thermal time constant of the unit, from which the rest after the soak is computed",
    )
    air_within_c: float = Field(1.5, ge=0.01, le=100.0, description="chamber's air about the target at its end")
    record_s: float = Field(120.0, ge=30.0, le=600.0, description="from switching on")
    sample_rate_hz: float = Field(100.0, ge=1.0, le=10_000.0)
    sensor_lag_s: float = Field(5.0, ge=0.0, le=600.0, description="time constant of the sensors, by their data sheet")
    sensor_lag_sd_s: float = Field(1.0, ge=0.0, le=600.0)
    reference_c: float = Field(20.0, ge=-100.0, le=200.0, description="offsets are those at this reading")
    place_sd_c: float | None = Field(
        None,
        ge=0.0,
        le=100.0,
        description="standard uncertainty of the air at the unit against the chamber's reading, the same at each soak; "
        "None: the bench's",
    )
    soak_sd_c: float | None = Field(
        None,
        ge=0.0,
        le=100.0,
        description="standard uncertainty of the same difference, independent at each soak; None: the bench's",
    )
    limits: Limits = Field(default_factory=lambda: Limits.model_validate({}))

    def settings(self) -> SoakSettings:
        """Return the settings of the numerics. Raises `BadParameter` where the chamber's accuracy is not known."""
        if self.place_sd_c is None or self.soak_sd_c is None:
            raise BadParameter(
                "place_sd_c",
                self.place_sd_c,
                "known: declare the chamber's accuracy in the bench file, [chamber] accuracy = { place_sd_c = …, "
                "soak_sd_c = … }, or give place_sd_c and soak_sd_c",
            )
        return SoakSettings(
            *(self.place_sd_c, self.soak_sd_c, self.sensor_lag_s, self.sensor_lag_sd_s),
            *(self.soak_s, self.time_constant_s, self.reference_c),
        )


class Result(Outcome):
    """Calibration of the unit's thermometers."""

    thermometers: Calibrated
    target_c: tuple[float, ...]
    air_c: tuple[float, ...]
    """Chamber's own readings at the soaks."""


def resolve(params: Params, context: Context) -> Params:
    """Return the parameters with the chamber's accuracy as the bench declares it."""
    known = context.bench.chamber_accuracy
    return params if known is None else params.filled({"place_sd_c": known.place_sd_c, "soak_sd_c": known.soak_sd_c})


def schedule(params: Params) -> tuple[Station, ...]:
    """Return one station a soak; each is a launch. Raises `BadParameter` for a temperature twice in a row, or fewer
    than 3.
    """
    pairs = zip(params.temperatures_c, params.temperatures_c[1:], strict=False)
    if any(a == b for a, b in pairs) or len(set(params.temperatures_c)) < 3:
        raise BadParameter(
            "temperatures_c", params.temperatures_c, "three different temperatures at least, none twice in a row"
        )
    stations: list[Station] = []
    for index, target in enumerate(params.temperatures_c):
        leg = ProfileLeg(target, params.ramp_c_min, 0.0, max(60.0, params.soak_s))
        stations.append(
            Station(
                index,
                f"cold start at {target:g} °C",
                None,
                target,
                0.0,
                params.record_s,
                params.soak_s,
                temperatures=True,
                sample_rate_hz=params.sample_rate_hz,
                profile=TemperatureProfile((leg,), SoakCriterion(air_within_c=params.air_within_c)),
            )
        )
    return tuple(stations)


def predict(params: Params, context: Context) -> Prediction:
    """Return duration and uncertainties. Raises `BadParameter` where the chamber's accuracy is not known."""
    settings, targets = params.settings(), np.array(params.temperatures_c)
    sd = np.full((len(SENSORS), len(targets)), EXPECTED_READING_SD_C)
    expected = calibrate(Soaked(SENSORS, targets, targets, np.tile(targets, (len(SENSORS), 1)), sd), settings)
    found: list[PredictedUncertainty] = []
    for s in expected.sensors:
        found.append(PredictedUncertainty(f"{s.channel}.offset", "degC", s.offset_sd_c, s.offset_sd_c))
        found.append(PredictedUncertainty(f"{s.channel}.slope", "1", s.slope_sd, s.slope_sd))
    duration_s = len(targets) * (params.soak_s + params.record_s)
    basis = f"the chamber's accuracy, and {EXPECTED_READING_SD_C:g} °C for the reading of a cold start"
    return Prediction(duration_s, tuple(found), _warnings(params, settings), basis)


async def acquire(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    """Switch off, soak, switch on, record the first moments, temperature after temperature; yield the stream of
    each.
    """
    for station in stations:
        yield await chamber_steps.record_cold_start(bench, station)


def analyse(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    """Return a line for each sensor, from readings at the moment of switching on against the chamber's air. Raises
    `UnfitRecording`.
    """
    params = resolve(params, context)
    settings = params.settings()
    soaked = read_soaks(recordings, settings)
    found = calibrate(soaked, settings)
    checks = tuple(_checks(found, params.limits))
    return Result(
        checks=checks,
        verdict=verdict(checks),
        warnings=_warnings(params, settings),
        thermometers=found,
        target_c=tuple(soaked.target_c.tolist()),
        air_c=tuple(soaked.air_c.tolist()),
    )


def planned_checks(params: Params, _context: Context) -> tuple[PlannedCheck, ...]:
    """Return the tests of significance that a result will have, each with the chance that a sound unit fails it."""
    level, source = params.limits.level, params.limits.source_of("level", SIGNIFICANCE)
    each = Limit("1", minimum=level / len(SENSORS), source=source)
    found = [PlannedCheck(f"{name} {LINE}", each, level=level / len(SENSORS)) for name in SENSORS]
    pairs = len(SENSORS) * len(both_ways(params.temperatures_c))
    if pairs:
        found.append(PlannedCheck(PATH, Limit("1", minimum=level / pairs, source=source), level=level))
    return tuple(found)


LINE, PATH = "is a straight line, p-value", "up against down, p-value"
"""Names of the tests of significance; the first after its sensor's."""


def _checks(found: Calibrated, limits: Limits) -> list[Check]:
    checks: list[Check] = []
    for s in found.sensors:
        offset, slope = largest(limits, "offset_c", "degC"), largest(limits, "slope", "1")
        checks.append(check(f"{s.channel} offset", abs(s.offset_c), offset, s.offset_sd_c))
        checks.append(check(f"{s.channel} slope", abs(s.slope), slope, s.slope_sd))
    # Bonferroni: several sensors, and several pairs, one chance.
    level, source = limits.level / len(found.sensors), limits.source_of("level", SIGNIFICANCE)
    checks += [significance(f"{s.channel} {LINE}", s.p_value, level, source=source) for s in found.sensors]
    if found.hysteresis:
        worst = min(found.hysteresis, key=lambda h: h.p_value)
        note = f"worst: {worst.channel} at {worst.target_c:g} °C"
        checks.append(significance(PATH, worst.p_value, limits.level / len(found.hysteresis), note, source))
    return checks


def _warnings(params: Params, settings: SoakSettings) -> tuple[str, ...]:
    steps_c = np.abs(np.diff([params.reference_c, *params.temperatures_c]))
    rest = float(settings.unsoaked_c(steps_c).max())
    if rest <= WORTH_SAYING_C:
        return ()
    return (
        f"soak_s = {params.soak_s:g} leaves up to {rest:.2g} °C of a step in a unit with a time constant of "
        f"{params.time_constant_s:g} s; it is part of the uncertainties: a longer soak makes them smaller",
    )


def corrections(result: Result) -> tuple[UnitCorrection, ...]:
    """Return the correction set of the thermometers for the unit's history."""
    return (UnitCorrection("thermometers", result.thermometers.correction),)


def report(result: Result) -> Report:
    """Return the report: offsets and slopes, errors at the soaks, up against down, and the lines with the data."""
    return thermometer_report(result.thermometers, result.target_c, result.air_c)


def quantities(params: Params, context: Context) -> tuple[str, ...]:
    """Return the names of the checks that a result will have."""
    each = [f"{name} {of}" for name in SENSORS for of in ("offset", "slope")]
    return (*each, *(f"{name} is a straight line, p-value" for name in SENSORS))


PROCEDURE = Procedure(
    *("thermometer_calibration", "Calibration of the unit's thermometers", "1.1.0"),
    *(Params, Result, resolve, schedule, predict, acquire, analyse, report),
    corrections=corrections,
    quantities=quantities,
    planned_checks=planned_checks,
    # Only the sensors count, and a set point that stands still is as it should be: `read_soaks` looks at them.
    inspection=lambda _: Inspection(STATIONS.settings, channels=()),
)
