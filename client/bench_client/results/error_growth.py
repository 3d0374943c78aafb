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
    """Source"""
    after_1h_m: float
    """Share of the position error after one hour [m]"""
    at_end_m: float
    """Share of the position error at the end [m]"""


class ErrorGrowthDocument(Part):
    """Growth of position, velocity and attitude errors, and the contributions to it."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error; null: open, or nothing was judged"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """statement of conformity; None without checks and in results of older versions"""
    basis: str
    """Basis of the uncertainties, as a sentence"""
    sentence: str
    """The finding, as a sentence"""
    schuler_period_s: float
    """Schuler period of the site [s]"""
    time_s: tuple[float, ...]
    """Time [s]"""
    curves: tuple[NavigationGrowthSummaryCurve, ...]
    """Standard deviation of each error over time"""
    radius_95_m: tuple[float, ...]
    """Radius that holds the position with 95 %, at each time [m]"""
    shares: tuple[ResultShare, ...]
    """Share of each source in the position error"""
    radius_95_1h_m: float
    """Radius that holds the position with 95 % after one hour [m]"""
    calibration_radius_95_1h_m: float | None
    """Radius of 95 % after one hour by the calibration's own uncertainty alone [m]"""
    uncalibrated_1h_m: float | None
    """Radius of 95 % after one hour without any calibration; null: it could not navigate [m]"""


class ErrorGrowthResult(ResultHead):
    """A result: Error growth of a parked navigator."""

    kind: Literal["method"]
    name: Literal["error_growth"]
    document: ErrorGrowthDocument
