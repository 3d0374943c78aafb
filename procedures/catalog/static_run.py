"""Static launches: the unit at rest, hours at a time, switched off in between (thesis 3.1, 4.1.1).

From raw counts to noise coefficients three ways with uncertainties, the averaging time that calibration needs, warm-up
and self-heating; launches side by side as the thesis's Tables 4.1 and 4.2.
"""

from collections.abc import AsyncIterator, Sequence
from dataclasses import replace
from math import ceil

from pydantic import Field

from procedures import steps
from procedures.analysis.averaging_time import averaging_time
from procedures.analysis.calibration.station_plan import windows
from procedures.analysis.launch.prediction import predicted_noise, unresolved_noise
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core.limits import PlannedCheck
from procedures.core.recording import TRIADS, Recording, Station
from procedures.core.report import Report
from procedures.core.table_angles import TableAngles
from procedures.core.unit import TriadRecord, Unit
from procedures.launches import LAUNCH, NoiseParameters, NoiseResult, analyse_launches
from procedures.noise_limits import ABSENCE_LEVEL, READY_S, THESIS_LIMITS, NoiseLimits, noise_checks
from procedures.parameters import SupplyParameters
from procedures.procedure import Context, PredictedUncertainty, Prediction, Procedure
from procedures.reports.launch import noise_report

DWELL_STEP_S = 5.0
"""The averaging time is rounded up to whole steps of this (thesis 4.1.3: 55 and 65 s gave 70 s)."""


class Limits(NoiseLimits):
    """Requirements of a launch on the bench: noise (thesis 4.3, 5.6), and readiness within ten minutes (table 1.4)."""

    gyro_random_walk_deg_sqrt_h: float = Field(  # pyright: ignore[reportIncompatibleVariableOverride]
        THESIS_LIMITS["gyro_random_walk_deg_sqrt_h"], gt=0.0, le=1e6
    )
    gyro_bias_in_run_deg_h: float = Field(  # pyright: ignore[reportIncompatibleVariableOverride]
        THESIS_LIMITS["gyro_bias_in_run_deg_h"], gt=0.0, le=1e6, description="bias instability"
    )
    accelerometer_bias_in_run_m_s2: float = Field(  # pyright: ignore[reportIncompatibleVariableOverride]
        THESIS_LIMITS["accelerometer_bias_in_run_m_s2"], gt=0.0, le=100.0, description="bias instability"
    )
    readiness_s: float | None = Field(
        READY_S,
        gt=0.0,
        le=1e6,
        description="since the launch, by which a warm-up that was found has ended; null: no check",
    )
    absence_level: float | None = Field(
        ABSENCE_LEVEL,
        gt=0.0,
        le=0.2,
        description="rate random walk and ramp must be absent; chance that a sound unit fails; null: no check",
    )


class Params(NoiseParameters, SupplyParameters):
    """Number and duration of the launches, and settings of their analysis."""

    noise_limits: Limits = Field(default_factory=lambda: Limits.model_validate({}))  # pyright: ignore[reportIncompatibleVariableOverride]
    temperatures: bool = Field(
        False, description="record the unit's temperature sensors too; the unit then stands in the thermal chamber"
    )

    launches: int = Field(4, ge=1, le=100)
    duration_s: float = Field(21_600.0, ge=600.0, le=1_209_600.0, description="duration of each launch")
    off_time_s: float = Field(
        3600.0, ge=1.0, le=604_800.0, description="switched off before each launch, the first too; the thesis: 1 h"
    )
    settle_s: float = Field(0.0, ge=0.0, le=86_400.0, description="from switching on to the first sample")
    sample_rate_hz: float | None = Field(None, ge=1.0, le=10_000.0, description="None: the unit's own")
    outer_deg: float = Field(0.0, ge=-360.0, le=360.0)
    middle_deg: float = Field(0.0, ge=-360.0, le=360.0)
    inner_deg: float = Field(0.0, ge=-360.0, le=360.0)


class Result(NoiseResult):
    """Noise of the unit, launch by launch and together."""


def resolve(params: Params, context: Context) -> Params:
    """Return the parameters as they are: nothing depends on unit or bench."""
    return params


def schedule(params: Params) -> tuple[Station, ...]:
    """Return the stations of the run, one a launch."""
    angles = TableAngles(params.outer_deg, params.middle_deg, params.inner_deg)
    return tuple(
        Station(
            i,
            f"launch {i + 1}",
            angles,
            None,
            params.settle_s,
            params.duration_s,
            power_off_s=params.off_time_s,
            temperatures=params.temperatures,
            sample_rate_hz=params.sample_rate_hz,
            supply_voltage_v=params.supply_voltage_v,
        )
        for i in range(params.launches)
    )


