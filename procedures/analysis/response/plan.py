"""Plan of a dynamic response: sinusoids of several frequencies about each axis of the unit, and the uncertainty to
expect.

The amplitude falls with the frequency, so that rate and acceleration stay within the table's limits.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, hypot, pi, sqrt
from typing import Literal

from procedures.analysis.response.fit import Lag, fit_lags
from procedures.analysis.response.phasors import Response, density
from procedures.analysis.turns.plan import UPRIGHT
from procedures.core import units
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import AXES, Station
from procedures.core.sinusoid import PEAK_ACCELERATION, Sinusoid

Axis = Literal["x", "y", "z"]
LIMIT_SHARE = 0.8
"""Share of rate and acceleration that amplitudes without a given size use; the rest is for the servo."""
LARGEST_DEG = 5.0
"""Largest amplitude without a given size: the gyros' other axes feel little of the Earth's rate then [deg]."""
LEAST_RECORDED = 10
"""Smallest number of whole cycles of a recording."""


@dataclass(frozen=True)
class ResponseProgram:
    """Program of sinusoids of the outer axis, the same about each axis of the unit."""

    axes: tuple[Axis, ...]
    frequencies_hz: tuple[float, ...]
    amplitudes_deg: tuple[float, ...]
    """Amplitude at each frequency."""
    record_s: float
    """Least length of a recording [s]; it holds whole cycles."""
    slack_s: float
    """Time for which the sinusoid goes on beyond its recording [s]."""
    settle_s: float

    def recorded_cycles(self, frequency_hz: float) -> int:
        """Return the number of whole cycles of a recording at a frequency."""
        return max(LEAST_RECORDED, ceil(self.record_s * frequency_hz - 1e-9))

    def stations(self) -> tuple[Station, ...]:
        """Return the stations, axis after axis, frequency after frequency."""
        made: list[Station] = []
        for axis in self.axes:
            for frequency, amplitude in zip(self.frequencies_hz, self.amplitudes_deg, strict=True):
                recorded = self.recorded_cycles(frequency)
                lead = Sinusoid("outer", amplitude, frequency, recorded + 3).lead_s
                cycles = ceil(recorded + (lead + self.slack_s) * frequency) + 1
                swing = Sinusoid("outer", amplitude, frequency, cycles)
                label = f"{axis} {frequency:g} Hz, {amplitude:.4g} deg"
                length_s = recorded / frequency
                made.append(Station(len(made), label, UPRIGHT[axis], None, self.settle_s, length_s, sinusoid=swing))
        return tuple(made)

    def beyond_stations_s(self) -> float:
        """Return the time in which the table swings and nothing is recorded [s]."""
        return sum(s.sinusoid.duration_s - s.record_s for s in self.stations() if s.sinusoid is not None)


def largest_amplitude_deg(frequency_hz: float, rate_deg_s: float, acceleration_deg_s2: float) -> float:
    """Return the largest amplitude within shares of the limits ``2πfA`` and ``1.12·(2πf)²A``, at most `LARGEST_DEG`
    [deg].
    """
    omega = 2.0 * pi * frequency_hz
    by_rate, by_acceleration = rate_deg_s / omega, acceleration_deg_s2 / (PEAK_ACCELERATION * omega**2)
    return min(LARGEST_DEG, LIMIT_SHARE * by_rate, LIMIT_SHARE * by_acceleration)


@dataclass(frozen=True)
class EncoderQuality:
    """Scatter and rate of an encoder as a plan expects them."""

    sd_arcsec: float
    """Standard deviation of one reading."""
    rate_hz: float
    """Readings a second."""


def predicted_lags(
    program: ResponseProgram,
    noise: Sequence[NoiseCoefficients],
    rate_hz: float,
    encoder: EncoderQuality | None,
    linearity: float,
) -> tuple[Lag, ...]:
    """Fits, by axis of the program, that a unit without a lag is expected to give; `noise` of the channels x, y, z.

    `encoder` None: an ideal one, so that the gyro's share is left.
    """
    found: list[Lag] = []
    for axis in program.axes:
        responses = [
            _predicted(program, noise[AXES.index(axis)], rate_hz, encoder, frequency, amplitude)
            for frequency, amplitude in zip(program.frequencies_hz, program.amplitudes_deg, strict=True)
        ]
        found.append(fit_lags({axis: responses}, linearity).lags[0])
    return tuple(found)


def _predicted(
    program: ResponseProgram,
    noise: NoiseCoefficients,
    rate_hz: float,
    encoder: EncoderQuality | None,
    frequency_hz: float,
    amplitude_deg: float,
) -> Response:
    length_s = program.recorded_cycles(frequency_hz) / frequency_hz
    theta = amplitude_deg * units.DEG
    # Quantization at the recording's ends, 4Q²/T² in each part, is beyond its density.
    variance = density(noise, frequency_hz, rate_hz) / length_s + (2.0 * noise.quantization / length_s) ** 2
    of_gyro = sqrt(variance) / (2.0 * pi * frequency_hz * theta)
    of_encoder = 0.0
    if encoder is not None:
        of_encoder = encoder.sd_arcsec * units.ARCSEC * sqrt(2.0 / (encoder.rate_hz * length_s)) / theta
    sd = max(hypot(of_gyro, of_encoder), 1e-12)
    return Response(
        label=f"{frequency_hz:g} Hz, {amplitude_deg:g} deg",
        frequency_hz=frequency_hz,
        amplitude_rad=theta,
        value=1.0 + 0.0j,
        gain_sd=sd,
        phase_sd=sd,
        noise_ratio=1.0,
        noise_degrees=0.0,
        within_s=0.0,
        drift=0.0,
        drift_sd=0.0,
    )
