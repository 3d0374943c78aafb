"""Result of `allan_deviation`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import BandCurve, Check, Density, Statement, Verdict


class LaunchCurvesCurve(Part):
    """The deviation of one channel of one recording; all lists go with `tau_s`."""

    recording: str
    channel: str
    unit: str
    tau_s: tuple[float, ...]
    deviation: tuple[float, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    terms: tuple[int, ...]
    edf: tuple[float, ...]
    noise_exponent: tuple[float, ...]
    density: Density | None = None
    band: BandCurve | None = None


class AllanDeviationDocument(Part):
    """Every curve, in the order of recordings and channels."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    statistic: str
    confidence: float
    curves: tuple[LaunchCurvesCurve, ...]


class AllanDeviationResult(ResultHead):
    """A result: Allan deviation and its relatives."""

    kind: Literal["method"]
    name: Literal["allan_deviation"]
    document: AllanDeviationDocument
