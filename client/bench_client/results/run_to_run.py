"""Result of `run_to_run`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class Scatter(Part):
    """Sample standard deviation of one coefficient over n calibrations; plain numbers, JSON-ready."""

    triad: str
    name: str
    unit: str
    mean: float
    sd: float
    low: float
    high: float
    expected_from_measurement: float
    values: tuple[float, ...] = ()
    value_sds: tuple[float, ...] = ()


class RunToRunDocument(Part):
    """Sample standard deviations (n − 1) with their intervals, and the resolution of the calibrations."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    scatters: tuple[Scatter, ...]


class RunToRunResult(ResultHead):
    """A result: Stability from launch to launch."""

    kind: Literal["method"]
    name: Literal["run_to_run"]
    document: RunToRunDocument
