"""Result of `gyro_half_turns`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class GyroChannel(Part):
    """Result of one gyro [rad/s]: half difference, half sum, and their uncertainties."""

    channel: str
    """Name of the channel"""
    horizontal: bool
    """True for the two gyros whose axes are horizontal."""
    half_difference: float
    """Component of the Earth's rate along the channel at the unturned heading."""
    standard_uncertainty: float
    """Standard uncertainty from the scatter of the pairs."""
    lower: float
    """Lower end of the interval of 95 %, with Student's factor for the number of pairs."""
    upper: float
    """Upper end of the interval of 95 %, with Student's factor for the number of pairs."""
    within_sd: float
    """Standard uncertainty expected from the noise within the recordings alone."""
    half_sum: float
    """Bias of the channel; that of the vertical one includes the Earth's vertical rate, where no latitude is
    given.
    """
    half_sum_sd: float
    """Standard uncertainty of the half sum, from the scatter of the pairs."""


class GyroHalfTurnsDocument(Part):
    """Results of three channels and the rate that the two horizontal ones measure together."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    channels: tuple[GyroChannel, ...]
    """Channels, in order"""
    pairs: int
    """Number of pairs of opposite headings"""
    horizontal_rate_rad_s: float
    """Horizontal part of the Earth's rate, from the two horizontal gyros [rad/s]"""
    horizontal_rate_sd_rad_s: float
    """Standard uncertainty of the horizontal rate [rad/s]"""
    expected_rad_s: float | None
    """Horizontal part of the Earth's rate at the given latitude; null: no latitude [rad/s]"""


class GyroHalfTurnsResult(ResultHead):
    """A result: Gyros alone, by half turns."""

    kind: Literal["method"]
    name: Literal["gyro_half_turns"]
    document: GyroHalfTurnsDocument
