"""Complex amplitudes at a known frequency by least squares, and the noise beside them in the spectrum.

``x(t) = Re(X·exp(iωt)) + a + b·t``, columns ``cos ωt, −sin ωt, 1, t``; a and b take up bias, Earth's rate and drift.
"""

from dataclasses import dataclass, replace
from math import inf, pi

import numpy as np

from procedures.analysis.response.trace import Samples
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.noise import NoiseCoefficients

BESIDE = (*range(-9, -1), *range(2, 10))
"""Distances, in units of 1/T, of the frequencies beside the sinusoid at which the noise is estimated."""
LOWEST_BESIDE = 0.5
"""Share of the sinusoid's frequency below which none of them is used: drift that was taken out is missing there."""
TIED = 1.85
"""Factor by which a Hann window lessens the degrees of freedom of neighbours' powers: 1 + 2·(2/3)⁴ + 2·(1/6)⁴ of many,
a little less of sixteen.
"""
WORST_CONDITION = 1e6
LEAST_READINGS = 5
"""Least number of the encoder's readings in half a recording, for a drift: the fit has four terms."""
NOISIEST = 0.1
"""Largest relative standard deviation of a response that is used: beyond it phases are no longer normal."""


@dataclass(frozen=True)
class Response:
    """Response of one gyro channel at one frequency."""

    label: str
    frequency_hz: float
    amplitude_rad: float
    """Amplitude of the encoder's angle [rad]."""
    value: complex
    """``Y/(iω·Θ)``: rate by the gyro over rate by the encoder; the mean over a sample's interval is taken out."""
    gain_sd: float
    """Standard deviation of the gain, relative."""
    phase_sd: float
    """Standard deviation of the phase [rad]."""
    noise_ratio: float
    """Power of the noise beside the sinusoid over that of the unit's record and the encoder's scatter."""
    noise_degrees: float
    """Degrees of freedom of that power; 0 where it is no ratio, because the record is not known."""
    within_s: float
    """Mean of half the intervals in which the encoder was read [s]."""
    drift: float
    """Change of the phase over the recording, over ``ωT``: the unit's clock against the bench's, relative."""
    drift_sd: float
    length_s: float = 0.0
    """Length of the recording by its samples [s]."""

    @property
    def omega(self) -> float:
        """Angular frequency of the sinusoid [rad/s]."""
        return 2.0 * pi * self.frequency_hz


def density(noise: NoiseCoefficients, frequency_hz: float, rate_hz: float) -> float:
    """One-sided power spectral density of a rate channel [rate²/Hz], ramp excepted.

    ``2N² + B²/(πf) + K²/(2π²f²) + 8Q²·f_s·sin²(πf/f_s)`` (IEEE Std 952 Annex C; quantization is white over the readings
    of the integrated output, whose differences the samples are).
    """
    f = frequency_hz
    slow = noise.bias_instability**2 / (pi * f) + noise.rate_random_walk**2 / (2.0 * pi**2 * f**2)
    return 2.0 * noise.random_walk**2 + slow + 8.0 * noise.quantization**2 * rate_hz * np.sin(pi * f / rate_hz) ** 2


