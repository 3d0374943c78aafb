"""Result of `polarity_check`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class Answers(Part):
    """Answers of a triad's channels to the three axes, and what they mean."""

    triad: str
    """Triad: gyro or accelerometer"""
    matrix: tuple[tuple[float, ...], ...]
    """Row: channel x, y, z; column: axis turned or pointed upwards. Per unit of the input; see `relative`."""
    relative: bool
    """True for channels in counts: the matrix is divided by its largest element."""
    axes: tuple[str, ...]
    """Axis that each channel answers to: "+x", "−y", "nothing" or "no single axis"."""


class PolarityCheckDocument(Part):
    """Answers of both triads to the three axes, and in words what is wrong."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    triads: tuple[Answers, ...]
    """Triads, one entry each"""
    sentences: tuple[str, ...]
    """The findings, as sentences"""


class PolarityCheckResult(ResultHead):
    """A result: Polarity check of both triads."""

    kind: Literal["procedure"]
    name: Literal["polarity_check"]
    document: PolarityCheckDocument
