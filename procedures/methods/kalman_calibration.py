"""Kalman calibration of a constant bias from recordings at rest, sample by sample, with the time it took to be sure.

Textbook S 5.4.3 and 6.2 take the noise for white. The unit's is not: quantization ties neighbouring means (of opposite
signs, so that it falls faster than white noise), flicker ties all of them (so that a longer dwell hardly helps). The
filter has the whole covariance of the unit's record; the claim of the white filter is given for comparison.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from procedures.analysis.fitness.findings import FitnessSettings
from procedures.analysis.fitness.watched import Inspection
from procedures.analysis.recursive_bias import window_noise
from procedures.analysis.recursive_bias.innovations import InnovationTest, innovation_test
from procedures.analysis.recursive_bias.kalman import RecursiveBias, white_covariance
from procedures.analysis.recursive_bias.window_noise import WindowMeans
from procedures.core import units
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.limits import ASKED, Check, Limit, check, significance, verdict
from procedures.core.recording import ACCELEROMETER, GYRO, Recording
from procedures.core.report import Figure, Report, Series, Table
from procedures.core.unit import Unit
from procedures.parameters import planned_tests
from procedures.procedure import Evidence, Method, Outcome, RecordedParameters


class Params(RecordedParameters):
    """Channels, prior knowledge and target uncertainty of the filter."""

    channels: tuple[str, ...] | None = Field(None, min_length=1, max_length=64, description="None: both triads")
    window_s: float = Field(
        1.0, gt=0.0, le=3600.0, description="averaging time of one measurement; lengthened for long recordings"
    )
    known_input: dict[str, float] = Field(
        default_factory=dict[str, float],
        description="by channel, rad/s or m/s²: what it measures in addition to its bias",
    )
    gyro_prior_sd_deg_h: float | None = Field(
        None, gt=0.0, le=1e6, description="standard deviation of the bias about zero; None: unknown"
    )
    accelerometer_prior_sd_m_s2: float | None = Field(None, gt=0.0, le=100.0)
    gyro_target_sd_deg_h: float = Field(0.005, gt=0.0, le=1e6, description="a third of thesis 4.3's 0.015")
    accelerometer_target_sd_m_s2: float = Field(1.5e-4, gt=0.0, le=100.0, description="a third of thesis 4.3's 0.0005")
    level: float = Field(
        0.01,
        gt=0.0,
        le=0.2,
        description="chance that a channel of sound recordings fails: two tests a channel and recording share it",
    )

    def level_of_each(self, channels: int) -> float:
        """Return the level of one test, by Bonferroni; `channels` counts those of all recordings."""
        return self.level / (2 * max(1, channels))


@dataclass(frozen=True)
class ChannelBias:
    """Bias of one channel of one recording. Lists go with `time_s`, since the recording's beginning; SI, or counts."""

    recording: str
    channel: str
    unit: str
    noise: str
    """Noise model: "record" is the unit's coefficients; "observed" those that the spectrum of the means shows."""
    bias: float
    standard_uncertainty: float
    white_standard_uncertainty: float
    """Standard uncertainty by S's filter, with the variance of one measurement and no covariance."""
    batch_mean: float
    target_sd: float | None
    """Target uncertainty; None for a channel in counts."""
    enough_after_s: float | None
    """Time at which the filter reached its target, at which the dwell might have ended; None if it never did."""
    dwell_needed_s: float | None
    """Dwell predicted from the record alone; None where no dwell is long enough or the record is empty."""
    innovations_p_value: float
    """P-value of the innovations' squares, two-sided: small where the noise is larger or smaller than declared."""
    slow_noise_p_value: float
    """P-value of the scatter of ten parts of the recording: small where the channel wanders more than claimed."""
    time_s: tuple[float, ...]
    estimates: tuple[float, ...]
    sds: tuple[float, ...]
    innovations: InnovationTest | None = None
    """Test of the innovations; None in results of versions before 1.2.0."""


