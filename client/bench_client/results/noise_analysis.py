"""Result of `noise_analysis`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict
from bench_client.results.shared_by_two import ChannelSummary, LaunchNoise


class NoiseAnalysisDocument(Part):
    """Noise of the recordings."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    launches: tuple[LaunchNoise, ...]
    channels: tuple[ChannelSummary, ...]
    averaging_time_s: float | None
    drawn_launch: int = 1


class NoiseAnalysisResult(ResultHead):
    """A result: Noise of recordings at rest."""

    kind: Literal["method"]
    name: Literal["noise_analysis"]
    document: NoiseAnalysisDocument
