"""Zero and scale of the signal converter alone over temperature, before assembly (thesis 3.2.2; paper C).

A precision source gives equal and opposite currents to all three channels at every soak of a chamber; mean codes give
zero and scale (thesis 3.10–3.13), and these the normalised functions Fs and Fc that are the first stage of a thermal
compensation. A soak is over by the converter's own sensor. Currents, temperatures and times are this program's own.
"""

from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field

from procedures import chamber_steps
from procedures.analysis.thermal.converter_bench import FittedChannel, fit_channels, read_soaks
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.converter import ConverterModel, ConverterTriad
from procedures.core.errors import BadParameter
from procedures.core.limits import Check, PlannedCheck, check, verdict
from procedures.core.recording import AXES, Recording, Station
from procedures.core.report import Figure, Report, Series, Table
from procedures.core.temperature_profile import ProfileLeg, SoakCriterion, TemperatureProfile
from procedures.core.unit_correction import UnitCorrection
from procedures.parameters import largest
from procedures.procedure import STATIONS, Context, JudgedParameters, Outcome, Parameters, Prediction, Procedure

TEMPERATURES_C = tuple(float(t) for t in range(-40, 61, 10))


class Limits(Parameters):
    """Requirements on the converter and on the residuals of its functions (all this program's own)."""

    zero_codes: float = Field(100.0, gt=0.0, le=1e6, description="|zero| at the reference")
    zero_change_codes: float = Field(20.0, gt=0.0, le=1e6, description="largest change of zero in the range (C's Δmax)")
    scale_change_ppm: float = Field(2000.0, gt=0.0, le=1e6, description="largest change of scale in the range")
    zero_residual_codes: float = Field(0.1, gt=0.0, le=1e6, description="spread about Fs")
    scale_residual_ppm: float = Field(5.0, gt=0.0, le=1e6, description="spread about Fc")


class Params(JudgedParameters):
    """Currents, soaks, and limits of the converter."""

    current_ma: float = Field(10.0, gt=0.0, le=1000.0, description="given with either sign")
    temperatures_c: tuple[float, ...] = Field(TEMPERATURES_C, min_length=5, max_length=100)
    ramp_c_min: float = Field(2.0, ge=0.01, le=100.0)
    slope_c_min: float = Field(0.02, ge=1e-4, le=10.0, description="most that the converter's sensor may drift")
    window_s: float = Field(300.0, ge=60.0, le=86_400.0, description="window of the line whose slope that is")
    air_within_c: float = Field(1.5, ge=0.01, le=100.0, description="chamber's air about the target")
    longest_s: float = Field(14_400.0, ge=60.0, le=604_800.0, description="with no soak by then the job fails")
    settle_s: float = Field(2.0, ge=0.0, le=3600.0)
    record_s: float = Field(60.0, ge=1.0, le=86_400.0)
    sample_rate_hz: float = Field(100.0, ge=1.0, le=4000.0, description="the converter's cycles a second")
    reference_c: float = Field(20.0, ge=-100.0, le=200.0, description="reading of its sensor where Fc = 1, Fs = 0")
    order: int | None = Field(None, ge=1, le=6, description="order of Fc and Fs; None: by F tests at a level of 0.01")
    gain_sd_ppm: float | None = Field(
        None, ge=0.0, le=1e6, description="standard uncertainty of the source's gain; None: as the bench declares"
    )
    zero_sd_ma: float | None = Field(None, ge=0.0, le=1e3, description="standard uncertainty of the source's zero")
    limits: Limits = Field(default_factory=lambda: Limits.model_validate({}))


@dataclass(frozen=True)
class ChannelResult:
    """Result of one channel: its model, the fitted data, and how the orders were chosen."""

    name: str
    model: ConverterModel
    target_c: tuple[float, ...]
    sensor_c: tuple[float, ...]
    scale_code_per_ma: tuple[float, ...]
    zero_code: tuple[float, ...]
    zero_ma: tuple[float, ...]
    """Zero at the input of thesis 3.13."""
    scale_bic: tuple[float, ...]
    zero_bic: tuple[float, ...]
    scale_p_values: tuple[float, ...] = ()
    """F tests of order 2 against 1, 3 against 2; empty in results of older versions, whose order had the least BIC."""
    zero_p_values: tuple[float, ...] = ()


class Result(Outcome):
    """Models of the three channels."""

    channels: tuple[ChannelResult, ChannelResult, ChannelResult]


def resolve(params: Params, context: Context) -> Params:
    """Return the parameters with the current source's accuracy as the bench declares it."""
    source = context.bench.current_source
    if source is None:
        return params
    return params.filled({"gain_sd_ppm": source.gain_sd_ppm, "zero_sd_ma": source.zero_sd_ma})


