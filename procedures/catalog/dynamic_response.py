"""Delay of the gyros' stamps against the table's encoder, and their bandwidth, by sinusoids of the table.

Each axis of the unit in turn points upwards, along the table's outer axis, which swings at several frequencies while
the unit and the encoders are recorded. Least squares at the known frequency gives the complex amplitude of both; their
ratio over the frequencies gives gain, delay and a first-order lag. The motion is the encoders', not the demand's, so
the lag of the table's servo does not count. The accelerometers are recorded but not judged.
"""

from collections.abc import AsyncIterator, Sequence
from math import hypot, sqrt
from typing import Annotated

from pydantic import Field

from procedures import sinusoids
from procedures.analysis.calibration.station_plan import windows
from procedures.analysis.fitness.findings import FitnessSettings
from procedures.analysis.fitness.watched import Inspection
from procedures.analysis.response.fit import PARAMETERS
from procedures.analysis.response.plan import (
    Axis,
    EncoderQuality,
    ResponseProgram,
    largest_amplitude_deg,
    predicted_lags,
)
from procedures.analysis.response.summary import ChannelResponse, DynamicResponse, analyse_response
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core import units
from procedures.core.errors import BadParameter
from procedures.core.limits import ASKED, SIGNIFICANCE, Check, Limit, PlannedCheck, check, verdict
from procedures.core.recording import AXES, GYRO, Recording, Station
from procedures.core.report import Report
from procedures.parameters import level_check
from procedures.procedure import (
    Context,
    JudgedParameters,
    Outcome,
    Parameters,
    PredictedUncertainty,
    Prediction,
    Procedure,
)
from procedures.reports.response import response_report
from procedures.table_motion import require_possible

Frequency = Annotated[float, Field(ge=0.01, le=1000.0)]
Amplitude = Annotated[float, Field(gt=0.0, le=180.0)]
HIGHEST_SHARE = 0.4
"""Largest frequency as a share of the sample rate; at half of it samples no longer determine a sinusoid."""
MOST_WITHIN_S = 100.0
"""Largest half interval of a reading, that of the slowest reading [s]."""


class Limits(Parameters):
    """Requirements on the unit, where there are any, and on the measurement (this program's own)."""

    delay_ms: float | None = Field(None, gt=0.0, le=1e4, description="largest magnitude of the delay; None: not judged")
    bandwidth_hz: float | None = Field(None, gt=0.0, le=1e5, description="least bandwidth; None: not judged")
    stamp_scatter_ms: float | None = Field(
        None, gt=0.0, le=1e4, description="largest scatter of the delay from recording to recording; None: not judged"
    )
    residual_p_value_min: float = Field(
        0.001, ge=0.0, le=1.0, description="smallest p-value accepted for the chi-square of the residuals"
    )


class Params(JudgedParameters):
    """Frequencies and amplitudes of the sinusoids, and limits of the unit. None takes the bench's value."""

    axes: tuple[Axis, ...] = Field(("x", "y", "z"), min_length=1, max_length=3, description="axes of the unit")
    frequencies_hz: tuple[Frequency, ...] = Field(
        (0.5, 1.0, 2.0, 4.0, 6.0, 8.0), min_length=PARAMETERS, max_length=50, description="rising, each once"
    )
    amplitudes_deg: tuple[Amplitude, ...] | None = Field(
        None, max_length=50, description="one a frequency; None: 0.8 of what rate and acceleration allow, at most 5 deg"
    )
    record_s: float = Field(
        20.0, ge=1.0, le=3600.0, description="least length of a recording; ten cycles are the least"
    )
    slack_s: float = Field(
        2.0, ge=0.0, le=600.0, description="time of the sinusoid after its recording: samples may come late"
    )
    settle_s: float = Field(2.0, ge=0.0, le=3600.0)
    linearity_ppm: float = Field(
        50.0, ge=0.0, le=1e5, description="standard uncertainty of the gyros' gain from one rate to another"
    )
    encoder_time_sd_s: float = Field(
        0.0, ge=0.0, le=1.0, description="standard uncertainty of the readings' times that all have in common"
    )
    encoder_sd_arcsec: float = Field(
        0.1, gt=0.0, le=3600.0, description="standard deviation of one reading, for the preview alone"
    )
    encoder_rate_hz: float = Field(
        50.0, ge=0.5 / MOST_WITHIN_S, le=1e5, description="readings a second, for the preview alone"
    )
    encoder_within_s: float | None = Field(
        None,
        ge=0.0,
        le=MOST_WITHIN_S,
        description="half the interval in which a reading is taken, for the preview alone; null: half the time from "
        "one reading to the next, 0 for a table that is simulated in process, whose readings are exact",
    )
    limits: Limits = Field(default_factory=lambda: Limits.model_validate({}))


class Result(Outcome):
    """Delay and bandwidth of each gyro channel, and the verdict."""

    gyro: DynamicResponse


