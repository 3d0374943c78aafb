"""Noise coefficients of one channel at rest, by the service's own analysis of a launch."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from procedures.analysis.launch.analysis import analyse_launch
from procedures.analysis.launch.results import ChannelNoise, Reading
from procedures.analysis.launch.settings import LaunchSettings
from procedures.core.errors import BadParameter
from procedures.core.recording import Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.core.units import DEVIATION_DISPLAY, NOISE_DISPLAY
from procedures.library.arguments import Samples, positive, series, si_unit
from procedures.library.figure import axes

LETTERS = {
    "quantization": "Q",
    "random_walk": "N",
    "bias_instability": "B",
    "rate_random_walk": "K",
    "rate_ramp": "R",
}


@dataclass(frozen=True)
class Noise:
    """The five processes of one channel by maximum likelihood, with the other findings of the analysis."""

    channel: ChannelNoise
    """Complete analysis in SI: curves, read-off, least squares, band, averaging time."""

    @property
    def coefficients(self) -> dict[str, Reading]:
        """Letter Q, N, B, K, R → value, standard uncertainty, interval, upper limit [SI]; value None: not observed."""
        return {letter: self.channel.coefficient(name).likelihood for name, letter in LETTERS.items()}

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences of the inspection of the samples, and on features that the noise model does not describe."""
        return (*self.channel.findings, *self.channel.warnings)

    def __str__(self) -> str:
        lines = [_line(letter, name, self) for name, letter in LETTERS.items()]
        return "\n".join([*lines, *(f"warning: {w}" for w in self.warnings)])

    def plot(self, ax: Any = None) -> Any:
        """Draw the Allan deviation that the coefficients refer to, in the unit people read; returns the axes."""
        ax = axes(ax)
        curve, (unit, size) = self.channel.analysed.curve, DEVIATION_DISPLAY[self.channel.rate_unit]
        ax.loglog(curve.tau_s, np.asarray(curve.deviation) / size)
        ax.fill_between(curve.tau_s, np.asarray(curve.lower) / size, np.asarray(curve.upper) / size, alpha=0.2)
        ax.set_xlabel("τ, s")
        ax.set_ylabel(f"σ(τ), {unit}")
        ax.grid(visible=True, which="both", alpha=0.3)
        return ax


def noise(
    y: Samples,
    rate_hz: float,
    *,
    unit: str = "rad/s",
    increments: bool = False,
    cell_s: float = 1.0,
    warm_up: bool = False,
    confidence: float = 0.95,
) -> Noise:
    """Quantization Q, angle random walk N, bias instability B, rate random walk K, ramp R of a record at rest.

    Maximum likelihood over the record's spectrum, beside least squares of the Allan deviation and values read off it
    (IEEE Std 952, annex C; thesis 3.1).

    Parameters
    ----------
    y : (n,) rates in `unit`, or with `increments` increments a sample in `unit` times s. rate_hz : [Hz].
    unit : rad/s, deg/s, deg/h, m/s^2 or µg. cell_s : cells whose means the slow part uses [s].
    warm_up : True removes the start-up transient. confidence : of the intervals.

    Raises `BadParameter`, `UnfitRecording`.
    """
    samples, rate = series("y", y), positive("rate_hz", rate_hz)
    si, size = si_unit(unit)
    if not 0.0 < confidence < 1.0:
        raise BadParameter("confidence", confidence, "between 0 and 1")
    if positive("cell_s", cell_s) * rate < 1.0:
        raise BadParameter("cell_s", cell_s, f"at least {1.0 / rate:g} s, one sample")
    turning = si == "rad/s"
    quantities = (
        (Quantity.ANGLE_INCREMENT, "rad") if turning else (Quantity.VELOCITY_INCREMENT, "m/s"),
        (Quantity.ANGULAR_RATE, "rad/s") if turning else (Quantity.SPECIFIC_FORCE, "m/s^2"),
    )
    quantity, channel_unit = quantities[0 if increments else 1]
    name = "gyro_x" if turning else "accelerometer_x"
    info = RecordingInfo("y", "", (Channel(name, quantity, channel_unit, size),), rate, len(samples))
    settings = LaunchSettings(
        cell_s=cell_s,
        fast=cell_s * rate >= 2.0,
        trim_gyros=warm_up,
        trim_accelerometers=warm_up,
        heating_accelerometers=warm_up,
        wavelet_rule=None,
        confidence=confidence,
    )
    launch = analyse_launch(MemoryRecording(info, samples[:, None]), "y", settings)
    return Noise(launch.channels[0])


def _line(letter: str, name: str, of: Noise) -> str:
    unit, size = NOISE_DISPLAY[of.channel.rate_unit][name]
    found = of.coefficients[letter]
    if found.value is None or found.standard_uncertainty is None:
        limit = f", below {found.upper_limit / size:.2g} {unit}" if found.upper_limit is not None else ""
        return f"{letter} not observed{', unbounded' if found.unbounded else limit}"
    return f"{letter} {found.value / size:.4g} ± {found.standard_uncertainty / size:.2g} {unit}"
