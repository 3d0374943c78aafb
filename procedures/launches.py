"""Recordings at rest, one a launch: parameters, result and analysis that `static_run` and `noise_analysis` share.

Defines the parameters and the checks. The numerics are in `procedures.analysis.launch`, the report is in
`procedures.reports.launch`.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, TypeVar

from pydantic import Field

from procedures.analysis.launch.analysis import INSPECTION
from procedures.analysis.launch.analysis import analyse_launches as all_launches
from procedures.analysis.launch.prediction import predicted_noise
from procedures.analysis.launch.results import ChannelNoise, LaunchNoise
from procedures.analysis.launch.settings import LaunchSettings
from procedures.analysis.launch.summary import ChannelSummary, summarise
from procedures.analysis.launch.surroundings import vibration, with_origins
from procedures.core import units
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.limits import Check, Limit, PlannedCheck, check, significance, verdict
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import TRIADS, Recording
from procedures.core.unit import Unit
from procedures.procedure import JudgedParameters, Outcome, Parameters

SOURCE = "thesis 4.3, 5.6"
LAUNCH = INSPECTION
"""Inspection of launches: each by itself, at rest throughout."""
Part = Literal["gyros", "accelerometers", "all", "none"]


class NoiseLimits(Parameters):
    """Requirements on the noise of a unit (thesis 4.3, 5.6)."""

    gyro_random_walk_deg_sqrt_h: float = Field(0.003, gt=0.0, le=1e6)
    gyro_bias_in_run_deg_h: float = Field(0.015, gt=0.0, le=1e6, description="bias instability")
    accelerometer_bias_in_run_m_s2: float = Field(0.0005, gt=0.0, le=100.0, description="bias instability")
    readiness_s: float | None = Field(
        None,
        gt=0.0,
        le=1e6,
        description="since the launch, by which a warm-up that was found has ended; null: no check",
    )
    absence_level: float | None = Field(
        None,
        gt=0.0,
        le=0.2,
        description="rate random walk and ramp must be absent; chance that a sound unit fails; null: no check",
    )
    vibration_deg_h: float | None = Field(
        None, gt=0.0, description="vibration of the base by the gyros, rms above 1 Hz; null: no check"
    )
    vibration_m_s2: float | None = Field(
        None, gt=0.0, description="vibration of the base by the accelerometers; null: no check"
    )


class NoiseParameters(JudgedParameters):
    """Steps of the analysis, each of which can be switched off; the effect of each is in the result's table of
    steps.
    """

    cell_s: float = Field(1.0, gt=0.0, le=3600.0, description="cell whose means the slow part works on")
    full_rate: bool = Field(True, description="also use what is faster than a cell, where the noise model describes it")
    trim: Part = Field("gyros", description="leave out the warm-up that is found at the start of a launch")
    trim_s: float | None = Field(
        None, ge=0.0, le=1e7, description="instead of what is found: leave out this time since the launch"
    )
    self_heating: Part = Field("accelerometers", description="fit two exponentials and subtract them (thesis 3.1.3)")
    wavelet: Literal["thesis", "rescaled", "none"] = Field(
        "rescaled",
        description="threshold rule of the split into quantization and the rest: thesis takes unit noise variance, "
        "rescaled estimates it level by level",
    )
    wavelet_levels: int = Field(6, ge=1, le=20, description="2^levels cells is the longest scale that is split")
    confidence: float = Field(0.95, gt=0.5, lt=1.0, description="confidence level of the intervals")
    level: float = Field(0.01, gt=0.0, le=0.2, description="chance that an absent process is reported present")
    points_per_decade: int = Field(10, ge=3, le=100, description="averaging times in a decade of the deviation curves")
    band_step_decades: float | None = Field(
        None, ge=0.002, le=1.0, description="of the band over all starts (paper A: 0.002); null: as the curves"
    )
    band_launch: int = Field(1, ge=1, le=100, description="launch whose band, interval and lines are drawn")
    noise_limits: NoiseLimits = Field(default_factory=lambda: NoiseLimits.model_validate({}))

    def settings(self) -> LaunchSettings:
        """Return the settings of the numerics."""
        return LaunchSettings(
            cell_s=self.cell_s,
            fast=self.full_rate,
            trim_gyros=self.trim in ("gyros", "all"),
            trim_accelerometers=self.trim in ("accelerometers", "all"),
            trim_s=self.trim_s,
            heating_gyros=self.self_heating in ("gyros", "all"),
            heating_accelerometers=self.self_heating in ("accelerometers", "all"),
            wavelet_rule=None if self.wavelet == "none" else self.wavelet,
            wavelet_levels=self.wavelet_levels,
            confidence=self.confidence,
            level=self.level,
            points_per_decade=self.points_per_decade,
            band_step_decades=self.band_step_decades,
        )


class NoiseResult(Outcome):
    """Result of every launch with its channels, and the summary over all launches."""

    launches: tuple[LaunchNoise, ...]
    channels: tuple[ChannelSummary, ...]
    averaging_time_s: float | None
    """The longest of the channels': the dwell that a calibration needs. None: quantization rules nowhere."""
    drawn_launch: int = 1
    """Number of the launch whose band, interval and lines are drawn."""