def resolve(params: Params, context: Context) -> Params:
    """Return the parameters with amplitudes from the limits of the outer axis, and the interval of a reading from its
    rate.
    """
    outer = context.bench.outer
    amplitudes = tuple(
        float(f"{largest_amplitude_deg(f, outer.rate_deg_s, outer.acceleration_deg_s2):.4g}")
        for f in params.frequencies_hz
    )
    over_a_line = any(device.name == "turntable" and device.address for device in context.bench.devices)
    within_s = 0.5 / params.encoder_rate_hz if over_a_line else 0.0
    return params.filled({"amplitudes_deg": amplitudes, "encoder_within_s": within_s})


def schedule(params: Params) -> tuple[Station, ...]:
    """Return the stations, axis after axis, frequency after frequency, one each. Raises `BadParameter`."""
    return _program(params).stations()


def predict(params: Params, context: Context) -> Prediction:
    """Return the duration, and the uncertainty of each channel's delay and gain for a unit without a lag.

    Raises `BadParameter` where the table cannot swing so, or the unit's samples cannot show it.
    """
    params = resolve(params, context)
    program = _program(params)
    stations = program.stations()
    _require_shown(params, context.unit.sample_rate_hz)
    require_possible("amplitudes_deg", params.amplitudes_deg, stations, context.bench)
    duration_s = float(windows(stations, context.bench.axis_motion)[-1, 1]) + program.beyond_stations_s()
    if context.unit.gyro is None:
        return Prediction(duration_s, (), ("the noise of the gyro triad is not known: nothing is predicted",))
    linearity = params.linearity_ppm * units.PPM
    noise, rate_hz = context.unit.gyro.noise, context.unit.sample_rate_hz
    encoder = EncoderQuality(params.encoder_sd_arcsec, params.encoder_rate_hz)
    within_s = params.encoder_within_s or 0.0
    time_sd_s = hypot(within_s / sqrt(3.0), params.encoder_time_sd_s)
    whole = predicted_lags(program, noise, rate_hz, encoder, linearity)
    alone = predicted_lags(program, noise, rate_hz, None, linearity)
    found: list[PredictedUncertainty] = []
    for axis, lag, of_gyro in zip(params.axes, whole, alone, strict=True):
        sd, noise_sd = hypot(lag.delay_sd_s, time_sd_s), of_gyro.delay_sd_s
        rest = sqrt(max(0.0, sd**2 - noise_sd**2))
        found.append(PredictedUncertainty(f"gyro.delay_{axis}", "s", sd, noise_sd, rest, DELAY.format(axis)))
        gain, of_noise = sqrt(lag.covariance[0, 0]), sqrt(of_gyro.covariance[0, 0])
        rest = sqrt(max(0.0, gain**2 - of_noise**2))
        found.append(PredictedUncertainty(f"gyro.gain_{axis}", "1", gain, of_noise, rest))
    least = min(lag.bandwidth_above_hz for lag in whole)
    basis = (
        f"noise of the unit's record and an encoder of {params.encoder_sd_arcsec:g} arcsec read "
        f"{params.encoder_rate_hz:g} times a second, each reading taken within ±{1e3 * within_s:g} ms, alike for all; "
        f"of a unit without a lag the result would be a bandwidth above {least:.3g} Hz; "
        "stamps that scatter from recording to recording are not predicted"
    )
    return Prediction(duration_s, tuple(found), (), basis)


