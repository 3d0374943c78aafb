"""Result of `static_run`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict
from bench_client.results.shared_by_two import ChannelSummary, LaunchNoise


class StaticRunDocument(Part):
    """Noise of the unit, launch by launch and together."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    launches: tuple[LaunchNoise, ...]
    channels: tuple[ChannelSummary, ...]
    averaging_time_s: float | None
    drawn_launch: int = 1


class StaticRunResult(ResultHead):
    """A result: Static launches."""

    kind: Literal["procedure"]
    name: Literal["static_run"]
    document: StaticRunDocument
