"""Result of `run_to_run`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class Scatter(Part):
    """Sample standard deviation of one coefficient over n calibrations."""

    triad: str
    """Triad: gyro or accelerometer"""
    name: str
    """"bias x", "scale factor x", …"""
    unit: str
    """The bias's unit, or "1" for a scale factor: relative to its mean."""
    mean: float
    """Mean value"""
    sd: float
    """``s = √(Σ(x − x̄)²/(n − 1))``."""
    low: float
    """Lower end of the 95 % interval of the true standard deviation (chi-square, n − 1 degrees of freedom)."""
    high: float
    """Upper end of the 95 % interval of the true standard deviation (chi-square, n − 1 degrees of freedom)."""
    expected_from_measurement: float
    """Standard deviation expected from the calibrations' uncertainties for a stable unit; an upper figure, since
    the constant flaws of one table repeat.
    """
    values: tuple[float, ...] = ()
    """The coefficient in each calibration."""
    value_sds: tuple[float, ...] = ()
    """Standard uncertainty of each of `values`."""


class RunToRunDocument(Part):
    """Sample standard deviations (n − 1) with their intervals, and the resolution of the calibrations."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    scatters: tuple[Scatter, ...]
    """Scatter of each coefficient between the calibrations"""


class RunToRunResult(ResultHead):
    """A result: Stability from launch to launch."""

    kind: Literal["method"]
    name: Literal["run_to_run"]
    document: RunToRunDocument
