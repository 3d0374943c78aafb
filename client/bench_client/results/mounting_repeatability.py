"""Result of `mounting_repeatability`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class CrossCoupling(Part):
    """Repeatability of one cross-coupling over n mountings, in radians."""

    triad: str
    """Triad: gyro or accelerometer"""
    name: str
    """Symbol of the coefficient: "K12", …"""
    mean: float
    """Mean of the mountings' means, relative to K_ii: an angle [rad]."""
    sd: float
    """Repeatability: sample standard deviation of the mountings' means, ``√(Σ(m − m̄)²/(n − 1))`` [rad]."""
    low: float
    """Lower end of the 95 % interval of the true standard deviation (chi-square, n − 1 degrees of freedom) [rad]."""
    high: float
    """Upper end of the 95 % interval of the true standard deviation (chi-square, n − 1 degrees of freedom) [rad]."""
    within_sd: float | None
    """Pooled standard deviation of repeated calibrations under the same mounting [rad]; None: none was repeated."""
    within_degrees: int
    """Degrees of freedom of `within_sd`."""
    expected_from_measurement: float
    """Standard deviation of the mountings' means that the calibrations' own uncertainties give [rad]."""
    values: tuple[float, ...]
    """Mean of each mounting [rad], in the order of the mountings."""


class MountingRepeatabilityDocument(Part):
    """Repeatability of each cross-coupling over the mountings."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    mountings: tuple[str, ...]
    """Ids of the mountings, in the order of their first calibration."""
    cross_couplings: tuple[CrossCoupling, ...]
    """Spread of each cross-coupling between mountings"""


class MountingRepeatabilityResult(ResultHead):
    """A result: Repeatability of the seat."""

    kind: Literal["method"]
    name: Literal["mounting_repeatability"]
    document: MountingRepeatabilityDocument