R = TypeVar("R", bound=NoiseResult)


def analyse_launches(
    result: type[R], recordings: Sequence[Recording], params: NoiseParameters, unit: Unit | None = None
) -> R:
    """Analyse each recording as a launch of its own, block by block, then all of them together, with checks.

    `unit`: lines are matched to its declared dithers. Raises `UnfitRecording`, `MissingChannel`, `BadParameter`.
    """
    if not recordings:
        raise UnfitRecording("there is no recording to analyse")
    settings = params.settings()
    if params.band_launch > len(recordings):
        raise BadParameter("band_launch", params.band_launch, f"1 … {len(recordings)}, the launches that there are")
    labels = [_label(r, i) for i, r in enumerate(recordings, start=1)]
    launches = tuple(_matched(launch, unit) for launch in all_launches(recordings, labels, settings))
    names = {tuple((c.channel, c.rate_unit) for c in launch.channels) for launch in launches}
    if len(names) > 1:
        raise UnfitRecording("the recordings have different channels: analyse them one by one")
    channels = summarise(launches)
    checks = (*_checks(channels, params.noise_limits), *surroundings_checks(launches, channels, params.noise_limits))
    longest = max((s.averaging_time_s for s in channels if s.averaging_time_s is not None), default=None)
    return result(
        checks=checks,
        verdict=verdict(checks),
        warnings=_warnings(launches),
        launches=launches,
        channels=channels,
        averaging_time_s=longest,
        drawn_launch=params.band_launch,
    )


def _matched(launch: LaunchNoise, unit: Unit | None) -> LaunchNoise:
    """The launch against the unit's record: origins of its lines by the declared dithers, vibration by the known noise.

    The fitted noise takes a part of a vibration for its own; that of the record does not know it.
    """
    if unit is None:
        return launch
    dithers = None if unit.gyro is None else unit.gyro.dither_frequency_hz
    found: list[ChannelNoise] = []
    for c in launch.channels:
        known = _known_noise(unit, c)
        if known is not None and c.density is not None:
            c = replace(c, vibration=vibration(c.density, c.lines, known, c.bandwidth_hz))
        if dithers is not None:
            c = replace(c, lines=with_origins(c.lines, c.channel, dithers, launch.rate_hz))
        found.append(c)
    return replace(launch, channels=tuple(found))


def _known_noise(unit: Unit, channel: ChannelNoise) -> NoiseCoefficients | None:
    """Noise of a channel in the unit's record; None where it has none, or the channel is in counts."""
    for triad, names in TRIADS.items():
        record = unit.triad(triad)
        if channel.channel in names and record is not None and channel.rate_unit != "count":
            noise = record.noise[names.index(channel.channel)]
            return noise if noise.quantization > 0.0 or noise.random_walk > 0.0 else None
    return None


def _warnings(launches: Sequence[LaunchNoise]) -> tuple[str, ...]:
    """Warnings of the noise model for each channel, each sentence once; those of the inspection are added elsewhere."""
    several = len(launches) > 1
    found: list[str] = []
    for launch in launches:
        begin = f"{launch.label}, " if several else ""
        for channel in launch.channels:
            found += (f"{begin}{channel.channel}: {sentence}" for sentence in channel.warnings)
    return tuple(dict.fromkeys(found))


def _checks(channels: Sequence[ChannelSummary], limits: NoiseLimits) -> tuple[Check, ...]:
    """Random walk of gyros and bias instability of both triads; of channels in counts only that there is a noise."""
    found: list[Check] = []
    for s in channels:
        if s.rate_unit == "rad/s":
            deg_sqrt_h, deg_h = ("deg/√h", units.DEG_PER_SQRT_HOUR), ("deg/h", units.DEG_PER_HOUR)
            found.append(_check(s, "random_walk", limits.gyro_random_walk_deg_sqrt_h, *deg_sqrt_h))
            found.append(_check(s, "bias_instability", limits.gyro_bias_in_run_deg_h, *deg_h))
        elif s.rate_unit == "m/s^2":
            found.append(_check(s, "bias_instability", limits.accelerometer_bias_in_run_m_s2, "m/s^2", 1.0))
    if not found:
        seen = float(sum(m.mean is not None for s in channels for m in s.means))
        found.append(check("noise processes observed", seen, Limit("1", minimum=1.0, source="every record has some")))
    return tuple(found)


LIMITED = (
    ("gyro", "random_walk", "deg/√h", units.DEG_PER_SQRT_HOUR, "gyro_random_walk_deg_sqrt_h"),
    ("gyro", "bias_instability", "deg/h", units.DEG_PER_HOUR, "gyro_bias_in_run_deg_h"),
    ("accelerometer", "bias_instability", "m/s^2", 1.0, "accelerometer_bias_in_run_m_s2"),
)
"""Triad, process, unit of its limit, size of that unit in SI, and the field of the limit."""


