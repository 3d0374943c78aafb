"""Result of `scale_factor_whole_turns`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict, WholeTurns


class ScaleFactorWholeTurnsDocument(Part):
    """The gyro triad's coefficients, the scale factor at each rate, and the verdict."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    gyro: WholeTurns
    make_calibration: bool = False


class ScaleFactorWholeTurnsResult(ResultHead):
    """A result: Gyro scale factor by whole turns."""

    kind: Literal["procedure"]
    name: Literal["scale_factor_whole_turns"]
    document: ScaleFactorWholeTurnsDocument
