"""Result of `dynamic_response`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class ResponsePoint(Part):
    """Response at one frequency, with its standard uncertainties and the fitted model."""

    frequency_hz: float
    """Frequency [Hz]"""
    amplitude_deg: float
    """Amplitude by the encoder [deg]"""
    gain: float
    """Rate by the gyro over rate by the encoder, nominal scale factor."""
    gain_sd: float
    """Standard uncertainty of the gain"""
    phase_deg: float
    """Phase of the gyro before the encoder: negative where it is late [deg]"""
    phase_sd_deg: float
    """Standard uncertainty of the phase [deg]"""
    modelled_gain: float
    """Gain by the fitted model"""
    modelled_phase_deg: float
    """Phase by the fitted model [deg]"""
    noise_ratio: float
    """Power of the noise beside the sinusoid over that of the unit's record and of the encoder's scatter."""


class ChannelResponse(Part):
    """Delay and bandwidth of one gyro channel against the encoder."""

    channel: str
    """Name of the channel"""
    gain: float
    """Gain of slow motion by the nominal scale factor."""
    gain_standard_uncertainty: float
    """Standard uncertainty of the gain"""
    delay_s: float
    """Delay of the samples against their stamps, of slow motion: pure delay and lag together [s]."""
    delay_standard_uncertainty_s: float
    """Standard uncertainty of the delay [s]"""
    delay_from_noise_s: float
    """Part of that uncertainty by noise, and by stamps that scatter from recording to recording [s]"""
    delay_from_encoder_s: float
    """Part of that uncertainty by the time of the encoder's readings [s]"""
    delay_from_clock_s: float
    """Part of that uncertainty by the unit's clock, where that differs from the bench's: the delay is another at
    each moment of a recording, from its begin to its end by ``drift·T``, and counts as a rectangle's
    ``drift·T/√12`` [s]
    """
    delay_degrees_of_freedom: int | None
    """Degrees of freedom of the uncertainty where the stamps' scatter was estimated; None: so many that none
    counts.
    """
    time_constant_s: float | None
    """Time constant of a first-order lag [s]; None: none shows."""
    time_constant_standard_uncertainty_s: float | None
    """Standard uncertainty of the time constant [s]"""
    bandwidth_hz: float | None
    """Frequency of −3 dB by the fitted lag [Hz]; None: not reached, above `bandwidth_above_hz`."""
    bandwidth_standard_uncertainty_hz: float | None
    """Standard uncertainty of the bandwidth [Hz]"""
    bandwidth_above_hz: float
    """Frequency above which the bandwidth lies with 95 % [Hz]."""
    extrapolated: bool
    """True where the bandwidth lies beyond the highest frequency, so that it rests on the model of one lag."""
    chi_square: float
    """Weighted sum of squared residuals"""
    degrees_of_freedom: int
    """Degrees of freedom"""
    p_value: float | None
    """p-value: probability that noise alone gives a statistic at least this large"""
    gain_p_value: float | None
    """Chance of the gains' residuals alone: small where the response is not that of one lag."""
    clock_difference_ppm: float
    """The unit's clock against the bench's, by the drift of the phases; positive: the unit falls behind [ppm]"""
    clock_difference_standard_uncertainty_ppm: float
    """Standard uncertainty of the difference of the clocks [ppm]"""
    points: tuple[ResponsePoint, ...]
    """Points, in order"""


class DynamicResponse(Part):
    """Results of a dynamic response for all channels, with the scatter of the stamps and warnings."""

    channels: tuple[ChannelResponse, ...]
    """Channels, in order"""
    stamp_scatter_s: float
    """Standard deviation of the delay from recording to recording beyond the noise [s]; 0: none shows."""
    p_value_without_scatter: float | None
    """p-value: probability that noise alone gives a statistic at least this large, without scatter between the
    frequencies
    """
    encoder_within_s: float
    """Mean of half the intervals in which the encoder was read [s]."""
    warnings: tuple[str, ...]
    """What to know before believing the numbers, as sentences"""


class DynamicResponseDocument(Part):
    """Delay and bandwidth of each gyro channel, and the verdict."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    gyro: DynamicResponse
    """Gyro triad"""


class DynamicResponseResult(ResultHead):
    """A result: Delay and bandwidth of the gyros by sinusoidal motion."""

    kind: Literal["procedure"]
    name: Literal["dynamic_response"]
    document: DynamicResponseDocument
