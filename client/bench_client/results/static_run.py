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
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    launches: tuple[LaunchNoise, ...]
    """Launches, in order"""
    channels: tuple[ChannelSummary, ...]
    """Channels, in order"""
    averaging_time_s: float | None
    """Longest averaging time of the channels, the dwell that a calibration needs; None: no channel has one [s]"""
    drawn_launch: int = 1
    """Number, from 1, of the launch whose band, interval and lines are drawn."""


class StaticRunResult(ResultHead):
    """A result: Static launches."""

    kind: Literal["procedure"]
    name: Literal["static_run"]
    document: StaticRunDocument