def schedule(params: Params) -> tuple[Station, ...]:
    """Return two stations a soak: plus and minus the current. Raises `BadParameter` for a temperature that is named
    twice.
    """
    if len(set(params.temperatures_c)) < len(params.temperatures_c):
        raise BadParameter("temperatures_c", params.temperatures_c, "each temperature once")
    stations: list[Station] = []
    for target in params.temperatures_c:
        leg = ProfileLeg(target, params.ramp_c_min, 0.0, params.longest_s)
        profile = TemperatureProfile((leg,), SoakCriterion(params.slope_c_min, params.window_s, params.air_within_c))
        for current in (params.current_ma, -params.current_ma):
            stations.append(
                Station(
                    len(stations),
                    f"{target:g} °C, {current:+g} mA",
                    None,
                    target,
                    params.settle_s,
                    params.record_s,
                    temperatures=True,
                    sample_rate_hz=params.sample_rate_hz,
                    current_ma=current,
                    profile=profile,
                )
            )
    return tuple(stations)


SOAK_GUESS_S = 5400.0
"""Time that a converter in its case takes to drift by no more than the default criterion: case and board follow with
some ten minutes each. Only for previews."""


def predict(params: Params, context: Context) -> Prediction:
    """Return a rough duration; the uncertainty of the functions depends on noise that is not declared."""
    params = resolve(params, context)
    reach = np.abs(
        np.diff([context.bench.chamber.ambient_c if context.bench.chamber else 20.0, *params.temperatures_c])
    )
    ramps_s = float(np.sum(reach)) / params.ramp_c_min * 60.0
    stay_s = len(params.temperatures_c) * (SOAK_GUESS_S + params.window_s + 2.0 * (params.record_s + params.settle_s))
    warnings: list[str] = []
    if not min(params.temperatures_c) <= params.reference_c <= max(params.temperatures_c):
        warnings.append(f"the reference, {params.reference_c:g} °C, is outside the soaks: Fc and Fs are extrapolated")
    return Prediction(ramps_s + stay_s, (), tuple(warnings), "soaks as long as a converter in its case usually takes")


