"""Result of `static_run`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict
from bench_client.results.shared_by_two import ChannelSummary, LaunchNoise


class StaticRunDocument(Part):
    """Noise of the unit, launch by launch and together."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error; null: open, or nothing was judged"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """statement of conformity; None without checks and in results of older versions"""
    launches: tuple[LaunchNoise, ...]
    """Launches, in order"""
    channels: tuple[ChannelSummary, ...]
    """Channels, in order"""
    averaging_time_s: float | None
    """Averaging time at which quantization falls below the other noise [s]"""
    drawn_launch: int = 1
    """Launch whose band and intervals are drawn, from 1"""


class StaticRunResult(ResultHead):
    """A result: Static launches."""

    kind: Literal["procedure"]
    name: Literal["static_run"]
    document: StaticRunDocument