def response(samples: Samples, frequency_hz: float, noise: NoiseCoefficients | None) -> Response:
    """Response at a frequency. `noise`: of the channel by the unit's record; None: that beside the sinusoid is used.

    The caller decides what to make of noise that is more than the record's and the encoder's scatter (`noise_ratio`).
    Raises `UnfitRecording` where the readings cannot tell the sinusoid from a drift, or where encoder or channel show
    none.
    """
    omega, encoder = 2.0 * pi * frequency_hz, samples.encoder
    length_s = len(samples.time_s) / samples.rate_hz
    spread = float(np.sinc(frequency_hz / samples.rate_hz)) if samples.integrates else 1.0
    of_angle = fitted(encoder.time_s, encoder.angle_rad, omega, samples.label)
    of_rate = fitted(samples.time_s, samples.rate_rad_s, omega, samples.label)
    theta, gyro, scatter = of_angle.value, of_rate.value, of_angle.scatter
    if not abs(theta) > 10.0 * scatter:
        raise UnfitRecording(f"station {samples.label}: the encoder shows no sinusoid of {frequency_hz:g} Hz")
    value = gyro / (1j * omega * theta * spread)
    beside = _beside(samples, of_angle.left, of_rate.left, value * spread, frequency_hz, length_s)
    covariance = 0.5 * float(np.mean(list(beside.values()))) * np.eye(2)
    ratio, degrees = 1.0, 0.0
    if noise is not None:
        ratio = _ratio(beside, noise, samples.rate_hz, length_s, scatter * abs(value))
        degrees = 2.0 * len(beside) / TIED
        covariance = _covariance(of_rate.weights, noise, frequency_hz, samples.rate_hz, length_s)
        covariance += (omega * abs(value) * spread * scatter) ** 2 * np.eye(2)
    gain_sd, phase_sd = _along(covariance, gyro)
    require_known(samples.label, max(gain_sd, phase_sd))
    drift, drift_sd = _drift(samples, omega, length_s, phase_sd)
    return Response(
        label=samples.label,
        frequency_hz=frequency_hz,
        amplitude_rad=abs(theta),
        value=value,
        gain_sd=gain_sd,
        phase_sd=phase_sd,
        noise_ratio=ratio,
        noise_degrees=degrees,
        within_s=encoder.within_s,
        drift=drift,
        drift_sd=drift_sd,
        length_s=length_s,
    )


def require_known(label: str, relative_sd: float) -> None:
    """Refuse a response whose relative standard uncertainty is too large. Raises `UnfitRecording`."""
    if not relative_sd < NOISIEST:
        raise UnfitRecording(
            f"station {label}: the response is known to {min(100.0 * relative_sd, 999.0):.3g} % alone, more than "
            f"{100.0 * NOISIEST:g} %: the channel is dead, the amplitude too small or the recording too short"
        )


@dataclass(frozen=True)
class Fitted:
    """Complex amplitude of a sinusoid, fitted with a constant and a drift; its residuals and weights."""

    value: complex
    left: Array
    """Residuals, (n,)."""
    scatter: float
    """Standard deviation of a component of the value by the residuals' scatter, as if they were white."""
    weights: Array
    """Weights of the values in real and imaginary part, (2, n)."""


def _ratio(
    beside: dict[float, float], noise: NoiseCoefficients, rate_hz: float, length_s: float, angle: float
) -> float:
    """Mean power beside the sinusoid over the expected; `angle`: scatter of the encoder's amplitude times the gain."""
    expected = (density(noise, at_hz, rate_hz) / length_s + (2.0 * pi * at_hz * angle) ** 2 for at_hz in beside)
    return float(np.mean([0.5 * power / e for power, e in zip(beside.values(), expected, strict=True)]))


def _covariance(
    weights: Array, noise: NoiseCoefficients, frequency_hz: float, rate_hz: float, length_s: float
) -> Array:
    """Covariance of the parts of a rate's amplitude, (2, 2) [rad²/s²], of the unit's noise.

    White noise and quantization through the very weights: readings at the ends of the recording count more than within.
    Slow noise by its density S, ``S/T`` in each part.
    """
    slow = replace(noise, random_walk=0.0, quantization=0.0)
    steps = np.diff(np.pad(weights, ((0, 0), (1, 1))), axis=1)
    quantized = (noise.quantization * rate_hz) ** 2 * steps @ steps.T
    white = noise.random_walk**2 * rate_hz * weights @ weights.T
    return white + quantized + density(slow, frequency_hz, rate_hz) / length_s * np.eye(2)


def _along(covariance: Array, value: complex) -> tuple[float, float]:
    """Relative standard deviations along a complex value and across it, from the covariance of its parts."""
    size = abs(value)
    if size == 0.0:
        return inf, inf
    along = np.array([value.real, value.imag]) / size
    across = np.array([-along[1], along[0]])
    return float(np.sqrt(along @ covariance @ along)) / size, float(np.sqrt(across @ covariance @ across)) / size


