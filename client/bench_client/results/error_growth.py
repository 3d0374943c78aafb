"""Result of `error_growth`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class NavigationGrowthSummaryCurve(Part):
    """One error's standard deviation over the times of a growth."""

    name: str
    """Name"""
    unit: str
    """Unit of measurement"""
    sd: tuple[float, ...]
    """Standard deviation"""


class ResultShare(Part):
    """Contribution of one source alone: radii that hold the position with 95 %, in m."""

    source: str
    """Source of the error"""
    after_1h_m: float
    """Share of the position error after one hour [m]"""
    at_end_m: float
    """Share of the position error at the end [m]"""


class ErrorGrowthDocument(Part):
    """Growth of position, velocity and attitude errors, and the contributions to it."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    basis: str
    """Basis of the errors: a calibration, or declared values."""
    sentence: str
    """The finding, as a sentence"""
    schuler_period_s: float
    """Schuler period of the site [s]"""
    time_s: tuple[float, ...]
    """Times of `curves` and `radius_95_m`, from zero on [s]"""
    curves: tuple[NavigationGrowthSummaryCurve, ...]
    """Standard deviation of each error over time"""
    radius_95_m: tuple[float, ...]
    """Radius of the circle about the true place that holds the navigator's with 95 %, at `time_s` [m]"""
    shares: tuple[ResultShare, ...]
    """Contribution of each source to the position error, the greatest first; after one hour even if `hours` is
    less.
    """
    radius_95_1h_m: float
    """Radius that holds the position with 95 % after one hour [m]"""
    calibration_radius_95_1h_m: float | None
    """Radius after one hour by the calibration's uncertainty alone, without launch and noise; None: no calibration
    [m]
    """
    uncalibrated_1h_m: float | None
    """Position error of nominal outputs after one hour; None: no calibration, or too large for the equations [m]"""


class ErrorGrowthResult(ResultHead):
    """A result: Error growth of a parked navigator."""

    kind: Literal["method"]
    name: Literal["error_growth"]
    document: ErrorGrowthDocument