async def acquire(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    """Set the current, soak, record, station after station; yield the stream of each."""
    for station in stations:
        yield await chamber_steps.record_current(bench, station)


def analyse(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    """Return zero and scale at each soak, and their normalised functions over temperature. Raises `UnfitRecording`."""
    params = resolve(params, context)
    soaks = read_soaks(recordings, params.current_ma)
    gain, zero = params.gain_sd_ppm or 0.0, params.zero_sd_ma or 0.0
    fitted = fit_channels(soaks, params.current_ma, params.reference_c, params.order, gain, zero)
    x, y, z = (_channel(name, f, soaks.target_c.tolist()) for name, f in zip(AXES, fitted, strict=True))
    checks = tuple(c for channel in (x, y, z) for c in _checks(channel, params.limits))
    warnings = _warnings(soaks.sensor_c.mean(axis=1).tolist(), params)
    return Result(checks=checks, verdict=verdict(checks), warnings=warnings, channels=(x, y, z))


def corrections(result: Result) -> tuple[UnitCorrection, ...]:
    """Return the correction of the first stage that the result gives."""
    x, y, z = (channel.model for channel in result.channels)
    triad: ConverterTriad = (x, y, z)
    return (UnitCorrection("converter", triad),)


def _channel(name: str, fitted: FittedChannel, targets: list[float]) -> ChannelResult:
    return ChannelResult(
        name,
        fitted.model,
        tuple(targets),
        tuple(fitted.sensor_c.tolist()),
        tuple(fitted.scale_code_per_ma.tolist()),
        tuple(fitted.zero_code.tolist()),
        tuple(fitted.zero_ma.tolist()),
        fitted.scale.bic,
        fitted.zero.bic,
        fitted.scale.p_values,
        fitted.zero.p_values,
    )


def _warnings(sensor_c: list[float], params: Params) -> tuple[str, ...]:
    found: list[str] = []
    if not min(sensor_c) <= params.reference_c <= max(sensor_c):
        found.append(
            f"the reference, {params.reference_c:g} °C, is outside what the sensor read, {min(sensor_c):.1f} … "
            f"{max(sensor_c):.1f} °C: values there are extrapolated"
        )
    if not params.gain_sd_ppm and not params.zero_sd_ma:
        found.append("the current source's accuracy is not declared: K0 and N0 are as if it were perfect")
    return tuple(found)


LIMITED = (
    ("zero", "codes", "zero_codes"),
    ("zero, largest change", "codes", "zero_change_codes"),
    ("scale, largest change", "ppm", "scale_change_ppm"),
    ("zero about Fs", "codes", "zero_residual_codes"),
    ("scale about Fc", "ppm", "scale_residual_ppm"),
)
"""Checks of each channel: name, unit of the limit, field of `Limits`."""


def _checks(channel: ChannelResult, limits: Limits) -> list[Check]:
    scale, zero = channel.model.scale, channel.model.zero
    low, high = min(channel.sensor_c), max(channel.sensor_c)
    ppm = units.PPM * abs(scale.at_reference)
    values = (
        (abs(zero.at_reference), float(np.sqrt(zero.covariance[0][0]))),
        (zero.largest_change(low, high), None),
        (scale.largest_change(low, high) / ppm, None),
        (zero.residual_sd, None),
        (scale.residual_sd / ppm, None),
    )
    return [
        check(f"{channel.name} {name}", value, largest(limits, field, unit), sd)
        for (name, unit, field), (value, sd) in zip(LIMITED, values, strict=True)
    ]


def planned_checks(params: Params, _context: Context) -> tuple[PlannedCheck, ...]:
    """Return the planned checks of the three channels; what they depend on is not declared, so nothing is predicted."""
    return tuple(
        PlannedCheck(f"{axis} {name}", largest(params.limits, field, unit))
        for axis in AXES
        for name, unit, field in LIMITED
    )


def report(result: Result) -> Report:
    """Return the report: coefficients, soaks, and the normalised functions with the data that they were fitted to."""
    rows: list[tuple[str | float | None, ...]] = []
    for channel in result.channels:
        for title, part in (("Fc, K0 in codes/mA", channel.model.scale), ("Fs, N0 in codes", channel.model.zero)):
            sd = np.sqrt(np.maximum(np.diagonal(np.array(part.covariance)), 0.0)).tolist()
            rows.append((channel.name, title, len(part.coefficients), part.at_reference, sd[0], None, None))
            for k, (a, of_a) in enumerate(zip(part.coefficients, sd[1:], strict=True), start=1):
                rows.append((None, None, None, None, None, f"a_{k} = {a:.6g}", f"± {of_a:.2g}"))
    columns = ("channel", "function", "order", "at the reference", "± standard uncertainty", "coefficient", "±")
    models = Table("Normalised functions", columns, tuple(rows), "N = K0·Fc(t)·I + N0 + Fs(t) (thesis 3.17 and after).")
    return Report(sections=(models, *(_soak_table(c) for c in result.channels), *_figures(result)))


def _soak_table(channel: ChannelResult) -> Table:
    rows = zip(
        channel.target_c,
        channel.sensor_c,
        channel.zero_code,
        channel.scale_code_per_ma,
        channel.zero_ma,
        strict=True,
    )
    columns = ("chamber, °C", "sensor, °C", "ΔN, codes (3.10)", "K, codes/mA (3.12)", "ΔI, mA (3.13)")
    return Table(f"Channel {channel.name} at the soaks", columns, tuple(rows))


def _figures(result: Result) -> tuple[Figure, ...]:
    scales: list[Series] = []
    zeros: list[Series] = []
    for channel in result.channels:
        at = np.array(channel.sensor_c)
        fine = np.linspace(at.min(), at.max(), 201)
        scale, zero = channel.model.scale, channel.model.zero
        seen = (np.array(channel.scale_code_per_ma) / scale.at_reference - 1.0) / units.PPM
        scales += _pair(channel.name, at, seen, fine, (scale.function(fine) - 1.0) / units.PPM)
        zeros += _pair(channel.name, at, np.array(channel.zero_code) - zero.at_reference, fine, zero.function(fine))
    x_label = "converter's sensor, °C"
    return (
        Figure("Scale over temperature", x_label, "Fc − 1, ppm", tuple(scales)),
        Figure("Zero over temperature", x_label, "Fs, codes", tuple(zeros)),
    )


def _pair(name: str, at: Array, seen: Array, fine: Array, function: Array) -> tuple[Series, Series]:
    return (
        Series(name, tuple(at.tolist()), tuple(seen.tolist())),
        Series(f"{name}, fitted", tuple(fine.tolist()), tuple(function.tolist()), style="line"),
    )


PROCEDURE = Procedure(
    "converter_bench",
    "Signal converter over temperature",
    "1.0.0",
    Params,
    Result,
    resolve,
    schedule,
    predict,
    acquire,
    analyse,
    report,
    corrections=corrections,
    quantities=lambda params, context: tuple(one.check for one in planned_checks(params, context)),
    planned_checks=planned_checks,
    inspection=lambda _: replace(STATIONS, temperatures=True),
)