def noise_checks(params: NoiseParameters, unit: Unit, duration_s: float, launches: int) -> list[PlannedCheck]:
    """Planned checks of the noise of a unit whose noise is known, from the bounds of its coefficients.

    A coefficient c with standard uncertainty u is a root mean square of ``ν = ½·(c/u)²`` degrees of freedom.
    """
    found: list[PlannedCheck] = []
    for triad, process, name, size, field in LIMITED:
        record = unit.triad(triad)
        limit = Limit(name, maximum=getattr(params.noise_limits, field), source=SOURCE)
        for channel, noise in zip(TRIADS[triad], record.observed_noise if record else (), strict=False):
            of_process = [p for p in predicted_noise(channel, noise, duration_s, launches) if p.process == process]
            check_name = f"{channel} {process.replace('_', ' ')}"
            for p in of_process:
                freedom = 0.5 * (p.value / p.standard_uncertainty) ** 2
                found.append(PlannedCheck(check_name, limit, 0.0, freedom, p.value / size))
            if not of_process:
                found.append(PlannedCheck(check_name, limit))
    if params.noise_limits.absence_level is not None:
        names = [c.name for c in unit.channels if c.rate_unit in ("rad/s", "m/s^2")]
        level = params.noise_limits.absence_level / (2 * max(1, len(names)))
        limit = Limit("1", minimum=level, source=ABSENCE)
        found += [PlannedCheck(_absent(name, slow), limit, level=level) for name in names for slow in SLOW]
    return found


def _label(recording: Recording, number: int) -> str:
    return recording.info.station.label if recording.info.station else f"recording {number}"


def _check(s: ChannelSummary, process: str, maximum: float, unit: str, size: float) -> Check:
    """The mean over the launches; of a process that no launch shows, the least that it is known to stay below."""
    found = s.mean(process)
    name = f"{s.channel} {process.replace('_', ' ')}"
    limit = Limit(unit, maximum=maximum, source=SOURCE)
    if found.mean is not None:
        return check(name, found.mean / size, limit, None if found.sd is None else found.sd / size)
    bound = min((r.upper_limit for r in found.values if r.upper_limit is not None), default=float("inf"))
    described = all(reading.described for reading in found.values)
    reason = "not observed" if described else "not described by the noise model"
    return check(name, bound / size, limit, note=f"{reason}: the value is what it stays below")


READY, BASE = "thesis table 1.4, 4.1.2", "ours: base vibration"
ABSENCE = "thesis 4.1.2: their absence is a sign of quality"
SLOW = ("rate_random_walk", "rate_ramp")


def _absent(channel: str, process: str) -> str:
    return f"{channel} {process.replace('_', ' ')} absent, p-value"


def surroundings_checks(
    launches: Sequence[LaunchNoise], channels: Sequence[ChannelSummary], limits: NoiseLimits
) -> list[Check]:
    """Return the checks of readiness, absence of rate random walk and ramp, and base vibration, each where its limit is
    given.
    """
    found: list[Check] = []
    for index, s in enumerate(channels):
        of_launches = [launch.channels[index] for launch in launches]
        name, ends = s.channel, [c.warm_up for c in of_launches if c.warm_up is not None]
        if limits.readiness_s is not None and s.rate_unit != "count":
            limit = Limit("s", maximum=limits.readiness_s, source=READY)
            if ends:
                last = max(ends, key=lambda w: w.end_s)
                note = "" if last.has_ended else "it has not ended within the launch: extrapolated"
                found.append(check(f"{name} readiness time", last.end_s, limit, last.end_sd_s, note))
            else:
                found.append(check(f"{name} readiness time", 0.0, limit, note="no warm-up was found"))
        if limits.absence_level is not None:
            level = limits.absence_level / (2 * len(channels))
            for process in SLOW:
                p_values = [c.coefficient(process).likelihood.p_value for c in of_launches]
                least = min((p for p in p_values if p is not None), default=1.0)
                value = min(1.0, len(p_values) * least)  # Bonferroni: several launches, one chance
                found.append(significance(_absent(name, process), value, level, source=ABSENCE))
        found += _vibration(name, s.rate_unit, of_launches, limits)
    return found


def _vibration(name: str, rate_unit: str, launches: Sequence[ChannelNoise], limits: NoiseLimits) -> list[Check]:
    maximum = {"rad/s": limits.vibration_deg_h, "m/s^2": limits.vibration_m_s2}.get(rate_unit)
    seen = [c.vibration.vibration for c in launches if c.vibration is not None]
    if maximum is None or not seen:
        return []
    unit, size = ("deg/h", units.DEG_PER_HOUR) if rate_unit == "rad/s" else ("m/s^2", 1.0)
    return [check(f"{name} base vibration, rms", max(seen) / size, Limit(unit, maximum=maximum, source=BASE))]
