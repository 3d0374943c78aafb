"""Result of `dynamic_response`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class ResponsePoint(Part):
    """Response at one frequency, with its standard uncertainties and the fitted model."""

    frequency_hz: float
    amplitude_deg: float
    gain: float
    gain_sd: float
    phase_deg: float
    phase_sd_deg: float
    modelled_gain: float
    modelled_phase_deg: float
    noise_ratio: float


class ChannelResponse(Part):
    """Delay and bandwidth of one gyro channel against the encoder."""

    channel: str
    gain: float
    gain_standard_uncertainty: float
    delay_s: float
    delay_standard_uncertainty_s: float
    delay_from_noise_s: float
    delay_from_encoder_s: float
    delay_degrees_of_freedom: int | None
    time_constant_s: float | None
    time_constant_standard_uncertainty_s: float | None
    bandwidth_hz: float | None
    bandwidth_standard_uncertainty_hz: float | None
    bandwidth_above_hz: float
    extrapolated: bool
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None
    gain_p_value: float | None
    clock_difference_ppm: float
    clock_difference_standard_uncertainty_ppm: float
    points: tuple[ResponsePoint, ...]


class DynamicResponse(Part):
    """Results of all channels."""

    channels: tuple[ChannelResponse, ...]
    stamp_scatter_s: float
    p_value_without_scatter: float | None
    encoder_within_s: float
    warnings: tuple[str, ...]


class DynamicResponseDocument(Part):
    """Delay and bandwidth of each gyro channel, and the verdict."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    gyro: DynamicResponse


class DynamicResponseResult(ResultHead):
    """A result: Delay and bandwidth of the gyros by sinusoidal motion."""

    kind: Literal["procedure"]
    name: Literal["dynamic_response"]
    document: DynamicResponseDocument
