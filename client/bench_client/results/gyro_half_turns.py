"""Result of `gyro_half_turns`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class GyroChannel(Part):
    """Result of one gyro [rad/s]."""

    channel: str
    horizontal: bool
    half_difference: float
    standard_uncertainty: float
    lower: float
    upper: float
    within_sd: float
    half_sum: float
    half_sum_sd: float


class GyroHalfTurnsDocument(Part):
    """Results of three channels and the rate that the two horizontal ones measure together."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    channels: tuple[GyroChannel, ...]
    pairs: int
    horizontal_rate_rad_s: float
    horizontal_rate_sd_rad_s: float
    expected_rad_s: float | None


class GyroHalfTurnsResult(ResultHead):
    """A result: Gyros alone, by half turns."""

    kind: Literal["method"]
    name: Literal["gyro_half_turns"]
    document: GyroHalfTurnsDocument
