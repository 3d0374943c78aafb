"""Dependence of the channels of any recordings on their temperature channel: fit, correction, soaks, repeatability.

For imported recordings, of whole cycles or of parts. The polynomials are of order 1 … 5, chosen by the information
criterion with the channel's own slow noise (thesis appendix B); the soaks are found from the temperature itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from procedures.analysis.cells import cell_means
from procedures.analysis.coloured_noise import FEWEST
from procedures.analysis.fitness.watched import Inspection
from procedures.analysis.thermal.dependence import (
    Repeatability,
    Series,
    SoakFit,
    fit_order,
    joint_p_value,
    judge_order,
    own_noise,
    repeatability,
    soak_fits,
    unseen_p_value,
)
from procedures.analysis.thermal.order import LARGEST_ORDER
from procedures.analysis.thermal.regime import RegimeSettings, regimes
from procedures.analysis.thermal.runs import without_lag
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.limits import significance, verdict
from procedures.core.recording import AROUND, GYRO, Quantity, Recording, RecordingInfo, titles
from procedures.core.report import Report
from procedures.core.temperature.gyros import GyroPolynomial, GyroThermalCorrection
from procedures.core.temperature.thermometers import ThermometerCorrection
from procedures.core.unit import Unit
from procedures.core.unit_correction import UnitCorrection
from procedures.parameters import planned_tests
from procedures.procedure import STATIONS, Evidence, Method, Outcome, RecordedParameters
from procedures.reports.temperature_dependence import dependence_report
from procedures.thermal_parameters import Regime

SECOND_S = 1.0


class Params(RecordedParameters):
    """Channels, sensors and how they are judged."""

    channels: tuple[str, ...] | None = Field(
        None, min_length=1, max_length=64, description="None: all of gyros and accelerometers"
    )
    sensor: str | None = Field(None, description="temperature channel; None: the only one that the recordings have")
    own_sensors: dict[str, str] = Field(
        default_factory=dict[str, str], description="channel: its own temperature channel, instead of `sensor`"
    )
    lag_s: float = Field(0.0, ge=0.0, le=600.0, description="time constant of the sensors")
    thermometers: bool = Field(True, description="correct sensors by the unit's current calibration of thermometers")
    reference_c: float = Field(20.0, ge=-100.0, le=200.0)
    order: int | None = Field(None, ge=1, le=LARGEST_ORDER, description="None: by the information criterion")
    cell_s: float = Field(60.0, ge=1.0, le=600.0)
    soaks: bool = Field(True, description="fit soak by soak, and compare them over recordings and visits")
    least_soak_s: float = Field(900.0, ge=60.0, le=86_400.0)
    like_c: float = Field(3.0, gt=0.0, le=50.0, description="soaks within this are of one temperature")
    regime: Regime = Field(default_factory=lambda: Regime.model_validate({}))
    level: float = Field(0.01, gt=0.0, le=0.2, description="chance that sound channels are said to depend")


@dataclass(frozen=True)
class ChannelFound:
    """Dependence of one channel. Coefficients in the channel's rate unit a °C^k."""

    channel: str
    rate_unit: str
    sensor: str
    p_value: float
    """Chance of as much dependence from the channel's own noise, all recordings together."""
    order: int
    preferred_order: int
    reason: str
    bic: tuple[float, ...]
    f_tests: tuple[float, ...]
    coefficients: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    before_sd: float
    """Spread of the cells about each recording's mean, before correction."""
    after_sd: float
    """Spread of the cells about each recording's mean, after correction."""
    p_unseen: float | None
    """p-value of "no dependence is left" in each recording after a fit to the others; None with a single recording."""
    soaks: tuple[SoakFit, ...]
    repeatability: tuple[Repeatability, ...]


class Result(Outcome):
    """Dependence of each channel, and a correction of the gyros where they have sensors."""

    channels: tuple[ChannelFound, ...]
    reference_c: float
    range_c: tuple[float, float]
    thermometers: str
    """Id of the calibration of thermometers that was used; empty: readings as they are."""
    gyro_correction: GyroThermalCorrection | None
    trace_c: tuple[tuple[float, ...], ...]
    """Temperature of each recording in cells, by the first channel's sensor."""
    recordings: tuple[str, ...] = ()
    """Title of each recording; empty in results from before titles were stored."""


