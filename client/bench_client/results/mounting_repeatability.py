"""Result of `mounting_repeatability`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class CrossCoupling(Part):
    """Repeatability of one cross-coupling over n mountings; plain numbers in radians, JSON-ready."""

    triad: str
    name: str
    mean: float
    sd: float
    low: float
    high: float
    within_sd: float | None
    within_degrees: int
    expected_from_measurement: float
    values: tuple[float, ...]


class MountingRepeatabilityDocument(Part):
    """Repeatability of each cross-coupling over the mountings."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    mountings: tuple[str, ...]
    cross_couplings: tuple[CrossCoupling, ...]


class MountingRepeatabilityResult(ResultHead):
    """A result: Repeatability of the seat."""

    kind: Literal["method"]
    name: Literal["mounting_repeatability"]
    document: MountingRepeatabilityDocument