async def acquire(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    """Move, settle, swing, record unit and encoder, station after station; yield the stream of each."""
    for station in stations:
        yield await sinusoids.record_sinusoid(bench, station)


def analyse(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    """Return delay and bandwidth of each gyro channel, with checks. Raises `UnfitRecording`, `MissingChannel`."""
    record = context.unit.gyro
    noise = {} if record is None else dict(zip(GYRO, record.noise, strict=True))
    found = analyse_response(recordings, noise, params.linearity_ppm * units.PPM, params.encoder_time_sd_s)
    checks = _checks(found, params.limits)
    warnings = found.warnings + tuple(w for c in found.channels for w in _against_data_sheet(c, context))
    return Result(checks=checks, verdict=verdict(checks), warnings=warnings, gyro=found)


def report(result: Result) -> Report:
    """Return the report: delays, gain and phase over the frequencies."""
    return response_report(result.gyro)


def inspection(_params: Params) -> Inspection:
    """Return the settings of the inspection for recordings that swing: only the gyros' channels are inspected."""
    return Inspection(FitnessSettings(at_rest=False, counters_may_rest=True), channels=GYRO)


def _program(params: Params) -> ResponseProgram:
    if params.amplitudes_deg is None:
        raise BadParameter("amplitudes_deg", None, "resolve the parameters first: the amplitudes come from the bench")
    if len(params.amplitudes_deg) != len(params.frequencies_hz):
        allowed = f"one amplitude for each of the {len(params.frequencies_hz)} frequencies"
        raise BadParameter("amplitudes_deg", params.amplitudes_deg, allowed)
    if list(params.frequencies_hz) != sorted(set(params.frequencies_hz)):
        raise BadParameter("frequencies_hz", params.frequencies_hz, "rising, each once")
    if len(set(params.axes)) != len(params.axes):
        raise BadParameter("axes", params.axes, "each axis once")
    return ResponseProgram(
        *(params.axes, params.frequencies_hz, params.amplitudes_deg),
        *(params.record_s, params.slack_s, params.settle_s),
    )


def _require_shown(params: Params, sample_rate_hz: float) -> None:
    """Refuse frequencies that the unit's samples cannot show."""
    most_hz = HIGHEST_SHARE * sample_rate_hz
    if params.frequencies_hz[-1] > most_hz:
        allowed = f"at most {most_hz:g} Hz, {HIGHEST_SHARE:g} of the unit's sample rate of {sample_rate_hz:g} Hz"
        raise BadParameter("frequencies_hz", params.frequencies_hz[-1], allowed)


DELAY, BANDWIDTH = "gyro {} delay", "gyro {} bandwidth"
RESIDUALS, SCATTER = "gyro {} residuals, p-value of chi-square", "scatter of the stamps"


def _limit(unit: str, maximum: float | None = None, minimum: float | None = None) -> Limit:
    return Limit(unit, maximum, minimum, ASKED)


def quantities(params: Params, _context: Context) -> tuple[str, ...]:
    """Return the names of the checks that a result will have."""
    limits = params.limits
    wanted = [DELAY] * (limits.delay_ms is not None) + [BANDWIDTH] * (limits.bandwidth_hz is not None) + [RESIDUALS]
    named = tuple(name.format(axis) for axis in params.axes for name in wanted)
    return named if limits.stamp_scatter_ms is None else (*named, SCATTER)


def planned_checks(params: Params, context: Context) -> tuple[PlannedCheck, ...]:
    """Return the planned checks on the delays, with the plan's uncertainties, and on residuals."""
    limits, made = params.limits, list[PlannedCheck]()
    sd = {u.quantity: u.standard_uncertainty for u in predict(params, context).uncertainties}
    level = limits.residual_p_value_min
    for axis in params.axes:
        name = DELAY.format(axis)
        if limits.delay_ms is not None and name in sd:
            made.append(PlannedCheck(name, _limit("ms", limits.delay_ms), 1e3 * sd[name]))
        limit = Limit("1", minimum=level, source=limits.source_of("residual_p_value_min", SIGNIFICANCE))
        made.append(PlannedCheck(RESIDUALS.format(axis), limit, level=level))
    return tuple(made)


def _checks(found: DynamicResponse, limits: Limits) -> tuple[Check, ...]:
    made: list[Check] = []
    for c in found.channels:
        axis = AXES[GYRO.index(c.channel)]
        if limits.delay_ms is not None:
            sd = 1e3 * c.delay_standard_uncertainty_s
            limit, freedom = _limit("ms", limits.delay_ms), c.delay_degrees_of_freedom
            made.append(check(DELAY.format(axis), 1e3 * abs(c.delay_s), limit, sd, degrees_of_freedom=freedom))
        if limits.bandwidth_hz is not None:
            limit, note = _limit("Hz", minimum=limits.bandwidth_hz), "not reached: a limit that holds with 95 %"
            if c.bandwidth_hz is None:
                made.append(check(BANDWIDTH.format(axis), c.bandwidth_above_hz, limit, note=note))
            else:
                sd_hz = c.bandwidth_standard_uncertainty_hz
                made.append(check(BANDWIDTH.format(axis), c.bandwidth_hz, limit, sd_hz))
        if c.p_value is not None:
            made.append(level_check(limits, "residual_p_value_min", RESIDUALS.format(axis), c.p_value))
    if limits.stamp_scatter_ms is not None:
        made.append(check(SCATTER, 1e3 * found.stamp_scatter_s, _limit("ms", limits.stamp_scatter_ms)))
    return tuple(made)


def _against_data_sheet(c: ChannelResponse, context: Context) -> tuple[str, ...]:
    """Warning where a delay is not the declared one, by more than three standard uncertainties."""
    declared = context.unit.declaration
    lag_s = None if declared is None else declared.lags_s.get(c.channel)
    if lag_s is None or abs(c.delay_s - lag_s) <= 3.0 * c.delay_standard_uncertainty_s:
        return ()
    return (
        f"{c.channel}: the delay of {1e3 * c.delay_s:.4g} ± {1e3 * c.delay_standard_uncertainty_s:.2g} ms is not the "
        f"data sheet's {1e3 * lag_s:.4g} ms",
    )


PROCEDURE = Procedure(
    *("dynamic_response", "Delay and bandwidth of the gyros by sinusoidal motion", "1.0.0"),
    *(Params, Result, resolve, schedule, predict, acquire, analyse, report),
    quantities=quantities,
    planned_checks=planned_checks,
    inspection=inspection,
)