INDEPENDENCE = "independence of temperature, p-value"


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Return the dependence of every channel, fitted over all recordings. Raises `BadParameter`, `MissingChannel`,
    `UnfitRecording`.
    """
    recordings = evidence.recordings
    if not recordings:
        raise UnfitRecording("there is no recording to analyse")
    names = _channels(recordings, params)
    if params.order is not None and params.cell_s * FEWEST > min(r.info.duration_s for r in recordings):
        raise BadParameter("cell_s", params.cell_s, f"so short that every recording has {FEWEST} cells")
    sensors = {name: _sensor(recordings, name, params) for name in names}
    known = unit.thermometers if unit is not None and params.thermometers else None
    applied = known is not None and any(known.has(sensor) for sensor in sensors.values())
    series = [_series(recording, sensors, params, known) for recording in recordings]
    found = [_channel(recordings[0].info, name, sensors[name], [s[name] for s in series], params) for name in names]
    level, source = params.level / len(names), params.source_of("level", "ours: no dependence on temperature")
    checks = tuple(significance(f"{c.channel} {INDEPENDENCE}", c.p_value, level, source=source) for c, _ in found)
    temperatures = [s.departure_c + params.reference_c for _, series in found for s in series]
    return Result(
        checks=checks,
        verdict=verdict(checks),
        warnings=_warnings([c for c, _ in found], unit, params),
        channels=tuple(c for c, _ in found),
        reference_c=params.reference_c,
        range_c=(float(min(t.min() for t in temperatures)), float(max(t.max() for t in temperatures))),
        thermometers=(unit.thermometers_id or "") if unit is not None and applied else "",
        gyro_correction=_gyros([c for c, _ in found], temperatures, params, known),
        trace_c=tuple(tuple((s.departure_c + params.reference_c).tolist()) for s in found[0][1]),
        recordings=tuple(titles(recordings)),
    )


def _channels(recordings: Sequence[Recording], params: Params) -> tuple[str, ...]:
    info = recordings[0].info
    every = tuple(c.name for c in info.channels if c.quantity not in AROUND)
    names = every if params.channels is None else params.channels
    for name in names:
        for recording in recordings:
            recording.info.column(name)
    if not names:
        raise UnfitRecording(f"recording {info.id} has only temperature channels")
    return names


def _sensor(recordings: Sequence[Recording], channel: str, params: Params) -> str:
    info = recordings[0].info
    sensors = tuple(c.name for c in info.channels if c.quantity is Quantity.TEMPERATURE)
    chosen = params.own_sensors.get(channel, params.sensor)
    if chosen is None and len(sensors) == 1:
        return sensors[0]
    if chosen not in sensors:
        has = f"one of {', '.join(sensors)}" if sensors else f"none: recording {info.id} has no temperature channel"
        raise BadParameter(f"own_sensors.{channel}" if channel in params.own_sensors else "sensor", chosen, has)
    return chosen


def _channel(
    info: RecordingInfo, channel: str, sensor: str, series: list[Series], params: Params
) -> tuple[ChannelFound, list[Series]]:
    order = judge_order(series, params.cell_s)
    used = order.preferred if params.order is None else params.order
    fit = fit_order(series, used, params.cell_s)
    head = len(series)
    curve = fit.coefficients[head:]
    after = [s.values - s.departure_c[:, None] ** np.arange(1, used + 1) @ curve for s in series]
    soaks: tuple[SoakFit, ...] = ()
    if params.soaks:
        noise = own_noise(series, used, params.cell_s)
        soaks = soak_fits(series, noise, params.cell_s, 0.0, params.least_soak_s)
    found = ChannelFound(
        channel,
        info.channels[info.column(channel)].rate_unit,
        sensor,
        joint_p_value(series, params.cell_s),
        used,
        order.preferred,
        order.reason(used),
        order.bic,
        order.p_value,
        tuple(curve.tolist()),
        tuple(tuple(row) for row in fit.covariance[head:, head:].tolist()),
        _spread([s.values for s in series]),
        _spread(after),
        unseen_p_value(series, used, params.cell_s),
        soaks,
        repeatability(soaks, params.like_c),
    )
    return found, series


def _spread(values: Sequence[Array]) -> float:
    return float(np.sqrt(np.mean(np.concatenate([(v - v.mean()) ** 2 for v in values]))))


def _series(
    recording: Recording, sensors: Mapping[str, str], params: Params, known: ThermometerCorrection | None
) -> dict[str, Series]:
    """Cells of each channel and of its temperature sensor, with the regime where soaks are asked for; read once."""
    of_sensors = tuple(dict.fromkeys(sensors.values()))
    cells = cell_means(recording, (*sensors, *of_sensors), SECOND_S)
    size = max(1, round(params.cell_s / cells.cell_s))
    count = cells.rates.shape[1] // size
    if count < FEWEST:
        raise UnfitRecording(
            f"recording {recording.info.id}: {count} cells of {params.cell_s:g} s are too few, the least is {FEWEST}: "
            "make cell_s shorter"
        )
    departures: dict[str, Array] = {}
    dynamic: dict[str, NDArray[np.bool_]] = {}
    for sensor, readings in zip(of_sensors, cells.rates[len(sensors) :], strict=True):
        if np.ptp(readings) == 0.0:
            raise UnfitRecording(
                f"recording {recording.info.id}: channel {sensor} reads {readings[0]:.6g} °C all the time: nothing can "
                "depend on it; is the thermometer stuck, or is another sensor meant (sensor, own_sensors)?"
            )
        temperature = known.corrected(sensor, readings) if known is not None and known.has(sensor) else readings
        if params.lag_s > 0.0:
            temperature = without_lag(temperature, cells.cell_s, params.lag_s)
        departures[sensor] = _cells(temperature - params.reference_c, count, size)
        if params.soaks:
            trace = regimes(temperature, cells.cell_s, RegimeSettings(**params.regime.model_dump()))
            dynamic[sensor] = np.logical_or.reduce(trace.dynamic[: count * size].reshape(count, size), axis=1)
    rows = zip(sensors.items(), cells.rates[: len(sensors)], strict=True)
    return {
        name: Series(_cells(values, count, size), departures[sensor], dynamic.get(sensor))
        for (name, sensor), values in rows
    }


def _cells(values: Array, count: int, size: int) -> Array:
    return np.asarray(values[: count * size].reshape(count, size).mean(axis=1), dtype=np.float64)


def _gyros(
    found: Sequence[ChannelFound], temperatures: Sequence[Array], params: Params, known: ThermometerCorrection | None
) -> GyroThermalCorrection | None:
    """Correction of a gyro triad in rad/s, each by its own sensor; None where that is not what was fitted."""
    of = {c.channel: c for c in found}
    if not all(n in of and of[n].rate_unit == "rad/s" and of[n].sensor == f"temperature_{n}" for n in GYRO):
        return None
    level = params.level / len(found)
    x, y, z = (
        GyroPolynomial(of[n].coefficients, of[n].covariance) if of[n].p_value < level else GyroPolynomial()
        for n in GYRO
    )
    span = (float(min(t.min() for t in temperatures)), float(max(t.max() for t in temperatures)))
    return GyroThermalCorrection((x, y, z), params.reference_c, span, known)


def _warnings(found: Sequence[ChannelFound], unit: Unit | None, params: Params) -> tuple[str, ...]:
    told: list[str] = []
    if unit is not None and params.thermometers and (why := unit.why_withheld("thermometers")):
        told.append(f"left out: {why}")
    told += [f"{c.channel}: {c.reason}" for c in found if c.order != c.preferred_order]
    told += [
        f"{c.channel}: what a fit to the other recordings leaves depends on temperature still (p = {c.p_unseen:.2g}): "
        "the dependence does not repeat"
        for c in found
        if c.p_unseen is not None and c.p_unseen < params.level / len(found)
    ]
    return tuple(told)


def corrections(result: Result) -> tuple[UnitCorrection, ...]:
    """Return the correction of the gyros, where one of them depends on temperature; otherwise nothing."""
    gyros = result.gyro_correction
    if gyros is None or not any(g.coefficients for g in gyros.gyros):
        return ()
    return (UnitCorrection("gyros", gyros),)


def report(result: Result) -> Report:
    """Return the report: coefficients and orders, soaks, repeatability, and the temperature itself."""
    return dependence_report(result.channels, result.reference_c, result.trace_c, result.recordings)


METHOD = Method(
    *("temperature_dependence", "Dependence of recordings on temperature", "1.1.0"),
    *(Params, Result, analyse, report),
    corrections=corrections,
    uses_corrections=lambda result: ("thermometers",) if result.thermometers else (),
    planned_checks=lambda params, _unit, _planned: planned_tests(params, "level", f"all channels: {INDEPENDENCE}"),
    inspection=lambda params, _: Inspection(
        replace(STATIONS.settings, least_samples=FEWEST), params.channels, misread_refused=True
    ),
)