def _design(times: Array, omega: float, length_s: float) -> Array:
    phase = omega * times
    return np.stack([np.cos(phase), -np.sin(phase), np.ones_like(times), times / length_s - 0.5], axis=1)


def fitted(times: Array, values: Array, omega: float, label: str) -> Fitted:
    """Complex amplitude at ω [rad/s] of values (n,) at some times [s], (n,).

    Raises `UnfitRecording` where they cannot tell a sinusoid from a drift.
    """
    design = _design(times, omega, max(float(times[-1]), 1e-9))
    if len(times) <= design.shape[1] or np.linalg.cond(design) > WORST_CONDITION:
        raise UnfitRecording(
            f"station {label}: {len(times)} values over {times[-1] - times[0]:.3g} s cannot tell a sinusoid of "
            f"{omega / (2.0 * pi):g} Hz from a drift"
        )
    weights: Array = np.asarray(np.linalg.solve(design.T @ design, design.T), dtype=np.float64)
    found = weights @ values
    left = values - design @ found
    variance = float(left @ left) / (len(times) - design.shape[1])
    scatter = float(np.sqrt(variance * 0.5 * np.sum(weights[:2] ** 2)))
    return Fitted(complex(found[0], found[1]), left, scatter, weights[:2])


def _beside(
    samples: Samples, angle_left: Array, rate_left: Array, followed: complex, frequency_hz: float, length_s: float
) -> dict[float, float]:
    """Power ``|Y − H·iωΘ|²`` [rad²/s²] of the residuals by frequency [Hz]: noise, less the table's own motion there.

    With a Hann window w, ``∫w·θ'·e^(−iωt) = ∫(iω·w − w')·θ·e^(−iωt)``, whatever the ends; scaled so that white noise
    has the power that it has without a window.
    """
    size = np.sqrt(0.375)
    found: dict[float, float] = {}
    for k in BESIDE:
        at_hz = frequency_hz + k / length_s
        if at_hz < LOWEST_BESIDE * frequency_hz:
            continue
        omega = 2.0 * pi * at_hz
        turn, times = 2.0 * pi * samples.time_s / length_s, samples.encoder.time_s
        gyro = np.mean(0.5 * (1.0 - np.cos(turn)) * rate_left * np.exp(-1j * omega * samples.time_s))
        turn = 2.0 * pi * times / length_s
        weight = 1j * omega * 0.5 * (1.0 - np.cos(turn)) - pi / length_s * np.sin(turn)
        table = np.mean(weight * angle_left * np.exp(-1j * omega * times))
        found[at_hz] = float(np.abs(2.0 * (gyro - followed * table) / size) ** 2)
    return found


def fitted_piece(
    samples: Samples, omega: float, span_s: tuple[float, float], least: int
) -> tuple[Fitted, Fitted] | None:
    """Return the phasors of rate and encoder within a span of the recording [s], its end left out; None for fewer than
    `least` readings of the encoder. Raises as `fitted`.
    """
    encoder, (begin_s, end_s) = samples.encoder, span_s
    own = (samples.time_s >= begin_s) & (samples.time_s < end_s)
    read = (encoder.time_s >= begin_s) & (encoder.time_s < end_s)
    if np.count_nonzero(read) < least:
        return None
    return (
        fitted(samples.time_s[own], samples.rate_rad_s[own], omega, samples.label),
        fitted(encoder.time_s[read], encoder.angle_rad[read], omega, samples.label),
    )


def _drift(samples: Samples, omega: float, length_s: float, phase_sd: float) -> tuple[float, float]:
    """Phase of the second half less that of the first, over ω·T/2, and its standard deviation ``4·sd/(ωT)``."""
    phases: list[complex] = []
    for span_s in ((-inf, 0.5 * length_s), (0.5 * length_s, inf)):
        half = fitted_piece(samples, omega, span_s, LEAST_READINGS)
        if half is None:
            return 0.0, inf
        gyro, theta = half
        phases.append(gyro.value / theta.value)
    # Each half has √2 times the whole's deviation; their difference √2 times that again.
    return float(np.angle(phases[1] / phases[0])) / (0.5 * omega * length_s), 4.0 * phase_sd / (omega * length_s)
