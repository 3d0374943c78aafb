"""Result of `scale_factor_whole_turns`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict, WholeTurns


class ScaleFactorWholeTurnsDocument(Part):
    """The gyro triad's coefficients, the scale factor at each rate, and the verdict."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    gyro: WholeTurns
    """Gyro triad"""
    make_calibration: bool = False
    """Whether the coefficients became the gyros' current calibration"""


class ScaleFactorWholeTurnsResult(ResultHead):
    """A result: Gyro scale factor by whole turns."""

    kind: Literal["procedure"]
    name: Literal["scale_factor_whole_turns"]
    document: ScaleFactorWholeTurnsDocument
