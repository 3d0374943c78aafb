"""Result of `entered_thermal_correction`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, ThermalCorrection, Verdict


class EnteredThermalCorrectionDocument(Part):
    """The correction as it is stored, a degree."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    origin: str
    """Origin of the numbers: passport, certificate or table"""
    correction: ThermalCorrection
    """The correction"""


class EnteredThermalCorrectionResult(ResultHead):
    """A result: Thermal correction from known coefficients."""

    kind: Literal["method"]
    name: Literal["entered_thermal_correction"]
    document: EnteredThermalCorrectionDocument
