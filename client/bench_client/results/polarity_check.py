"""Result of `polarity_check`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class Answers(Part):
    """Answers of a triad's channels to the three axes, and what they mean."""

    triad: str
    matrix: tuple[tuple[float, ...], ...]
    relative: bool
    axes: tuple[str, ...]


class PolarityCheckDocument(Part):
    """Answers of both triads to the three axes, and in words what is wrong."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    triads: tuple[Answers, ...]
    sentences: tuple[str, ...]


class PolarityCheckResult(ResultHead):
    """A result: Polarity check of both triads."""

    kind: Literal["procedure"]
    name: Literal["polarity_check"]
    document: PolarityCheckDocument
