"""Result of `error_growth`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class NavigationGrowthSummaryCurve(Part):
    """One error's standard deviation over the times of a growth."""

    name: str
    unit: str
    sd: tuple[float, ...]


class ResultShare(Part):
    """Contribution of one source alone: radii that hold the position with 95 %, in m."""

    source: str
    after_1h_m: float
    at_end_m: float


class ErrorGrowthDocument(Part):
    """Growth of position, velocity and attitude errors, and the contributions to it."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    basis: str
    sentence: str
    schuler_period_s: float
    time_s: tuple[float, ...]
    curves: tuple[NavigationGrowthSummaryCurve, ...]
    radius_95_m: tuple[float, ...]
    shares: tuple[ResultShare, ...]
    radius_95_1h_m: float
    calibration_radius_95_1h_m: float | None
    uncalibrated_1h_m: float | None


class ErrorGrowthResult(ResultHead):
    """A result: Error growth of a parked navigator."""

    kind: Literal["method"]
    name: Literal["error_growth"]
    document: ErrorGrowthDocument