def predict(params: Params, context: Context) -> Prediction:
    """Return the duration, and the uncertainty of each expected coefficient after all launches."""
    stations = schedule(params)
    duration_s = float(windows(stations, context.bench.axis_motion)[-1, 1])
    found: list[PredictedUncertainty] = []
    warnings: list[str] = []
    for triad, names in TRIADS.items():
        record = context.unit.triad(triad)
        if record is None:
            warnings.append(f"nothing is known of the {triad} triad's noise: no uncertainty can be predicted")
            continue
        for name, noise in zip(names, record.observed_noise, strict=True):
            found += [
                PredictedUncertainty(
                    f"{name}.{p.process}",
                    p.unit,
                    p.standard_uncertainty,
                    p.standard_uncertainty,
                    quantity=f"{name} {p.process.replace('_', ' ')}",
                )
                for p in predicted_noise(name, noise, params.duration_s, params.launches)
            ]
            warnings += unresolved_noise(name, noise, params.duration_s)
    basis = f"the unit's noise as declared or last found ({_origins(context.unit)})" if found else ""
    return Prediction(duration_s, tuple(found), tuple(warnings), basis)


async def acquire(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    """Switch off and on, turn to the orientation, record, launch after launch; yield the stream of each."""
    for station in stations:
        yield await steps.record_station(bench, station)


def analyse(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    """Return the noise of each launch on its own, and of all of them together. Raises `UnfitRecording`,
    `MissingChannel`.
    """
    return analyse_launches(Result, recordings, params, context.unit)


def report(result: Result) -> Report:
    """Return the report: tables 4.1 and 4.2 of the thesis, and the plots behind them."""
    return noise_report(result.launches, result.channels, result.averaging_time_s, result.drawn_launch)


def learns(result: Result, unit: Unit, origin: str) -> Unit:
    """Return the unit's record with the noise and the averaging time found, for later previews and dwells.

    A process that no launch shows enters with the mean square that its upper limit leaves likely, and is named.
    """
    records: dict[str, TriadRecord | None] = {"gyro": unit.gyro, "accelerometer": unit.accelerometer}
    known = {
        name: noise
        for triad, names in TRIADS.items()
        if (record := records[triad]) is not None
        for name, noise in zip(names, record.noise, strict=True)
    }
    noise = {s.channel: s.noise_over(known.get(s.channel)) for s in result.channels}
    absent = {s.channel: s.not_observed for s in result.channels}
    for triad, (x, y, z) in TRIADS.items():
        if all(name in noise for name in (x, y, z)):
            old = records[triad] or TriadRecord((noise[x], noise[y], noise[z]))
            found = {"noise": (noise[x], noise[y], noise[z]), "not_observed": (absent[x], absent[y], absent[z])}
            records[triad] = replace(old, noise_origin=origin, **found)
    dwell = unit.averaging_time_s if result.averaging_time_s is None else _whole_steps(result.averaging_time_s)
    return replace(unit, gyro=records["gyro"], accelerometer=records["accelerometer"], averaging_time_s=dwell)


def expected_averaging_time(_params: Params, context: Context) -> float | None:
    """Return the averaging time that the unit's record is expected to have afterwards, by the noise that it has now
    [s]; None where that noise is not known, or has no such time.
    """
    records = [record for triad in TRIADS if (record := context.unit.triad(triad)) is not None]
    times = [averaging_time(noise).tau_s for record in records for noise in record.observed_noise]
    longest = max((t for t in times if t), default=None)
    return None if longest is None else _whole_steps(longest)


def _whole_steps(time_s: float) -> float:
    return DWELL_STEP_S * ceil(time_s / DWELL_STEP_S)


def quantities(params: Params, context: Context) -> tuple[str, ...]:
    """Return the names of the checks that a result will have; for channels in counts only that there is noise."""
    rates = [(c.name, c.rate_unit) for c in context.unit.channels if c.rate_unit in ("rad/s", "m/s^2")]
    walks = [f"{name} random walk" for name, unit in rates if unit == "rad/s"]
    if not rates:
        return ("noise processes observed",)
    found = [*walks, *(f"{name} bias instability" for name, _ in rates)]
    limits = params.noise_limits
    if limits.readiness_s is not None:
        found += [f"{name} readiness time" for name, _ in rates]
    if limits.absence_level is not None:
        found += [f"{name} {k} absent, p-value" for name, _ in rates for k in ("rate random walk", "rate ramp")]
    return tuple(found)


def planned_checks(params: Params, context: Context) -> tuple[PlannedCheck, ...]:
    """Return the planned checks of the noise coefficients, the mean over the launches."""
    return tuple(noise_checks(params.noise_limits, context.unit, params.duration_s, params.launches))


def _origins(unit: Unit) -> str:
    return ", ".join(dict.fromkeys(r.noise_origin for r in (unit.gyro, unit.accelerometer) if r is not None))


PROCEDURE = Procedure(
    "static_run",
    "Static launches",
    "1.2.0",
    Params,
    Result,
    resolve,
    schedule,
    predict,
    acquire,
    analyse,
    report,
    learns=learns,
    expected_averaging_time=expected_averaging_time,
    quantities=quantities,
    planned_checks=planned_checks,
    inspection=lambda _: LAUNCH,
)
