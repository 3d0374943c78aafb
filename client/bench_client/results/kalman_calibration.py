"""Result of `kalman_calibration`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class InnovationTest(Part):
    """Test of one channel's innovations."""

    mean_square: float
    degrees_of_freedom: int
    correlation: float
    size_p_value: float
    whiteness_p_value: float
    since_s: float | None


class ChannelBias(Part):
    """Bias of one channel of one recording. Lists go with `time_s`, since the recording's beginning; SI, or
    counts.
    """

    recording: str
    channel: str
    unit: str
    noise: str
    bias: float
    standard_uncertainty: float
    white_standard_uncertainty: float
    batch_mean: float
    target_sd: float | None
    enough_after_s: float | None
    dwell_needed_s: float | None
    innovations_p_value: float
    slow_noise_p_value: float
    time_s: tuple[float, ...]
    estimates: tuple[float, ...]
    sds: tuple[float, ...]
    innovations: InnovationTest | None = None


class KalmanCalibrationDocument(Part):
    """Every channel of every recording."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    biases: tuple[ChannelBias, ...]
    failed_channels: tuple[str, ...] = ()


class KalmanCalibrationResult(ResultHead):
    """A result: Kalman calibration of a constant bias."""

    kind: Literal["method"]
    name: Literal["kalman_calibration"]
    document: KalmanCalibrationDocument
