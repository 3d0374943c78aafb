"""Result of `kalman_calibration`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class InnovationTest(Part):
    """Test of one channel's innovations: their size and their whiteness."""

    mean_square: float
    """Mean normalised innovation squared; 1 is expected."""
    degrees_of_freedom: int
    """Degrees of freedom"""
    correlation: float
    """Mean product of neighbouring innovations; 0 is expected."""
    size_p_value: float
    """Chance of a sum of squares so far from its expectation, to either side, by a channel as recorded."""
    whiteness_p_value: float
    """Chance of so large a mean product, of either sign, by a channel as recorded."""
    since_s: float | None
    """Beginning of the first stretch that alone is too large or too small, after the first measurement; None: none
    [s]
    """


class ChannelBias(Part):
    """Bias of one channel of one recording. Lists go with `time_s`, since the recording's beginning; SI, or
    counts.
    """

    recording: str
    """Recording, by its id"""
    channel: str
    """Name of the channel"""
    unit: str
    """Unit of measurement"""
    noise: str
    """Noise model: "record" is the unit's coefficients; "observed" those that the spectrum of the means shows."""
    bias: float
    """Bias b, in the output unit"""
    standard_uncertainty: float
    """Standard uncertainty, in the unit of the value"""
    white_standard_uncertainty: float
    """Standard uncertainty by S's filter, with the variance of one measurement and no covariance."""
    batch_mean: float
    """Plain mean of the channel over the recording"""
    target_sd: float | None
    """Target uncertainty; None for a channel in counts."""
    enough_after_s: float | None
    """Time at which the filter reached its target, at which the dwell might have ended; None if it never did [s]"""
    dwell_needed_s: float | None
    """Dwell predicted from the record alone; None where no dwell is long enough or the record is empty [s]"""
    innovations_p_value: float
    """P-value of the innovations' squares, two-sided: small where the noise is larger or smaller than declared."""
    slow_noise_p_value: float
    """P-value of the scatter of ten parts of the recording: small where the channel wanders more than claimed."""
    time_s: tuple[float, ...]
    """Times since the recording's beginning [s]"""
    estimates: tuple[float, ...]
    """Estimates"""
    sds: tuple[float, ...]
    """Standard uncertainties"""
    innovations: InnovationTest | None = None
    """Test of the innovations; None in results of versions before 1.2.0."""


class KalmanCalibrationDocument(Part):
    """Every channel of every recording."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    biases: tuple[ChannelBias, ...]
    """Bias of each channel and recording"""
    failed_channels: tuple[str, ...] = ()
    """Channels that fail the test of their innovations or of their slow noise, each once."""


class KalmanCalibrationResult(ResultHead):
    """A result: Kalman calibration of a constant bias."""

    kind: Literal["method"]
    name: Literal["kalman_calibration"]
    document: KalmanCalibrationDocument