class Result(Outcome):
    """Every channel of every recording."""

    biases: tuple[ChannelBias, ...]
    failed_channels: tuple[str, ...] = ()
    """Channels that fail the test of their innovations or of their slow noise, each once."""


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Return the biases of each recording alone: each orientation has its constant. Raises `MissingChannel`,
    `UnfitRecording`.
    """
    if not evidence.recordings:
        raise UnfitRecording("there is no recording to estimate a bias from")
    biases = tuple(b for r in evidence.recordings for b in _of_recording(r, params, unit))
    level = params.level_of_each(len(biases))
    checks = tuple(c for b in biases for c in _checks(b, level))
    failed = tuple(dict.fromkeys(b.channel for b in biases if _failed(b, level)))
    warnings = (*_named(biases, level), *_warnings(biases))
    return Result(checks=checks, verdict=verdict(checks), warnings=warnings, biases=biases, failed_channels=failed)


def report(result: Result) -> Report:
    """Return the report with a row a channel, and the convergence of each estimate."""
    columns = ("channel", "recording", "unit", "bias", "±", "± if white", "enough after, s", "dwell needed, s")
    rows = tuple(
        (
            *(b.channel, b.recording, name, b.bias / size, b.standard_uncertainty / size),
            *(b.white_standard_uncertainty / size, b.enough_after_s, b.dwell_needed_s),
        )
        for b in result.biases
        for name, size in (units.DISPLAY[b.unit],)
    )
    table = Table("Constant bias", columns, rows, "± one standard uncertainty; a dash: no dwell, or not known.")
    return Report(sections=(table, *(_figure(b) for b in result.biases)))


def _figure(b: ChannelBias) -> Figure:
    name, size = units.DISPLAY[b.unit]
    # From the second on: without a prior the first is as uncertain as one measurement and would hide the rest.
    y, sd = (tuple(v / size for v in values[1:]) for values in (b.estimates, b.sds))
    series = (
        Series("estimate", b.time_s[1:], y, style="line"),
        Series(
            "one standard uncertainty about the last",
            b.time_s[1:],
            tuple(b.bias / size + s for s in sd),
            (),
            "reference",
        ),
        Series("below it", b.time_s[1:], tuple(b.bias / size - s for s in sd), (), "reference"),
    )
    return Figure(f"{b.channel}, {b.recording}", "time, s", f"bias, {name}", series)


def _of_recording(recording: Recording, params: Params, unit: Unit | None) -> list[ChannelBias]:
    names = window_noise.channel_names(recording, params.channels, GYRO + ACCELEROMETER)
    for name in params.known_input:
        if name not in names:
            raise BadParameter("known_input", name, f"one of {', '.join(names)}")
    taken = window_noise.window_means(recording, names, params.window_s)
    return [_of_channel(recording, params, unit, taken, c, name) for c, name in enumerate(names)]


def _of_channel(
    recording: Recording, params: Params, unit: Unit | None, taken: WindowMeans, column: int, name: str
) -> ChannelBias:
    info = recording.info
    rate_unit = info.channels[info.column(name)].rate_unit
    prior, target = _asked(params, rate_unit)
    noise = window_noise.known_noise(unit.channel_noise(info.channels[info.column(name)]) if unit else None)
    z = taken.means[:, column] - params.known_input.get(name, 0.0)
    covariance = (
        window_noise.spectral_covariance(z, taken.length_s)
        if noise is None
        else window_noise.contiguous_covariance(noise, taken.windows)
    )
    variance = None if prior is None else prior**2
    bias = RecursiveBias(covariance, 0.0, variance)
    estimates = [bias.update(float(value)) for value in z]
    tested = innovation_test(bias.innovations, taken.length_s, params.level)
    white = RecursiveBias(white_covariance(float(np.mean(np.diagonal(covariance))), len(z)), 0.0, variance)
    enough = None if target is None else bias.enough_at(target)
    needed = (
        window_noise.dwell_needed(noise, target, info.start_s, variance, params.window_s)
        if noise is not None and target is not None
        else None
    )
    return ChannelBias(
        recording=info.station.label if info.station else info.id,
        channel=name,
        unit=rate_unit,
        noise="observed" if noise is None else "record",
        bias=bias.estimate,
        standard_uncertainty=bias.sd,
        white_standard_uncertainty=float(np.sqrt(white.variances[-1])),
        batch_mean=float(z.mean()),
        target_sd=target,
        enough_after_s=None if enough is None else enough * taken.length_s,
        dwell_needed_s=needed,
        innovations_p_value=tested.p_value,
        innovations=tested,
        slow_noise_p_value=window_noise.slow_noise_p(z, covariance),
        time_s=tuple((taken.length_s * np.arange(1, len(z) + 1)).tolist()),
        estimates=tuple(estimates),
        sds=tuple(np.sqrt(bias.variances).tolist()),
    )


def _asked(params: Params, rate_unit: str) -> tuple[float | None, float | None]:
    """Prior and target standard deviation in SI; none for counts."""
    if rate_unit == "rad/s":
        prior = params.gyro_prior_sd_deg_h
        return (None if prior is None else prior * units.DEG_PER_HOUR), params.gyro_target_sd_deg_h * units.DEG_PER_HOUR
    if rate_unit == "m/s^2":
        return params.accelerometer_prior_sd_m_s2, params.accelerometer_target_sd_m_s2
    return None, None


def _failed(b: ChannelBias, level: float) -> bool:
    """Whether the channel fails: by its innovations where its noise is known, or by noise slower than that."""
    return (b.noise == "record" and b.innovations_p_value < level) or b.slow_noise_p_value < level


def _named(biases: Sequence[ChannelBias], level: float) -> list[str]:
    """One sentence for each channel that failed: which, in which recording, by what."""
    found: list[str] = []
    for b in biases:
        if not _failed(b, level):
            continue
        said = b.innovations.sentence(level) if b.innovations is not None and b.noise == "record" else ""
        slow = f"its means wander more than its noise allows (p = {b.slow_noise_p_value:.1g})"
        reasons = [text for text in (said, slow if b.slow_noise_p_value < level else "") if text]
        found.append(f"failed channel {b.channel}, {b.recording}: {'; '.join(reasons)}")
    return found


def _checks(b: ChannelBias, level: float) -> tuple[Check, ...]:
    name, size = units.DISPLAY[b.unit]
    where = f"{b.channel}, {b.recording}"
    found = [significance(f"{where}: scatter of ten parts, p-value", b.slow_noise_p_value, level)]
    if b.noise == "record":
        found.append(significance(f"{where}: innovations, p-value", b.innovations_p_value, level))
    if b.target_sd is not None:
        limit = Limit(name, b.target_sd / size, source=ASKED)
        found.append(check(f"{where}: standard uncertainty", b.standard_uncertainty / size, limit))
    return tuple(found)


def _warnings(biases: Sequence[ChannelBias]) -> list[str]:
    observed = sorted({b.channel for b in biases if b.noise == "observed"})
    found: list[str] = []
    if observed:
        found.append(
            f"{', '.join(observed)}: the unit's record has no noise in their unit; quantization, random walk and "
            "flicker come from the recording's own spectrum, slower noise is not in the uncertainty"
        )
    for b in biases:
        name, size = units.DISPLAY[b.unit]
        if b.noise == "record" and b.target_sd is not None and b.dwell_needed_s is None:
            found.append(
                f"{b.channel}, {b.recording}: no dwell makes the bias as sure as {b.target_sd / size:g} {name}: "
                "slow noise stops it"
            )
    return found


def inspection(params: Params, count: int) -> Inspection:
    """Return the settings of the inspection: the requested channels of each recording by itself."""
    return Inspection(FitnessSettings(least_samples=1, counters_may_rest=True), params.channels or GYRO + ACCELEROMETER)


TESTS = "innovations and scatter of all channels, smallest p-value"
"""Name of the planned test; its level is shared among the channels, which are known with the recordings."""

METHOD = Method(
    "kalman_calibration",
    "Kalman calibration of a constant bias",
    "1.2.0",
    Params,
    Result,
    analyse,
    report,
    planned_checks=lambda params, _unit, _planned: planned_tests(params, "level", TESTS),
    inspection=inspection,
)
