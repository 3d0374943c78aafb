"""Recordings at rest, one a launch: parameters, result and analysis that `static_run` and `noise_analysis` share.

Defines the parameters; the checks are in `procedures.noise_limits`. The numerics are in `procedures.analysis.launch`,
the report is in `procedures.reports.launch`.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, TypeVar

from pydantic import Field

from procedures.analysis.launch.analysis import INSPECTION
from procedures.analysis.launch.analysis import analyse_launches as all_launches
from procedures.analysis.launch.results import ChannelNoise, LaunchNoise
from procedures.analysis.launch.settings import LaunchSettings
from procedures.analysis.launch.summary import ChannelSummary, summarise
from procedures.analysis.launch.surroundings import vibration, with_origins
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.limits import verdict
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import TRIADS, Recording, titles
from procedures.core.unit import Unit
from procedures.noise_limits import NoiseLimits, launch_checks
from procedures.procedure import JudgedParameters, Outcome

LAUNCH = INSPECTION
"""Inspection of launches: each by itself, at rest throughout."""
Part = Literal["gyros", "accelerometers", "all", "none"]


class NoiseParameters(JudgedParameters):
    """Steps of the analysis, each of which can be switched off; the effect of each is in the result's table."""

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
    """Longest averaging time of the channels, the dwell that a calibration needs; None: no channel has one."""
    drawn_launch: int = 1
    """Number, from 1, of the launch whose band, interval and lines are drawn."""


R = TypeVar("R", bound=NoiseResult)


def analyse_launches(
    result: type[R], recordings: Sequence[Recording], params: NoiseParameters, unit: Unit | None = None
) -> R:
    """Analyse each recording as a launch of its own, block by block, then all of them together, with checks.

    `unit`: lines are matched to its declared dithers, and declared triads are held to the thesis's limits where no
    other is given. Raises `UnfitRecording`, `MissingChannel`, `BadParameter`.
    """
    if not recordings:
        raise UnfitRecording("there is no recording to analyse")
    settings = params.settings()
    if params.band_launch > len(recordings):
        raise BadParameter("band_launch", params.band_launch, f"1 … {len(recordings)}, the launches that there are")
    labels = titles(recordings)
    launches = tuple(_matched(launch, unit) for launch in all_launches(recordings, labels, settings))
    names = {tuple((c.channel, c.rate_unit) for c in launch.channels) for launch in launches}
    if len(names) > 1:
        raise UnfitRecording("the recordings have different channels: analyse them one by one")
    channels = summarise(launches)
    checks = launch_checks(launches, channels, params.noise_limits, unit)
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
