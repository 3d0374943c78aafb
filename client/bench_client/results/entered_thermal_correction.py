"""Result of `entered_thermal_correction`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict
from bench_client.results.shared_by_two import ThermalCorrection


class EnteredThermalCorrectionDocument(Part):
    """The correction as it is stored, a degree."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    origin: str
    correction: ThermalCorrection


class EnteredThermalCorrectionResult(ResultHead):
    """A result: Thermal correction from known coefficients."""

    kind: Literal["method"]
    name: Literal["entered_thermal_correction"]
    document: EnteredThermalCorrectionDocument
